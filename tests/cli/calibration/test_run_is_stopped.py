"""A calibration from a terminal: nothing moves without a yes, and whatever ends the terminal takes the force to 0."""

import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gateway.cli.calibration import follow as following
from gateway.cli.calibration import runs
from gateway.cli.calibration.follow import follow_run
from gateway.cli.calibration.remote_run import RemoteRun
from gateway.cli.calibration.runs import RunStatus
from gateway.cli.errors import CliError
from gateway.cli.master.client import Frame, RefusedError
from gateway.processes import exit_codes
from gateway.registers.words import CalibrationPhase, ControlBit

PREVIEW = {
    "rig": "demo", "stairs": 20, "v_max_v": 7.0, "force_max_n": 49.0, "eta_s": 60.0, "simulated": True, "notes": [],
    "experiment": "", "questions": [], "check": True, "rig_fingerprint": "",
}  # fmt: skip


class Climbing:
    """A run that climbs until it is told to stop; `end_of_terminal` comes with the first look."""

    def __init__(self, end_of_terminal: Callable[[], object]) -> None:
        self.did: list[str] = []
        self.looks = 0
        self._end_of_terminal = end_of_terminal

    def begin(self) -> None:
        self.did.append("begin")

    def look(self) -> RunStatus:
        self.looks += 1
        assert self.looks < 100, "it climbs on"
        if self.did == ["begin"]:
            self.did.append("look")
            self._end_of_terminal()
        return RunStatus("stopped" if "stop" in self.did else "ladder", 0.5, 1.0, 10.0, 2.0)

    def stop(self) -> None:
        self.did.append("stop")

    def end(self) -> dict[str, Any]:
        return {"phase": "stopped"}

    def close(self) -> None: ...


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_whatever_ends_the_terminal_stops_the_run(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(following, "_POLL_S", 0.0)
    run = Climbing(lambda: os.kill(os.getpid(), number))

    def kill(*_: object) -> None:
        raise AssertionError("it would have been killed")

    before = signal.signal(number, kill if number != signal.SIGINT else signal.default_int_handler)
    own = signal.getsignal(number)
    try:
        assert follow_run(run) == {"phase": "stopped", "exit_code": 128 + number}
        assert run.did == ["begin", "look", "stop"]
        assert signal.getsignal(number) is own
    finally:
        signal.signal(number, before)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("when", ["begins", "has begun"])
def test_an_end_while_the_run_begins_stops_it_too(number: int, when: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The request may have been heard already: what nobody stops climbs to its end, without anybody there."""
    monkeypatch.setattr(following, "_POLL_S", 0.0)
    end, show = (lambda: os.kill(os.getpid(), number)), following._progress

    class Beginning(Climbing):
        def begin(self) -> None:
            if when == "begins":
                end()
            super().begin()

    def show_first() -> Any:
        monkeypatch.setattr(following, "_progress", show)
        if when == "has begun":
            end()
        return show()

    monkeypatch.setattr(following, "_progress", show_first)
    run = Beginning(lambda: None)
    before = signal.signal(number, signal.default_int_handler)
    try:
        assert follow_run(run) == {"phase": "stopped", "exit_code": 128 + number}
    except KeyboardInterrupt:
        pytest.fail(f"left after {run.did}")
    finally:
        signal.signal(number, before)
    assert run.did == ["begin", "stop"]


def test_a_terminal_that_is_gone_without_a_signal_stops_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(following, "_POLL_S", 0.0)

    def write_to_nobody() -> None:
        raise BrokenPipeError

    run = Climbing(write_to_nobody)
    assert follow_run(run) == {"phase": "stopped", "exit_code": 128 + signal.SIGHUP}
    assert run.did == ["begin", "look", "stop"]


@pytest.mark.parametrize("yes", [0, 1, 2])
def test_without_a_yes_to_each_question_nothing_is_begun(
    call: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, yes: int
) -> None:
    asked = list[dict[str, Any]]()
    monkeypatch.setattr(runs, "ask", lambda state, request: asked.append(request) or PREVIEW)
    answer = call("calibrate", "--quick", "--state", tmp_path, input="y\n" * yes + "n\n")
    assert answer.exit_code == 1 and "not begun: nothing has moved" in answer.stderr
    assert [request.get("dry_run") for request in asked] == [True]


class Registers:
    """The client of a remote run. What it does is done in turn: one connection, two threads."""

    def __init__(self) -> None:
        self.run: RemoteRun | None = None
        self.words, self.beats = list[int](), 0
        self.check_map = self._in_turn
        self.phase = CalibrationPhase.STORED
        self.values: dict[str, float] = {}

    def _in_turn(self) -> None:
        assert self.run and self.run._turn.locked(), "both speak at once"

    def read_values(self, registers: list[Any]) -> list[Any]:
        self._in_turn()
        values = {"calibration_phase": float(self.phase), "calibration_stored": 3.0} | self.values
        return [type("Reading", (), {"value": values.get(register.name, 0.0)}) for register in registers]

    def frames(self, assignments: list[Any]) -> list[Frame]:
        return [Frame(each.register.address, (int.from_bytes(each.data, "big"),)) for each in assignments]

    def write(self, frame: Frame) -> None:
        self._in_turn()
        self.words += frame.words

    def write_values(self, assignments: list[Any]) -> None:
        self._in_turn()
        self.beats += 1
        if self.beats == 3:
            raise RefusedError(6, "write 1 at 4")
        assert self.beats < 3, "another master has it, and is disturbed"

    def close(self) -> None: ...


@pytest.fixture
def remote(monkeypatch: pytest.MonkeyPatch) -> Registers:
    registers = Registers()
    monkeypatch.setattr("gateway.cli.calibration.remote_run.GatewayClient", lambda *_: registers)
    monkeypatch.setattr("gateway.cli.calibration.remote_run.DEFAULT_PERIOD_S", 0.001)
    registers.run = RemoteRun(None, 1)  # type: ignore[arg-type]
    return registers


def test_a_remote_run_is_begun_and_stopped_by_its_bit_and_leaves_another_masters_lease_alone(remote: Registers) -> None:
    run = remote.run
    assert run
    run.begin()
    run._beat.join(5.0)
    assert not run._beat.is_alive() and remote.beats == 3
    run.stop()
    run.close()
    assert remote.words[::2] == [int(ControlBit.START_CALIBRATION), 0]


def test_the_end_of_the_run_before_is_not_taken_for_this_ones(remote: Registers) -> None:
    run = remote.run
    assert run
    run.begin()
    assert run.look().phase == "idle"
    remote.phase = CalibrationPhase.LADDER
    assert run.look().phase == "ladder"
    remote.phase = CalibrationPhase.STORED
    assert run.look().phase == "stored"
    run.close()


@pytest.mark.parametrize("is_heard", [True, False])
def test_a_start_whose_answer_is_lost_is_followed_where_it_has_begun(remote: Registers, is_heard: bool) -> None:
    """Noise on a line costs one request; left alone, the ladder would climb to its end with nobody there."""
    write = remote.write

    def lose_the_answer(frame: Frame) -> None:
        write(frame)
        remote.phase = CalibrationPhase.ZERO if is_heard else remote.phase
        raise CliError("E131 no answer", exit_codes.DEVICE)

    remote.write = lose_the_answer  # type: ignore[method-assign]
    run = remote.run
    assert run
    if is_heard:
        run.begin()
        assert run.look().phase == "zero" and run._beat.ident
    else:
        with pytest.raises(CliError, match="E131"):
            run.begin()
    run.close()


def test_one_lost_answer_ends_no_run_and_more_of_them_are_not_told_as_its_end(remote: Registers, monkeypatch) -> None:
    """The ladder goes on without us: only the gateway of this machine ends its run with itself."""
    monkeypatch.setattr(following, "_POLL_S", 0.0)
    read, lost = remote.read_values, [1]

    def lose_some(registers: list[Any]) -> list[Any]:
        if not remote.words:
            return read(registers)
        remote.phase = CalibrationPhase.STOPPED if 0 in remote.words else CalibrationPhase.LADDER
        if not lost[0]:
            return read(registers)
        lost[0] -= 1
        raise CliError("E131 no answer", exit_codes.DEVICE)

    remote.read_values = lose_some  # type: ignore[method-assign]
    run = remote.run
    assert run
    run.begin()
    assert run.look().phase == "ladder"
    lost[0] = 1_000_000
    with pytest.raises(CliError) as told:
        following._watch(run)
    run.close()
    assert "the run goes on" in told.value.message and "has ended" not in told.value.message


def test_a_stop_that_got_lost_is_sent_again(remote: Registers) -> None:
    write, said = remote.write, list[int]()

    def lose_the_first_stop(frame: Frame) -> None:
        said.extend(frame.words)
        if said[::2] == [int(ControlBit.START_CALIBRATION), 0]:
            raise CliError("E131 no answer", exit_codes.DEVICE)
        write(frame)

    remote.write = lose_the_first_stop  # type: ignore[method-assign]
    run = remote.run
    assert run
    run.begin()
    run.stop()
    run.close()
    assert remote.words[::2] == [int(ControlBit.START_CALIBRATION), 0]


def test_a_start_that_is_refused_beside_another_s_run_is_no_run_of_ours(remote: Registers) -> None:
    def refuse(frame: Frame) -> None:
        remote.phase = CalibrationPhase.LADDER
        raise CliError("W217 busy", exit_codes.FAILED)

    remote.write = refuse  # type: ignore[method-assign]
    run = remote.run
    assert run
    with pytest.raises(CliError, match="W217"):
        run.begin()
    assert not run._beat.ident, "whose lease is kept is somebody else's"
    run.close()


@pytest.mark.parametrize("phase", [CalibrationPhase.LADDER, CalibrationPhase.SELF_TEST])
def test_a_run_that_is_there_already_is_not_taken_for_ours(phase: CalibrationPhase, remote: Registers) -> None:
    remote.phase = phase
    run = remote.run
    assert run
    with pytest.raises(CliError, match="W310 a run has the output there already"):
        run.begin()
    assert not remote.words and not run._beat.ident


def test_what_is_refused_is_not_said_again(remote: Registers) -> None:
    said = list[int]()

    def refuse(frame: Frame) -> None:
        said.extend(frame.words)
        raise CliError("W210 not owner", exit_codes.FAILED)

    remote.write = refuse  # type: ignore[method-assign]
    assert remote.run
    with pytest.raises(CliError, match="W210"):
        remote.run.stop()
    assert said == [0]


def test_a_run_elsewhere_is_told_in_shares_and_volts(remote: Registers) -> None:
    remote.values = {"calibration_progress": 250.0, "output_voltage": 1500.0, "force_measured": 12.0}
    look = remote.run.look() if remote.run else None
    assert look and (look.progress, look.voltage_v, look.force_n) == (0.25, 1.5, 12.0)
