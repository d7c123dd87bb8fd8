"""The shipped plant against the paper (tools/paper/README.md), and the demo calibration against the plant.

A step of Fig. 8 starts from no load: here the pad stands half a millimetre off the workpiece. That is what spoils 5 N: the
approach has loaded the friction forward, while on the ladder, which never leaves the workpiece, it is still turning round.
The paper's commands come from two branches fitted to a staircase; the demo calibration knows the turning round.
"""

import math
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import yaml

from gateway.bsfm.branches import Branches
from gateway.bsfm.coefficients import CoefficientLimits, Coefficients
from gateway.bsfm.fit.branch_fit import fit
from gateway.bsfm.ladder.measured_ladder import FALLING, RISING, Ladder
from gateway.bsfm.model import Calibration
from gateway.bsfm.validate import validate_coefficients
from gateway.twin import Contact, Cylinder, Friction, LoadCell, Plant, Regulator, Twin
from gateway.twin.experiment import Dwell, Floats, settling_time_s, staircase
from gateway.twin.plant import with_value
from tests.twin.traces import step_response

ROOT = Path(__file__).parents[2]
SECTIONS = {
    "regulator": Regulator,
    "cylinder": Cylinder,
    "friction": Friction,
    "contact": Contact,
    "cell": LoadCell,
}
TARGETS_N = (5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0)


@cache
def paper_slide() -> Plant:
    document = yaml.safe_load((ROOT / "profiles/plants/paper-slide.yaml").read_text(encoding="utf-8"))
    parts = {
        name: kind(**{key: leaf["value"] for key, leaf in document[name].items()}) for name, kind in SECTIONS.items()
    }
    return Plant(**parts)


@cache
def demo_calibration() -> Calibration:
    document = yaml.safe_load((ROOT / "profiles/calibrations/demo.yaml").read_text(encoding="utf-8"))
    return Calibration(**{key: tuple(value) if isinstance(value, list) else value for key, value in document.items()})


@cache
def loop(top_v: float) -> tuple[Floats, Floats, Floats]:
    """(voltages going up, rising forces, falling forces in the same order), without noise, after one full cycle."""
    quiet = with_value(paper_slide(), "cell", "noise_n", 0.0)
    stairs_v = np.arange(round(top_v * 10) + 1) / 10
    cycle_v = np.concatenate([stairs_v, stairs_v[::-1]])
    twin = Twin(quiet, 1)
    staircase(twin, [top_v, 0.0], Dwell())
    rising, falling = np.split(staircase(twin, cycle_v, Dwell(readings=1)), 2)
    return stairs_v, rising, falling[::-1]


def paper_branches() -> Branches:
    """The paper's continuous form: order 2, tied, fitted to one staircase."""
    stairs_v, rising, falling = loop(8.0)
    ways = np.repeat([RISING, FALLING], stairs_v.size)
    ladder = Ladder(np.tile(stairs_v, 2), np.concatenate([rising, falling]), ways, np.zeros(ways.size))
    return fit(ladder, "bsfm", 2, "tied").branches


@cache
def steps() -> dict[float, Floats]:
    """Force after a step from no load to the feedforward voltage of each target, as the paper commands it."""
    lifted, rising = with_value(paper_slide(), "contact", "gap_m", 5.0e-4), paper_branches().rising
    return {target_n: step_response(Twin(lifted, 1), rising.inverse(target_n)[0]) for target_n in TARGETS_N}


def test_five_volts_give_about_forty_newtons() -> None:
    stairs_v, rising, _ = loop(5.0)
    assert stairs_v[-1] == 5.0
    assert 38.0 <= rising[-1] <= 42.0


@pytest.mark.parametrize("top_v", [5.0, 8.0])
def test_the_loop_is_a_few_newtons_wide_and_closes_at_both_ends(top_v: float) -> None:
    _, rising, falling = loop(top_v)
    gap = falling - rising
    assert 2.0 <= gap[gap.size // 2] <= 5.0
    assert np.all(gap >= -0.02)
    assert abs(gap[0]) < 0.02
    assert abs(gap[-1]) < 0.02


def test_both_branches_rise_by_at_least_a_newton_per_volt_everywhere() -> None:
    stairs_v, rising, falling = loop(8.0)
    for branch in (rising, falling):
        assert np.min(np.diff(branch) / np.diff(stairs_v)) > 1.0


def test_eight_volts_leave_room_above_sixty_newtons() -> None:
    _, rising, _ = loop(8.0)
    assert rising[-1] >= 63.0


def test_without_the_workpiece_the_force_is_zero_and_at_zero_volts_only_friction_is_left() -> None:
    twin = Twin(paper_slide(), 1)
    twin.advance(0.5)
    assert twin.force_n == 0.0
    _, rising, _ = loop(8.0)
    assert 0.0 <= rising[0] <= 1.2


def test_steps_settle_to_two_newtons_in_the_times_of_figure_8() -> None:
    times_s = [settling_time_s(force_n, target_n, 2.0) for target_n, force_n in steps().items()]
    assert min(times_s) >= 0.27
    assert max(times_s) <= 0.43
    assert np.mean(times_s) == pytest.approx(0.38, abs=0.015)


def test_steps_settle_to_one_newton_in_the_times_of_figure_8_but_never_at_five_newtons() -> None:
    times_s = [settling_time_s(force_n, target_n, 1.0) for target_n, force_n in steps().items()]
    assert math.isnan(times_s[0])
    assert min(times_s[1:]) >= 0.33
    assert max(times_s[1:]) <= 0.49
    assert 1.0 < abs(steps()[5.0][-1] - 5.0) < 2.0


def test_in_contact_every_setpoint_up_to_sixty_newtons_is_reached_within_a_newton_by_feedforward() -> None:
    model, twin = demo_calibration().model(), Twin(paper_slide(), 1)
    for target_n in (*TARGETS_N, 50.0, 60.0):
        for voltage_v in (8.0, 0.0):
            twin.command(voltage_v)
            twin.advance(1.0)
        memory = model.memory_after(model.reversal.start(), 0.0, target_n)
        twin.command(model.voltage_v(target_n, model.branch_share(memory))[0])
        twin.advance(1.0)
        assert abs(twin.force_n - target_n) < 0.5


def test_the_demo_calibration_may_drive_the_plant() -> None:
    calibration = demo_calibration()
    model = calibration.model()
    assert validate_coefficients(Coefficients.of(model.branches), CoefficientLimits(cell_range_n=98.0665)) == []
    assert model.branches.rising.handles[0] == model.branches.falling.handles[0]
    assert model.force_range_n[1] > 63.0
    assert 0.1 < calibration.rms_n < 0.3


@pytest.mark.long
def test_the_demo_calibration_is_what_its_tool_makes() -> None:
    command = [sys.executable, str(ROOT / "tools" / "fit_demo"), "--check"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stdout + done.stderr
