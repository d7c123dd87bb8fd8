"""Rows of the gateway's own are laid on an even clock, under what was really sent."""

from dataclasses import replace

import numpy as np
import pytest

from gateway.diagnosis import Measurement
from gateway.diagnosis.excerpt import take_excerpt
from gateway.recording.tables.even_rows import resample_evenly

RNG = np.random.default_rng(1)
PERIOD_S = 0.0100007  # an amplifier's clock is never ours
TICKS_S = np.arange(3000) * PERIOD_S
LATE_S = np.where(
    RNG.random(TICKS_S.size) < 0.05, RNG.uniform(0.0, 0.008, TICKS_S.size), 0.0002 * RNG.random(TICKS_S.size)
)
TIME_S = TICKS_S + LATE_S - LATE_S[0]


def force(time_s: np.ndarray) -> np.ndarray:
    return np.asarray(20.0 + 8.0 * np.sin(time_s))


MEASUREMENT = Measurement(
    name="own",
    time_s=TIME_S,
    force_n=force(TIME_S),
    usable=np.ones(TIME_S.size, dtype=bool),
    repeated=np.zeros(TIME_S.size, dtype=bool),
    command_v=np.full(TIME_S.size, 2.5),
)
SETTINGS_S = np.sort(RNG.uniform(0.5, 29.0, 400))
VOLTS = RNG.uniform(2.3, 2.7, SETTINGS_S.size)


def sent(time_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of each row: what was sent last, and how long ago."""
    last = np.searchsorted(SETTINGS_S, time_s, side="right") - 1
    known = last >= 0
    return np.where(known, VOLTS[last], np.nan), np.where(known, time_s - SETTINGS_S[last], np.nan)


def test_a_reading_that_is_no_witness_is_in_no_row() -> None:
    overloaded = np.zeros(TIME_S.size, dtype=bool)
    overloaded[500:600:3] = True
    measured = replace(MEASUREMENT, force_n=np.where(overloaded, 980.0, force(TIME_S)), usable=~overloaded)
    found, whole = (resample_evenly(one, *sent(TIME_S)) for one in (measured, MEASUREMENT))
    assert float(np.max(found.force_n)) < 28.5
    assert 25 < int(np.sum(whole.usable)) - int(np.sum(found.usable)) <= int(np.sum(overloaded))


def test_a_row_of_which_one_reading_is_repeated_is_one() -> None:
    repeated = np.arange(TIME_S.size) % 10 == 5
    found = resample_evenly(replace(MEASUREMENT, repeated=repeated), *sent(TIME_S))
    assert int(np.sum(found.repeated)) == pytest.approx(TIME_S.size / 10, rel=0.02)


def test_rows_are_even_and_the_force_is_that_of_their_times() -> None:
    found = resample_evenly(MEASUREMENT, *sent(TIME_S))
    assert np.diff(found.time_s) == pytest.approx(found.even_s)
    assert found.even_s == pytest.approx(PERIOD_S, rel=1.0e-5)
    first_s = np.median(TIME_S - np.round(TIME_S / PERIOD_S) * PERIOD_S)
    assert np.std(found.force_n - force(found.time_s + first_s)) < 0.005
    assert 0.0003 < found.jitter_s < 0.002


def test_it_does_not_matter_at_which_time_a_recording_begins() -> None:
    volts, age_s = sent(TIME_S)
    found = resample_evenly(MEASUREMENT, volts, age_s)
    later = resample_evenly(replace(MEASUREMENT, time_s=TIME_S + 700.0), volts, age_s)
    assert later.time_s == pytest.approx(found.time_s, abs=1.0e-6)
    assert later.command_v == pytest.approx(found.command_v, abs=1.0e-3)


def test_a_command_is_the_mean_of_what_stood_on_the_wire() -> None:
    """Its integral is kept, wherever between two rows a setting was sent."""
    found = resample_evenly(MEASUREMENT, *sent(TIME_S))
    fine_s = np.arange(0.0, 29.0, 1.0e-5)
    stood = np.where(
        fine_s < SETTINGS_S[0], VOLTS[0], VOLTS[np.maximum(np.searchsorted(SETTINGS_S, fine_s, "right") - 1, 0)]
    )
    rows = found.time_s < 28.5
    seen = sent(TIME_S)
    kept = np.isin(np.round(SETTINGS_S, 9), np.round((TIME_S - seen[1])[np.isfinite(seen[1])], 9))
    assert kept.mean() > 0.75, "two settings between two rows leave one"
    assert np.mean(found.command_v[rows]) == pytest.approx(np.mean(stood[fine_s < 28.5]), abs=0.03)


def test_the_settings_themselves_stay_with_the_rows_and_with_a_part_of_them() -> None:
    found = resample_evenly(MEASUREMENT, *sent(TIME_S))
    for rows in (found, take_excerpt(found, 1000)):
        assert rows.sent is not None
        means_v = rows.sent.interval_means(np.append(rows.time_s, rows.time_s[-1] + rows.even_s))
        assert means_v == pytest.approx(rows.command_v)


def test_noise_is_not_shared_between_neighbours() -> None:
    noise = np.random.default_rng(2).normal(0.0, 0.1, TIME_S.size)
    found = resample_evenly(replace(MEASUREMENT, force_n=noise), *sent(TIME_S)).force_n
    assert np.std(found) == pytest.approx(0.1, rel=0.05)
    assert abs(np.corrcoef(found[1:], found[:-1])[0, 1]) < 0.1


def test_a_command_that_was_never_sent_is_another_column() -> None:
    volts, age_s = sent(TIME_S)
    swapped = replace(MEASUREMENT, command_v=MEASUREMENT.force_n, force_n=volts)
    assert resample_evenly(swapped, volts, age_s) is swapped


def test_without_anything_sent_it_stays_as_it_is() -> None:
    unknown = np.full(TIME_S.size, np.nan)
    assert resample_evenly(MEASUREMENT, unknown, unknown) is MEASUREMENT
