"""A run that is refused, in its step, by its fit or by the disk, leaves nothing of itself to the next one."""

from dataclasses import replace
from math import isfinite, nan
from pathlib import Path

import pytest

from gateway.codes.faults import FaultCode
from gateway.control.inputs import Output
from gateway.control.settings import SelfTestSettings
from gateway.devices.messages import ForceSample
from gateway.recording import read_recording
from gateway.registers.words import State
from gateway.service.running_rig.calibration_runs import CalibrationRuns
from gateway.service.running_rig.lines.output_line import LineState
from tests.control.bench import settings
from tests.service.rigs import demo
from tests.service.running_rig.recording.test_run_recording import HangingDisk
from tests.service.running_rig.runs.test_calibration_runs import SHORT, Fits, climb, on_a_hanging_disk, refuse_its_file
from tests.service.running_rig.simulated_rig import CALIBRATE, SELF_TEST, SmallRig


def test_a_run_that_is_refused_in_its_step_leaves_its_name_to_no_other(tmp_path: Path) -> None:
    """The output has refused a voltage between the last decision and the request."""
    rig, runs, disk = on_a_hanging_disk(tmp_path)
    runs.decide, rig.wire.fault = rig.loop.refresh, FaultCode.OUTPUT_REFUSED
    with pytest.raises(ValueError, match="W305 calibration refused"):
        runs.answer({"plan": SHORT, "continues": [7], "name": "Monday"})
    rig.wire.fault = FaultCode.NONE
    rig.run(0.1)
    rig.write(0, CALIBRATE)
    rig.run(0.5)
    rig.write(0, 0)
    rig.until(State.OFF).run(0.1)
    disk.let_go()
    header = read_recording(Path(runs.status()["recording"])).header
    assert (header["continues"], header["name"]) == ([], "")


def test_what_a_fit_has_refused_is_not_told_of_the_run_of_a_master_behind_it(tmp_path: Path) -> None:
    rig, runs, disk = on_a_hanging_disk(tmp_path)
    runs._on_result({"refused": "A332 no"})
    assert runs.status()["result"] == {"refused": "A332 no"}
    rig.write(0, CALIBRATE)
    rig.run(0.5)
    assert (runs.status()["ended"], runs.status()["result"]) == ("", {})
    rig.write(0, 0)
    rig.until(State.OFF).run(0.1)
    disk.let_go()
    assert "stopped by 10.0.0.5" in runs.status()["ended"] and runs.status()["result"] == {}


def test_a_calibration_without_a_report_is_stored_all_the_same(tmp_path: Path) -> None:
    rig, runs, _ = on_a_hanging_disk(tmp_path)
    runs._on_result({"stored": 7, "unreported": "E106 0007.html: No space left"})
    assert (runs.stored, runs.status()["phase"]) == (7, "stored")
    assert rig.run(0.02).word("calibration_stored") == 7
    assert rig.log[-1] == "calibration 7 stored, not active; E106 0007.html: No space left"
    runs._on_result({"refused": "A331 no"})
    assert rig.log[-1] == "A331 no"


def test_a_reading_that_is_none_right_before_a_ladder_s_end_spoils_no_row_behind_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without the row that tells its end the last group, or the reversal part, was left out of the fit."""
    monkeypatch.setattr("gateway.service.running_rig.calibration_runs.FitLauncher", fits := Fits())
    rig, runs, disk = on_a_hanging_disk(tmp_path)
    append, ends = runs.append, [False]

    def append_worse(sample: ForceSample, decision: Output, line: LineState) -> None:
        ends[0] = ends[0] or rig.controller.active_run.progress > 0.9
        append(
            sample, decision._replace(force_measured_n=nan) if ends[0] and runs._closing_s is None else decision, line
        )

    runs.append = append_worse  # type: ignore[method-assign]
    runs.answer({"plan": SHORT})
    climb(rig, runs)
    disk.let_go()
    assert isfinite(read_recording(fits[0]).columns["force_n"][-1])


def test_the_largest_force_that_a_person_is_asked_about_has_the_payload_in_it(tmp_path: Path) -> None:
    """A ladder's end is the rig's own largest force."""
    rig, runs, _ = on_a_hanging_disk(tmp_path)
    low = SHORT | {"v_max_v": 4.0, "step_v": 1.0}
    plain_n = runs.answer({"plan": low, "dry_run": True})["force_max_n"]
    rig.write(9, 600)
    assert runs.answer({"plan": low, "dry_run": True})["force_max_n"] == pytest.approx(plain_n + 5.88, abs=0.01)
    assert runs.answer({"plan": SHORT, "dry_run": True})["force_max_n"] == settings().limits.force_max_n


def test_an_experiment_of_which_the_disk_took_nothing_is_not_recorded(tmp_path: Path) -> None:
    """It was over before the disk refused: it was told as recorded in None."""
    rig, runs, disk = on_a_hanging_disk(tmp_path)
    step = {"do": "step", "to_v": 1.0, "hold_s": 0.2}
    runs.answer({"plan": {"name": "short", "check": False, "parts": [{"name": "one", "moves": [step]}]}})
    refuse_its_file(runs, disk)
    climb(rig, runs)
    rig.until(State.OFF).run(0.1)
    disk.let_go()
    told = runs.status()
    assert (told["phase"], told["ended"], told["recording"]) == ("stopped", "the disk took no recording", None)


def test_of_a_self_test_nothing_is_told_that_the_ladder_before_it_has_left(tmp_path: Path) -> None:
    """A robot's stop of it was told with that ladder's sentence, recording and calibration."""
    rig = SmallRig(replace(settings(), self_test=SelfTestSettings(force_n=15.0)))
    runs = CalibrationRuns(rig.controller, demo(), tmp_path, rig.now, rig.note)
    disk = runs.disk = runs.syncing = HangingDisk()  # type: ignore[assignment]
    rig.loop.calibration_runs = runs
    rig.write(0, CALIBRATE)
    rig.run(0.5)
    rig.write(0, 0)
    rig.until(State.OFF).run(0.1)
    disk.let_go()
    runs._on_result({"stored": 3, "report": "0003.html"})
    stops = (lambda: rig.write(0, 0), lambda: runs.answer({"stop": True}), lambda: None)
    ends = ("self-test stopped by 10.0.0.5", "self-test stopped at this machine", "self-test done after")
    for stop, words in zip(stops, ends, strict=True):
        rig.write(0, SELF_TEST)
        rig.run(0.5)
        assert (runs.status()["ended"], runs.status()["recording"]) == ("", None)
        stop()
        rig.until(State.OFF, 20.0)
        told = runs.status()
        assert words in told["ended"] and told["recording"] is None and told["result"] == {}
