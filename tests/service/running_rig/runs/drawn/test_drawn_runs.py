"""Drawn scenes of all that presses without an enable: ladders, experiments and self-tests, by masters and by people at the
machine, with other masters beside them, and whatever befalls lines, devices, process and tool meanwhile.

A scene is one seed. The laws are the judge's own.
"""

from pathlib import Path

import pytest

from tests.gate.budgets import scenes
from tests.service.running_rig.runs.drawn.run_rig import Fits
from tests.service.running_rig.runs.drawn.scene import Scene

SCENES = 7
KEPT = 5101, 98, 157, 5323, 5721, 10316, 20461, 30077, 6
"""A stair that had just been left out pressed until the next reading came; a partial reversal pressed what was never tried;
nobody follows an experiment any more; a self-test that begins behind an output that has just become deaf, or behind a machine
that stood still, fails with right; one that begins just behind a disable has not made the force that still comes; a run that a
standstill has ended has not begun by what waited; a port that is plugged in again and whose device then is ill heals, too. In
the last one another calibration is put to use before a ladder, which its recording then names: no other one asks so."""


def test_a_run_keeps_to_what_it_states_and_ends_with_its_reason_whatever_befalls_it(
    tmp_path: Path, budget: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A scene of half a minute takes a fifth of a second of processor."""
    monkeypatch.setattr("gateway.service.running_rig.calibration_runs.FitLauncher", Fits)
    played = [Scene(seed, tmp_path).play() for seed in (*KEPT, *range(scenes(SCENES, budget)))]
    assert [(one.seed, one.judge.broken, one.told[-20:]) for one in played if one.judge.broken] == []
