"""A setting acts when its line has ended: lines of fewer digits earlier, which is the wire's doing and no cause."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from gateway.cli.diagnosis.inputs import read_sources
from gateway.diagnosis import Measurement
from gateway.diagnosis.bench.bench import Bench, bench_of
from gateway.diagnosis.model_fit.base_fit import base_parameters, fit_base
from gateway.diagnosis.model_fit.levenberg_marquardt import FittedModel
from gateway.diagnosis.model_fit.line_lengths import _earlier_settings, fit_line_lengths
from gateway.diagnosis.noise.whitening import Whitener, white_whitener
from gateway.twin.plant import Plant, with_value
from tests.watch.clean_runs import recorded

STEP_V = 10.0 / 1023.0
AT_9600_BAUD_S = 10.0 / 9600.0


@cache
def own_recording() -> tuple[Measurement, Plant]:
    """Random steps of the demo rig, whose regulator takes `SET 0` .. `SET 1023` at 9600 baud."""
    with TemporaryDirectory() as folder:
        path = recorded("random", 2, Path(folder), 25.0)
        sources = read_sources([str(path)], rig=None, columns=None, state=None)
    return sources.measurements[0], with_value(sources.plant.plant, "cell", "noise_n", 0.0)


def base_of(measurement: Measurement, plant: Plant) -> tuple[Bench, FittedModel, Whitener]:
    bench = bench_of([measurement])
    whiten = white_whitener(bench, bench.measured_n)
    return bench, fit_base(bench, plant, base_parameters(bench, frozenset(), 0.035), whiten), whiten


@pytest.mark.long
def test_an_own_recording_shows_how_long_a_character_takes() -> None:
    _, fitted = fit_line_lengths(*base_of(*own_recording()), STEP_V)
    assert fitted.parameters.character_s == pytest.approx(AT_9600_BAUD_S, rel=0.3)  # one run is sure to about 0.1 ms


def test_a_setting_that_came_within_a_row_moves_by_its_own_digits() -> None:
    """The row in which 870 counts fall to 0 has a mean of 400: moved by that one's digits, a part of the fall stood still,
    and the time of a character came out at 1.1 to 1.8 ms, by how settings happened to lie between the readings."""
    measurement, _ = own_recording()
    assert measurement.sent is not None
    time_s = np.arange(0.0, 1.0, 0.01)
    falls = replace(measurement.sent, times_s=np.array([0.1, 0.504]), volts=np.array([870, 0]) * STEP_V)
    drawn = replace(measurement, time_s=time_s, sent=falls, even_s=0.01)
    command_v = _earlier_settings(drawn, STEP_V, AT_9600_BAUD_S).command_v
    assert command_v is not None
    fallen_s = 0.01 * float(np.sum(command_v)) / (870 * STEP_V)
    assert fallen_s == pytest.approx(0.504 - 2.0 * AT_9600_BAUD_S)


def test_with_its_lines_the_model_leaves_less_and_is_nearer_to_the_machine() -> None:
    bench, base, whiten = base_of(*own_recording())
    lined, fitted = fit_line_lengths(bench, base, whiten, STEP_V)
    assert lined.rms_n(fitted.residual_n) < 0.98 * bench.rms_n(base.residual_n)
    assert fitted.chi2 < base.chi2 - 50.0
    assert abs(fitted.parameters.plant.cylinder.area_m2 / 95.0e-6 - 1.0) < 2.0e-3


@pytest.mark.parametrize(("even_s", "step_v"), [(0.0, STEP_V), (0.01, 0.0)], ids=["rows as recorded", "counts unknown"])
def test_what_is_not_known_to_be_settings_on_a_line_is_left_alone(even_s: float, step_v: float) -> None:
    measurement, plant = own_recording()
    bench, base, whiten = base_of(replace(measurement, even_s=even_s), plant)
    assert fit_line_lengths(bench, base, whiten, step_v) == (bench, base)


def test_lines_that_are_all_alike_show_none() -> None:
    """A recording that the model itself makes from the settings as they stand, with the cell's noise."""
    measurement, plant = own_recording()
    bench, base, _ = base_of(measurement, plant)
    noise_n = np.random.default_rng(5).normal(0.0, 0.12, measurement.rows)
    made = replace(measurement, force_n=bench.simulate([base.parameters])[0] + noise_n)
    _, fitted = fit_line_lengths(*base_of(made, plant), STEP_V)
    assert fitted.parameters.character_s < 0.2 * AT_9600_BAUD_S
