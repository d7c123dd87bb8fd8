"""The recording of a run says which plant was in use, and how its readings were straightened: who diagnoses it adds that."""

from pathlib import Path
from typing import Any

from gateway.plants.in_use import with_plant_in_use
from gateway.plants.recorded_number import header_in_use
from gateway.recording import read_recording
from gateway.registers.words import State
from gateway.service.running_rig.calibration_runs import CalibrationRuns
from tests.plants.test_plant_store import bowed, numbered
from tests.service.running_rig.runs.test_calibration_runs import SHORT, kept
from tests.service.wired import Wired


def test_a_run_says_what_straightens_its_readings_as_any_recording_does(tmp_path: Path) -> None:
    """It said nothing: a diagnosis of an experiment took straightened readings for the cell's own, and the plant that it
    found gave up what had straightened them."""
    wired = Wired().ready()
    runs = kept(wired, tmp_path)
    assert recorded_in_use(runs, wired) == {"number": 0, "compensated": [], "cell": None}
    plant = numbered(bowed(cell__quadratic_per_n=0.002))
    rig = with_plant_in_use(wired.rig, plant)
    wired.controller.compensate(rig.control, rig.compensation, rig.calibration_in_use(rig.calibration))
    runs.use_plant(rig)
    in_use = recorded_in_use(runs, wired)
    assert (in_use["number"], in_use["cell"]["quadratic_per_n"]) == (plant.number, 0.002)


def recorded_in_use(runs: CalibrationRuns, wired: Wired) -> dict[str, Any]:
    """By the recording of a run that is stopped soon."""
    runs.answer({"plan": SHORT})
    wired.run(0.5)
    runs.answer({"stop": True})
    wired.until(lambda: wired.state is State.OFF, 2.0)
    wired.run(0.1)
    return header_in_use(read_recording(Path(runs.status()["recording"])).header)
