"""A run as it is shown: begun or not, followed to whatever ends it, and what its numbers say. In virtual time."""

import os
import signal
from dataclasses import replace
from math import nan
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from rich.progress import BarColumn

from gateway.cli.calibration import follow as following
from gateway.cli.calibration import runs
from gateway.cli.calibration.follow import NotBegunError, RestartedError, follow_run
from gateway.cli.calibration.runs import ENDED, LocalRun, RunStatus
from gateway.cli.errors import CliError
from gateway.processes import exit_codes


class Played:
    """A run whose looks show these phases, the last one again and again."""

    lost_words = "it goes on without us"

    def __init__(self, *phases: str) -> None:
        self.phases = list(phases)
        self.seen: list[str] = []
        self.stops = 0

    def begin(self) -> None: ...

    def look(self) -> RunStatus:
        assert len(self.seen) < 500, "followed for ever"
        phase = self.phases.pop(0) if len(self.phases) > 1 else self.phases[0]
        self.seen.append(phase)
        return RunStatus(phase, 0.25, 125.0, 10.0, 2.0)

    def stop(self) -> None:
        self.stops += 1

    def end(self) -> dict[str, Any]:
        return {"phase": self.seen[-1]}

    def close(self) -> None: ...


@pytest.fixture(autouse=True)
def clock(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    time = SimpleNamespace(now_s=0.0, monotonic=lambda: time.now_s)
    time.sleep = lambda pause_s: setattr(time, "now_s", time.now_s + pause_s)
    monkeypatch.setattr(following, "time", time)
    return time


def test_a_run_that_has_not_begun_within_two_seconds_is_told_as_such(clock: SimpleNamespace) -> None:
    """Nothing has moved, so nothing is said of what becomes of it."""
    with pytest.raises(NotBegunError, match="W305") as told:
        follow_run(Played("idle"))
    assert 2.0 <= clock.now_s <= 2.5 and Played.lost_words not in told.value.message


@pytest.mark.parametrize("end", ENDED)
def test_a_run_is_followed_to_any_end_however_long_it_takes(end: str) -> None:
    run = Played("idle", *["ladder"] * 100, end)
    assert follow_run(run) == {"phase": end} and not run.stops and len(run.seen) == 102


def test_a_run_that_is_lost_keeps_its_exit_code_and_what_becomes_of_it_is_told() -> None:
    class Lost(Played):
        def look(self) -> RunStatus:
            raise CliError("E131 no answer", exit_codes.DEVICE)

    with pytest.raises(CliError) as told:
        follow_run(Lost())
    assert told.value.exit_code == exit_codes.DEVICE
    assert told.value.message == f"E131 no answer\n{Played.lost_words}"


def test_a_run_whose_gateway_has_started_anew_is_none_that_was_not_begun(clock: SimpleNamespace) -> None:
    """A control that is killed is back before the next look: it knows of no run, and its log of no refusal."""
    with pytest.raises(RestartedError, match="A401 the gateway has started anew") as told:
        follow_run(Played("idle", *["ladder"] * 20, "idle"))
    assert Played.lost_words not in told.value.message and clock.now_s < 5.0


def test_a_run_that_was_stopped_is_followed_until_it_has_come_to_rest() -> None:
    class Interrupted(Played):
        def look(self) -> RunStatus:
            if not self.seen:
                self.seen.append("ladder")
                raise KeyboardInterrupt
            return super().look()

    run = Interrupted("ladder", "ladder", "stopped")
    assert follow_run(run) == {"phase": "stopped", "exit_code": 128 + signal.SIGHUP} and run.stops == 1


def test_a_second_end_from_outside_waits_until_the_stop_is_said() -> None:
    class Impatient(Played):
        def look(self) -> RunStatus:
            raise KeyboardInterrupt

        def stop(self) -> None:
            os.kill(os.getpid(), signal.SIGTERM)
            super().stop()

    run = Impatient("ladder")
    with pytest.raises(KeyboardInterrupt):
        follow_run(run)
    assert run.stops == 1


def test_what_is_shown_of_a_run(monkeypatch: pytest.MonkeyPatch) -> None:
    made, shown = [], following._progress
    monkeypatch.setattr(following, "_progress", lambda: made.append(shown()) or made[-1])
    follow_run(Played("ladder", "stored"))
    (task,) = made[0].tasks
    assert (task.completed, task.total, task.description) == (0.25, 1.0, "stored")
    assert task.fields == {"force": "2.00 V 10.00 N", "eta": "2:05 left"}
    unknown = RunStatus("zero", 0.0, nan, nan, nan)
    assert following._force(unknown) == following._eta(unknown) == following._eta(replace(unknown, eta_s=0.0)) == ""


@pytest.mark.parametrize(("columns", "has_bar"), [(60, False), (120, True)])
def test_a_narrow_terminal_shows_numbers_instead_of_a_bar(
    columns: int, has_bar: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    assert any(isinstance(column, BarColumn) for column in following._progress().columns) is has_bar


LAST = {
    "phase": "ladder", "progress": 0.5, "eta_s": 9.0, "force_n": None, "voltage_v": None, "group": 2, "groups": 5,
    "part_name": "ramps", "part": 1, "parts": 3, "recording": "0007", "ended": "stopped by 10.0.0.1",
    "result": {"stored": None},
}  # fmt: skip


def test_a_run_of_this_machine_is_asked_for_as_it_was_planned(monkeypatch: pytest.MonkeyPatch) -> None:
    asked, told = list[dict[str, Any]](), [LAST]
    monkeypatch.setattr(runs, "ask", lambda state, request: asked.append(request) or told[0])
    run = LocalRun(Path(), {"groups": 5}, [3, 4], "mine")
    run.begin()
    run.stop()
    assert asked == [
        {"do": "calibrate", "plan": {"groups": 5}, "continues": [3, 4], "name": "mine"},
        {"do": "calibrate", "stop": True},
    ]
    look = run.look()
    assert look.detail == " 2 of 5" and look.force_n != look.force_n and look.voltage_v != look.voltage_v
    assert run.end()["sentence"] == "stopped by 10.0.0.1"
    told[0] = LAST | {"phase": "experiment", "result": {"refused": "E421 too few stairs"}}
    assert run.look().detail == ": ramps (1 of 3)"
    assert run.end() == {"phase": "experiment", "recording": "0007", "sentence": "E421 too few stairs"}
