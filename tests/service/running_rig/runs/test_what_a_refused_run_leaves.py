"""A run that is refused, in its step, by its fit or by the disk, leaves nothing of itself to the next one."""

from pathlib import Path

import pytest

from gateway.codes.faults import FaultCode
from gateway.recording import read_recording
from gateway.registers.words import State
from tests.service.running_rig.runs.test_calibration_runs import SHORT, climb, on_a_hanging_disk, refuse_its_file
from tests.service.running_rig.simulated_rig import CALIBRATE


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
    assert rig.log[-1] == "calibration 7 stored, not active; E106 0007.html: No space left"
    runs._on_result({"refused": "A331 no"})
    assert rig.log[-1] == "A331 no"


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
