"""A calibration that somebody at this machine asked for, in virtual time: it lasts as long as somebody follows it."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from gateway.control.runs.ladder_stairs import QUICK
from gateway.recording import read_recording
from gateway.registers.words import CalibrationPhase, State
from gateway.service.running_rig.calibration_runs import FOLLOWED_S, CalibrationRuns
from gateway.service.running_rig.fit_launcher import Result
from gateway.service.running_rig.recording.run_recording import HANGS_S
from tests.disk.at_once import AtOnce
from tests.service.rigs import demo
from tests.service.running_rig.recording.test_run_recording import HangingDisk
from tests.service.running_rig.simulated_rig import CALIBRATE, TARE, SmallRig
from tests.service.wired import ENABLE, Wired

PLAN = {"step_v": QUICK.step_v, "groups": QUICK.groups, "minor_points": QUICK.minor_points}
SHORT = {"step_v": 2.0, "groups": 1, "minor_points": 0, "response_steps": 0}
POLL_S = 0.2  # of `calibrate`


def kept(wired: Wired, state: Path) -> CalibrationRuns:
    runs = CalibrationRuns(
        wired.controller,
        wired.rig,
        state,
        lambda: wired.now_s,
        lambda cause, sentence: wired.log.append((wired.now_s, sentence)),
    )
    runs.disk = runs.syncing = AtOnce()  # type: ignore[assignment]
    wired.loop.calibration_runs, runs.decide = runs, wired.loop.refresh
    wired.run(0.1)
    return runs


def test_a_run_goes_on_while_it_is_followed_and_ends_when_it_is_not(tmp_path: Path) -> None:
    wired = Wired().ready()
    runs = kept(wired, tmp_path)
    runs.answer({"plan": PLAN})
    for _ in range(round(2.0 * FOLLOWED_S / POLL_S)):
        wired.run(POLL_S)
        assert runs.answer({})["running"]
    left_s = wired.now_s
    wired.until(lambda: wired.state is State.OFF, FOLLOWED_S + 0.1)
    assert wired.now_s - left_s >= FOLLOWED_S
    assert wired.value("output_voltage") == 0.0
    assert wired.word("calibration_phase") == CalibrationPhase.STOPPED
    assert wired.said("A330")
    told = runs.status()
    assert "nobody at this machine" in told["ended"]
    header = read_recording(Path(told["recording"])).header
    assert header["ladder"]["groups"] == QUICK.groups
    assert header["calibration"] == wired.controller.calibration_id


def test_a_starved_load_cell_ends_it_as_a_fault_and_not_as_a_departure(tmp_path: Path) -> None:
    """What a busy machine does to a simulated rig: the cause that is told is the cell."""
    wired = Wired().ready()
    runs = kept(wired, tmp_path)
    runs.answer({"plan": PLAN})
    wired.run(1.0)
    wired.fault("cell-cut")
    wired.until(lambda: wired.state is State.FAULT, 0.4)
    wired.run(0.1)
    assert wired.said("A311")
    assert "A311" in runs.status()["ended"]
    assert wired.word("calibration_phase") == CalibrationPhase.STOPPED


def test_without_a_fresh_sample_or_while_pressing_no_run_begins(tmp_path: Path) -> None:
    wired = Wired().ready()
    runs = kept(wired, tmp_path)
    wired.fault("cell-cut")
    wired.run(0.5)
    with pytest.raises(ValueError, match="the load cell is silent"):
        runs.answer({"plan": PLAN})
    wired.fault("cell-cut", on=False)
    wired.run(0.5)
    wired.write(0, ENABLE, 1200)
    wired.run(0.5)
    with pytest.raises(ValueError, match="W305 calibration refused: state HOLDING, it begins from OFF"):
        runs.answer({"plan": PLAN})
    assert not runs.status()["running"]


def test_a_disk_that_takes_no_more_ends_the_run_for_its_stairs_would_be_wear_for_nothing(tmp_path: Path) -> None:
    wired = Wired().ready()
    runs = kept(wired, tmp_path)
    runs.answer({"plan": PLAN})
    runs.flush(0.0)
    wired.run(1.0)
    with open("/dev/full", "wb", buffering=0) as full:  # noqa: PTH123
        assert runs._recording and runs._recording._file
        os.dup2(full.fileno(), runs._recording._file._descriptor)
    runs.flush(1.0)
    wired.until(lambda: not runs.answer({})["running"], FOLLOWED_S)
    assert "E402" in runs.status()["ended"] and "No space left" in runs.status()["ended"]
    assert wired.word("calibration_phase") == CalibrationPhase.STOPPED
    wired.until(lambda: wired.value("output_voltage") == 0.0, 5.0)


def test_a_disk_that_takes_no_file_ends_the_run_at_its_beginning(tmp_path: Path) -> None:
    (tmp_path / "recordings").write_text("no folder")
    wired = Wired().ready()
    runs = kept(wired, tmp_path)
    runs.answer({"plan": PLAN})
    wired.until(lambda: bool(runs.answer({})["ended"]), 1.0)
    assert "A330 calibration stopped: the recording cannot be written: Not a directory" in runs.status()["ended"]
    assert runs.status()["recording"] is None
    assert wired.word("calibration_phase") == CalibrationPhase.STOPPED


def test_the_end_of_a_run_is_told_once_its_file_is_closed(tmp_path: Path) -> None:
    """Whoever follows it reads the file then."""
    wired = Wired().ready()
    runs = kept(wired, tmp_path)
    disk = runs.disk = runs.syncing = HangingDisk()  # type: ignore[assignment]
    runs.answer({"plan": PLAN})
    wired.run(1.0)
    runs.answer({"stop": True})
    wired.until(lambda: wired.state is State.OFF, 2.0)
    wired.run(0.1)
    told = runs.status()
    assert told["running"] and told["phase"] != "stopped" and told["recording"] is None
    disk.let_go()
    told = runs.status()
    assert not told["running"] and told["phase"] == "stopped"
    assert read_recording(Path(told["recording"])).rows > 80


# -- a disk that is slower than the run


class Fits(list[Path]):
    """Stands for `FitLauncher`: the recordings that are to be fitted, and who hears of it."""

    def __call__(self, recording: Path, rig_file: Path, state: Path, on_result: Callable[[Result], None]) -> None:
        self.append(recording)
        self.on_result = on_result


@pytest.fixture
def fits(monkeypatch: pytest.MonkeyPatch) -> Fits:
    fits = Fits()
    monkeypatch.setattr("gateway.service.running_rig.calibration_runs.FitLauncher", fits)
    return fits


def on_a_hanging_disk(state: Path) -> tuple[SmallRig, CalibrationRuns, HangingDisk]:
    rig = SmallRig()
    runs = CalibrationRuns(rig.controller, demo(), state, rig.now, rig.note)
    disk = runs.disk = runs.syncing = HangingDisk()  # type: ignore[assignment]
    rig.loop.calibration_runs = runs
    return rig, runs, disk


def climb(rig: SmallRig, runs: CalibrationRuns) -> None:
    """To the end of the run, with somebody who follows it."""
    rig.run(0.5)
    while rig.controller.active_run.running:
        runs.answer({})
        rig.run(1.0)


def test_a_run_begun_while_the_last_ones_file_is_being_closed_is_not_taken_for_it(tmp_path: Path, fits: Fits) -> None:
    rig, runs, disk = on_a_hanging_disk(tmp_path)
    runs.answer({"plan": SHORT})
    rig.run(1.0)
    disk.let_go()
    Path(runs.status()["recording"]).unlink()
    runs.answer({"stop": True})
    rig.until(State.OFF).run(0.1)
    assert runs.status()["running"], "its file is not closed yet"
    runs.answer({"plan": SHORT})
    rig.run(0.5)
    disk.let_go()
    told = runs.status()
    assert (told["running"], told["phase"], told["ended"]) == (True, "zero", ""), "the first one's failure is its own"
    climb(rig, runs)
    disk.let_go()
    told = runs.status()
    assert (told["running"], told["phase"]) == (False, "fitting")
    assert fits == [Path(told["recording"])]
    fits.on_result({"stored": 3, "report": "report.html"})
    assert (runs.stored, runs.status()["phase"]) == (3, "stored")
    assert runs.answer({"plan": SHORT})["result"] == {}, "that of the new run is not known yet"


def test_a_masters_run_needs_nobody_at_this_machine(tmp_path: Path) -> None:
    rig, _, disk = on_a_hanging_disk(tmp_path)
    rig.write(0, CALIBRATE)
    rig.run(FOLLOWED_S + 1.0)
    assert rig.state is State.CALIBRATING
    disk.let_go()
    rig.write(0, 0)
    rig.until(State.OFF).run(0.1)
    disk.let_go()


def test_a_dry_run_says_what_it_would_do_and_moves_nothing(tmp_path: Path) -> None:
    rig, runs, _ = on_a_hanging_disk(tmp_path)
    told = runs.answer({"plan": SHORT, "dry_run": True})
    rig.run(1.0)
    assert told["stairs"] > 10 and told["force_max_n"] > 30.0
    assert (rig.state, rig.wire.voltage_v, runs.status()["running"]) == (State.OFF, 0.0, False)
    assert runs.status()["recording"] is None


def test_a_fit_that_refuses_leaves_room_for_the_next_run(tmp_path: Path, fits: Fits) -> None:
    """The payload that hangs on the cell meanwhile is none of the model's force."""
    rig, runs, disk = on_a_hanging_disk(tmp_path)
    rig.write(9, 600)
    runs.answer({"plan": SHORT})
    climb(rig, runs)
    disk.let_go()
    recorded = read_recording(fits[0]).columns["force_n"]
    assert rig.loop.decision.force_measured_n > 5.0
    assert abs(recorded[:20]).max() < 1.0 and abs(recorded[-1]) < 3.0
    with pytest.raises(ValueError, match="being fitted"):
        runs.answer({"plan": SHORT})
    fits.on_result({"refused": "A332 no"})
    assert (runs.status()["phase"], runs.status()["result"]) == ("refused", {"refused": "A332 no"})
    assert rig.controller.refusal_of_run(rig.now(), QUICK) == ""


