"""A recording that is longer than a search needs: which part is judged, and that a beginning amid motion is no cause."""

from dataclasses import replace

import numpy as np
import pytest

from gateway.diagnosis import Measurement, diagnose
from gateway.diagnosis.excerpt import take_excerpt
from gateway.diagnosis.measurement import Settings
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


def test_all_that_a_stretch_has_beside_its_readings_is_of_the_same_moments() -> None:
    time_s = times_s(100.0)
    volts = np.where((time_s > 40.0) & (time_s < 70.0), 2.0 + np.round(np.sin(time_s), 2), 2.0)
    whole = replace(long(200.0, 100.0, volts), covariates={"temperature_c": time_s}, sent=Settings(time_s, volts))
    part = take_excerpt(whole, 6000)
    first_s = float(part.covariates["temperature_c"][0])
    assert part.covariates["temperature_c"] == pytest.approx(part.time_s + first_s)
    assert part.sent is not None and part.sent.times_s == pytest.approx(time_s - first_s)
    assert part.command_v is not None
    edges_s = np.append(part.time_s, part.time_s[-1] + 0.005)
    assert part.sent.interval_means(edges_s) == pytest.approx(part.command_v)


def test_a_row_of_several_counts_only_where_all_of_them_do() -> None:
    """One reading of -9999 N among eight is in their mean."""
    whole = long(4000.0, 4.0)
    whole.usable[59] = False
    part = take_excerpt(whole, 2000)
    assert np.flatnonzero(~part.usable).tolist() == [59 // 8]


def test_a_drive_that_moves_where_no_reading_counts_shows_nothing() -> None:
    time_s = times_s(100.0)
    volts = 2.0 + np.where(time_s < 30.0, np.sin(5.0 * time_s), np.sin(time_s))
    whole = long(200.0, 100.0, volts)
    whole.usable[time_s < 30.0] = False
    part = take_excerpt(whole, 6000)
    assert part.usable[300:].all()


@pytest.mark.sampled
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
