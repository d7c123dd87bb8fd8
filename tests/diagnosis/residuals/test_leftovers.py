"""What is left is told in words and numbers, each thing once, and no more than three of them."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from gateway.diagnosis.bench.bench import Bench, bench_of
from gateway.diagnosis.bench.parameters import ModelParameters
from gateway.diagnosis.measurement import Measurement
from gateway.diagnosis.model_fit.levenberg_marquardt import FittedModel
from gateway.diagnosis.noise.whitening import Whitener, white_whitener
from gateway.diagnosis.residuals.dependence_tests import MOST_LEFTOVERS, find_dependences
from gateway.diagnosis.result import Leftover
from tests.diagnosis.machine import MACHINE, Floats, command_v, measurement, readings_n, times_s

TIME_S = times_s(40.0, 100.0)
VOLTS = command_v(TIME_S)
NOISE_N = 0.1
TEMPERATURE = 23.0 + np.sin(0.5 * TIME_S)
HUMIDITY = 40.0 + 5.0 * np.sin(0.83 * TIME_S + 1.0)


@cache
def clean_n() -> Floats:
    """Not at the file's import: each worker would compile the twin for it."""
    return readings_n(MACHINE, TIME_S, VOLTS, {})


def left(*residuals_n: Floats, columns: dict[str, Floats] | None = None) -> tuple[Leftover, ...]:
    """What is told where a model without parameters leaves this and noise, one recording for each."""
    rng = np.random.default_rng(11)
    measurements: list[Measurement] = []
    for k, residual_n in enumerate(residuals_n):
        noisy_n = clean_n() + residual_n + rng.normal(0.0, NOISE_N, TIME_S.size)
        one = measurement(TIME_S, VOLTS, noisy_n, columns or {})
        measurements.append(Measurement(**{name: getattr(one, name) for name in one.__slots__} | {"name": f"run {k}"}))
    bench = bench_of(measurements)
    fitted, whiten = _known_model(bench, np.tile(clean_n(), len(residuals_n)))
    return find_dependences(bench, fitted, whiten, ())