def test_a_masters_run_continues_none_of_this_machines(tmp_path: Path) -> None:
    rig, runs, disk = on_a_hanging_disk(tmp_path)
    rig.write(9, 600)
    rig.write(0, TARE)
    headers = []
    for ask in (
        lambda: runs.answer({"plan": SHORT, "continues": [7], "name": "Monday"}),
        lambda: rig.write(0, CALIBRATE),
    ):
        ask()
        rig.run(0.5)
        runs.answer({"stop": True})
        rig.until(State.OFF).run(0.1)
        disk.let_go()
        headers.append(read_recording(Path(runs.status()["recording"])).header)
    assert [(header["continues"], header["name"]) for header in headers] == [([7], "Monday"), ([], "")]
    assert headers[0]["zero_n"] == rig.controller.zero_n > 5.0


def test_a_ladder_behind_which_no_sample_comes_is_closed_all_the_same(
    tmp_path: Path, fits: Fits, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig, runs, disk = on_a_hanging_disk(tmp_path)
    monkeypatch.setattr(runs, "append", lambda *row: None)
    runs.answer({"plan": SHORT})
    climb(rig, runs)
    rig.run(1.0)
    disk.let_go()
    assert fits == [Path(runs.status()["recording"])]


def delete_its_file(runs: CalibrationRuns, disk: HangingDisk) -> None:
    disk.let_go()
    Path(runs.status()["recording"]).unlink()


def refuse_its_file(runs: CalibrationRuns, disk: HangingDisk) -> None:
    (runs._state / "recordings").write_text("no folder")


def take_nothing(runs: CalibrationRuns, disk: HangingDisk) -> None:
    disk.let_go()
    runs.flush(0.0)


@pytest.mark.parametrize(
    ("spoil", "why"),
    [
        (delete_its_file, "somebody has deleted its file"),
        (refuse_its_file, "the disk took no recording"),
        (take_nothing, "the disk has taken nothing for 30 s"),
    ],
)
def test_a_ladder_that_the_disk_has_not_taken_whole_is_not_fitted(
    spoil: Callable[[CalibrationRuns, HangingDisk], None], why: str, tmp_path: Path, fits: Fits
) -> None:
    rig, runs, disk = on_a_hanging_disk(tmp_path)
    runs.answer({"plan": SHORT})
    rig.run(0.5)
    spoil(runs, disk)
    climb(rig, runs)
    assert runs.status()["phase"] == "fitting", "nobody knows yet what the disk has taken"
    if spoil is take_nothing:
        runs.flush(HANGS_S + 1.0)
        assert runs.status()["phase"] == "stopped"
    disk.let_go()
    told = runs.status()
    assert fits == []
    assert (told["running"], told["phase"]) == (False, "stopped")
    assert why in told["ended"]
    assert rig.controller.refusal_of_run(rig.now(), QUICK) == "", "the next run may begin"
