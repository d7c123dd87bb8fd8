"""A run that somebody at this machine has asked for can be stopped from its first moment on."""

from pathlib import Path

import pytest

from gateway.registers.words import CalibrationPhase, State
from tests.service.running_rig.runs.test_calibration_runs import PLAN, kept
from tests.service.wired import Wired


@pytest.mark.parametrize("by_master", [False, True])
def test_a_stop_right_behind_the_start_finds_a_run_to_stop(tmp_path: Path, by_master: bool) -> None:
    """Both in one piece of the loop's time: a run that began at the next step only climbed on, whoever had stopped it."""
    wired = Wired().ready()
    runs = kept(wired, tmp_path)
    assert runs.answer({"plan": PLAN})["running"]
    if by_master:
        wired.write(0, 0)
    else:
        runs.answer({"stop": True})
    wired.run(0.5)
    assert wired.state is State.OFF
    assert wired.word("calibration_phase") == CalibrationPhase.STOPPED
