"""A recording that is longer than a search needs: which part is judged, and that a beginning amid motion is no cause."""

import numpy as np
import pytest

from gateway.diagnosis import Measurement, diagnose
from gateway.diagnosis.excerpt import take_excerpt
from tests.diagnosis.machine import MACHINE, Floats, command_v, measurement, readings_n, times_s


def long(rate_hz: float, duration_s: float, volts: Floats | None = None) -> Measurement:
    time_s = times_s(duration_s, rate_hz)
    volts = command_v(time_s) if volts is None else volts
    noise_n = np.random.default_rng(3).normal(0.0, 0.1, time_s.size)
    return measurement(time_s, volts, readings_n(MACHINE, time_s, volts, {}) + noise_n, {})


def test_what_is_short_enough_stays_as_it_is() -> None:
    whole = long(200.0, 20.0)
    assert take_excerpt(whole, whole.rows) is whole


def test_rows_that_are_closer_than_they_need_to_be_are_taken_together() -> None:
    whole = long(4000.0, 4.0)
    part = take_excerpt(whole, 2000)
    assert part.rows == 2000
    assert part.force_n[7] == pytest.approx(whole.force_n[56:64].mean())
    assert part.command_v is not None and whole.command_v is not None
    assert part.command_v[7] == whole.command_v[60]
    assert part.duration_s == pytest.approx(whole.duration_s, abs=0.01)
    assert "8 rows each were taken together" in part.notes[-1]


def test_the_liveliest_stretch_is_judged_but_not_its_beginning() -> None:
    time_s = times_s(100.0)
    volts = np.where((time_s > 40.0) & (time_s < 70.0), 2.0 + np.round(np.sin(time_s), 2), 2.0)
    part = take_excerpt(long(200.0, 100.0, volts), 6000)
    assert part.rows == 6000
    assert part.time_s[0] == 0.0
    assert part.command_v is not None and np.ptp(part.command_v[300:-300]) == pytest.approx(2.0)
    assert not part.usable[:300].any()
    assert part.usable[300:].all()
    assert "in which the drive moves most, 40 to 70 s" in part.notes[-1]


@pytest.mark.parametrize("first", [9000, 10000])
def test_a_recording_that_begins_amid_motion_has_no_cause(first: int) -> None:
    """Friction remembers what nobody recorded; judged from the first second on, these got stribeck-friction and warm-up."""
    time_s = times_s(170.0)
    rows = slice(first, first + 8000)
    volts = command_v(time_s) + 0.3
    force_n = readings_n(MACHINE, time_s, volts, {}) + np.random.default_rng(3).normal(0.0, 0.1, time_s.size)
    found = diagnose([measurement(time_s[rows] - time_s[first], volts[rows], force_n[rows], {})])
    assert found.causes == ()
    assert found.leftover == ()


def test_a_stretch_that_begins_at_rest_has_no_cause() -> None:
    """The slide has come down to this rest and friction holds a part of the force; taken for a beginning, it was backlash."""
    whole = long(200.0, 170.0)
    part = take_excerpt(whole, 8000)
    assert part.command_v is not None and part.command_v[0] == 0.0
    found = diagnose([part])
    assert found.causes == ()
    assert found.leftover == ()