def _known_model(bench: Bench, simulated_n: Floats) -> tuple[FittedModel, Whitener]:
    residual_n = (bench.measured_n - simulated_n) * bench.usable
    parameters = ModelParameters(MACHINE, tuple(0.0 for _ in bench.measurements))
    offsets = np.array([np.arange(bench.rows) // TIME_S.size == k for k in range(len(bench.measurements))], dtype=float)
    return FittedModel(parameters, (), residual_n, 0.0, offsets), white_whitener(bench, residual_n)


def test_noise_leaves_nothing() -> None:
    assert left(np.zeros(TIME_S.size)) == ()


def test_a_line_is_told_in_hertz_and_newtons() -> None:
    (one,) = left(0.15 * np.sin(2.0 * np.pi * 7.3 * TIME_S))
    assert one.depends_on == "time" and one.shape.startswith("a line at 7.3 Hz, 0.1")
    assert one.frequency_hz == pytest.approx(7.3, rel=0.01)
    assert one.amplitude_n == pytest.approx(0.15, rel=0.1)
    assert "7.3 Hz" in one.experiment


def test_a_strong_line_s_share_is_that_of_its_power() -> None:
    """0.5 N of 0.38 N RMS were `2 % of what is left`: noise with the line in it had whitened the line away."""
    line_n = 0.5 * np.sin(2.0 * np.pi * 1.3 * TIME_S)
    noise_n = np.random.default_rng(12).normal(0.0, NOISE_N, TIME_S.size)
    bench = bench_of([measurement(TIME_S, VOLTS, clean_n() + line_n + noise_n, {})])
    fitted, whiten = _known_model(bench, clean_n())
    (noise,) = whiten.noises
    hertz = np.arange(noise.weights.size) * 100.0 / noise.length
    weights = noise.weights * np.where(np.abs(hertz - 1.3) < 0.1, 0.08, 1.0)
    whiten = replace(whiten, noises=(replace(noise, weights=weights),))
    (one, *_) = find_dependences(bench, fitted, whiten, ())
    assert one.frequency_hz == pytest.approx(1.3, rel=0.02) and one.amplitude_n == pytest.approx(0.5, rel=0.1)
    assert one.share == pytest.approx(np.var(line_n) / (np.var(line_n) + NOISE_N**2), rel=0.1)


def test_a_slow_wander_is_told_in_seconds_and_newtons() -> None:
    (one,) = left(0.2 * np.sin(2.0 * np.pi * TIME_S / 40.0))
    assert one.depends_on == "time" and one.period_s == pytest.approx(40.0, rel=0.4)
    assert one.amplitude_n == pytest.approx(0.2, rel=0.3)
    assert "s, 0." in one.shape and "hold one force" in one.experiment


def test_a_product_names_both_columns() -> None:
    """Neither column alone explains it."""
    residual_n = 0.03 * (TEMPERATURE - 23.0) * (HUMIDITY - 40.0)
    (one, *_) = left(residual_n, columns={"humidity": HUMIDITY, "temperature_c": TEMPERATURE})
    assert set(one.columns) == {"humidity", "temperature_c"} and " x " in one.depends_on
    assert "humidity" in one.experiment and "temperature_c" in one.experiment


def test_what_several_columns_tell_alike_is_told_once() -> None:
    """Two columns that are nearly one, and a third thing beside them."""
    alike = TEMPERATURE + 0.05 * np.sin(3.0 * TIME_S)
    residual_n = 0.2 * (TEMPERATURE - 23.0) + 0.1 * np.sin(2.0 * np.pi * 12.0 * TIME_S)
    found = left(residual_n, columns={"oil_c": alike, "room_c": TEMPERATURE})
    assert len(found) == 2
    assert {each.depends_on for each in found} in ({"room_c", "time"}, {"oil_c", "time"})


def test_no_more_than_three_are_told() -> None:
    lines = sum(0.12 * np.sin(2.0 * np.pi * hertz * TIME_S) for hertz in (5.1, 9.7, 14.3))
    jump = 0.3 * (TIME_S > 20.0)
    found = left(lines + jump + 0.2 * (TEMPERATURE - 23.0), columns={"room_c": TEMPERATURE})
    assert len(found) == MOST_LEFTOVERS
    assert len({(each.depends_on, each.frequency_hz and round(each.frequency_hz)) for each in found}) == MOST_LEFTOVERS


def test_a_stretch_that_is_louder_is_told_with_its_time_and_both_levels() -> None:
    burst = np.where((TIME_S > 12.0) & (TIME_S < 16.0), np.random.default_rng(3).normal(0.0, 0.2, TIME_S.size), 0.0)
    found = [each for each in left(burst) if each.shape.startswith("louder")]
    assert len(found) == 1
    assert "from 12 to 16 s: 0.2" in found[0].shape and "against 0.1 N elsewhere" in found[0].shape


@pytest.mark.parametrize("hertz", [6.1, 13.7])
def test_a_line_that_comes_and_goes_is_told_in_hertz_in_each_recording(hertz: float) -> None:
    """Its phase is another one each time: over the whole recording there is no such line."""
    phase = np.repeat(np.random.default_rng(5).uniform(0.0, 6.0, 20), TIME_S.size // 20)
    there = np.repeat([1.0, 0.0] * 10, TIME_S.size // 20)
    line_n = 0.3 * there * np.sin(2.0 * np.pi * hertz * TIME_S + phase)
    for residuals_n in ((line_n,), (np.zeros(TIME_S.size), line_n)):
        found = [each for each in left(*residuals_n) if "wanders" in each.shape]
        assert len(found) == 1 and found[0].frequency_hz == pytest.approx(hertz, rel=0.05)


def test_the_file_of_several_is_named() -> None:
    line = 0.15 * np.sin(2.0 * np.pi * 7.3 * TIME_S)
    (one, *_) = left(np.zeros(TIME_S.size), line, np.zeros(TIME_S.size))
    assert one.file == "run 1"
