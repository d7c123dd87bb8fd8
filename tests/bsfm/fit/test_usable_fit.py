"""A ladder whose best fit may not drive the plant still gives a calibration, and says what it costs."""

import numpy as np
import pytest

from gateway.bsfm.fit.branch_fit import FitSettings, fit
from gateway.bsfm.fit.usable_fit import fit_usable
from gateway.bsfm.ladder.measured_ladder import Ladder, ladder_plan


@pytest.fixture
def dead_start() -> Ladder:
    """Friction holds the rising force at 0 N for the first steps: the free optimum bends back there."""
    plan = ladder_plan(8.0, 0.1, 5)
    voltage, direction = np.array(plan.voltage_v), np.array(plan.direction)
    push = np.maximum(voltage - 0.15, 0.0) * 7.9
    falling = np.minimum(push + 2.0 * np.tanh(push), push.max() - 2.0)
    force = np.where(direction > 0, np.maximum(push - 2.0, 0.0), np.maximum(falling, 0.0))
    noise = 0.1 * np.random.default_rng(1).standard_normal(len(voltage))
    return Ladder(voltage, force + noise, direction, np.array(plan.group))


def test_the_usable_fit_is_proven_and_its_residual_is_honest(dead_start):
    free, usable = fit(dead_start, "bsfm", 2), fit_usable(dead_start, "bsfm", 2)
    assert not free.verdicts.usable and free.verdicts.sentences[0] == "the rising branch is not increasing"
    assert usable.verdicts.usable and usable.branches.tied
    assert free.rms_n < usable.rms_n < 2.0 * free.rms_n
    assert usable.covariance == "not identifiable" and usable.count == len(dead_start)
    low, high = usable.bsfm(3.0).force_range_n
    assert low < 0.5 and high > 58.0


def test_a_fit_that_is_usable_already_is_left_alone(loops):
    ladder = loops["smooth"](2)
    assert fit_usable(ladder, "bsfm", 2).branches == fit(ladder, "bsfm", 2).branches


def test_polynomials_stay_polynomials_under_constraints(dead_start):
    settings = FitSettings(slope_floor_n_per_v=5.0)
    assert not fit(dead_start, "psfm", 4, settings=settings).verdicts.usable
    usable = fit_usable(dead_start, "psfm", 4, settings=settings)
    assert usable.verdicts.usable and set(usable.branches.rising.weights) == {1.0}


def test_constraints_do_not_hide_that_the_directions_were_swapped(loops):
    ladder = loops["smooth"](1)
    swapped = Ladder(ladder.voltage_v, ladder.force_n, -ladder.direction, ladder.group)
    assert fit(swapped, "psfm", 3).verdicts.crossing is not None
    assert fit_usable(swapped, "psfm", 3).rms_n > 4.0 * fit(ladder, "psfm", 3).rms_n


def test_where_nothing_usable_is_found_the_reasons_are_given(dead_start, monkeypatch):
    monkeypatch.setattr("gateway.bsfm.fit.usable_fit.MARGINS", ())
    with pytest.raises(ValueError, match=r"no usable bsfm of order 2: the rising branch is not increasing"):
        fit_usable(dead_start, "bsfm", 2)
