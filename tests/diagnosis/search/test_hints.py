"""Where a search begins: the lines that are really there, by the clock of the recording that shows them."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gateway.diagnosis.search.hints import _mains_hz, _pitches_mm, _positions, lines_hz

RATE_HZ, DURATION_S = 200.0, 40.0


def bench_of(*rates_hz: float) -> Any:
    """Recordings of 40 s each at these rates, one behind the other."""
    first, channels, measurements = 0, [], []
    for rate_hz in rates_hz:
        time_s = np.arange(round(DURATION_S * rate_hz)) / rate_hz
        channels.append(SimpleNamespace(rows=slice(first, first + time_s.size), is_force=True))
        measurements.append(SimpleNamespace(time_s=time_s, rows=time_s.size))
        first += time_s.size
    return SimpleNamespace(channels=channels, measurements=measurements, rows=first)


def heard(bench: Any, *lines: float) -> np.ndarray:
    """Noise, and the sines of these frequencies, the first the loudest, in the first recording."""
    white, time_s = np.random.default_rng(3).normal(0.0, 1.0, bench.rows), bench.measurements[0].time_s
    for place, line_hz in enumerate(lines):
        white[: time_s.size] += (2.0 - 0.5 * place) * np.sin(2.0 * np.pi * line_hz * time_s)
    return white


@pytest.mark.parametrize("rate_hz", [RATE_HZ, 87.0])
@pytest.mark.parametrize(("of_50", "of_60"), [(49.94, 60.06), (50.08, 59.91)])
def test_either_mains_is_looked_for_where_it_is_and_where_the_sampling_folds_it(
    rate_hz: float, of_50: float, of_60: float
) -> None:
    bench = bench_of(rate_hz)
    assert _mains_hz(bench, heard(bench, of_50, of_60)) == pytest.approx((of_50, of_60), abs=0.01)


@pytest.mark.parametrize("others_hz", [(), (50.0,), (400.0, 20.0)])
def test_lines_are_told_by_the_clock_of_the_recording_that_has_them(others_hz: tuple[float, ...]) -> None:
    bench = bench_of(RATE_HZ, *others_hz)
    found = lines_hz(bench, heard(bench, 7.3, 31.0))
    assert found[:2] == pytest.approx((7.3, 31.0), abs=0.02)


def test_the_pitch_of_what_repeats_along_the_way_is_in_millimetres() -> None:
    position_mm = 20.0 + 15.0 * np.sin(0.7 * np.arange(8000) / RATE_HZ)
    white = np.sin(2.0 * np.pi * position_mm / 5.0) + np.random.default_rng(4).normal(0.0, 0.3, position_mm.size)
    assert _pitches_mm(white, position_mm)[0] == pytest.approx(5.0, rel=0.03)
    assert _pitches_mm(white, np.full(position_mm.size, 20.0)) == (), "who stands still sees no pitch"


def test_positions_are_told_in_millimetres_and_are_unknown_where_nobody_has_measured_them() -> None:
    bench = bench_of(RATE_HZ, RATE_HZ)
    bench.columns = lambda: frozenset({"position_mm"})
    bench.measurements[0].position_m, bench.measurements[1].position_m = np.full(8000, 0.0215), None
    for channel, recording in zip(bench.channels, (0, 1), strict=True):
        channel.recording = recording
    found = _positions(bench)
    assert found is not None and np.allclose(found[:8000], 21.5) and np.isnan(found[8000:]).all()
