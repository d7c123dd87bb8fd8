"""The mathematics under the search, each against the plain way of doing it; and what an answer must not depend on."""

import json
from collections.abc import Mapping
from dataclasses import FrozenInstanceError, replace
from pathlib import Path

import numpy as np
import pytest

from gateway.catalogue.sensing import DRIFT, ZERO_PER_K
from gateway.diagnosis import BY_NAME, Diagnosis, Measurement, Options, diagnose
from gateway.diagnosis.bench.bench import Bench, bench_of
from gateway.diagnosis.bench.parameters import ModelParameters
from gateway.diagnosis.diagnose import prepare_search
from gateway.diagnosis.model_fit.base_fit import DEFAULT_PLANT, base_parameters, fit_base
from gateway.diagnosis.model_fit.levenberg_marquardt import FitProblem, FittedModel, refine
from gateway.diagnosis.model_fit.normal_equations import ModelSpan, NormalEquations, held_out_errors
from gateway.diagnosis.noise.whitening import coloured_whitener, timing_weights, white_whitener
from gateway.diagnosis.search.search import search_effects
from gateway.recording import Recording
from gateway.recording.measurement import measurement_of
from gateway.reports.diagnosis.document import diagnosis_document
from tests.diagnosis.machine import MACHINE, Floats, command_v, measurement, plant, readings_n, recorded, times_s

SHORT_S = times_s(20.0, 100.0)
DRIFTING = {"friction.load_dependent_n_per_n": 0.05}


def squares(columns: Floats, values: Floats) -> float:
    """What least squares on these columns (k, rows) leaves."""
    left = values - columns.T @ np.linalg.lstsq(columns.T, values, rcond=None)[0] if columns.size else values
    return float(left @ left)


def test_the_gain_of_added_columns_is_that_of_least_squares() -> None:
    rng = np.random.default_rng(1)
    model, columns = rng.normal(size=(4, 300)), rng.normal(size=(6, 300)) * np.logspace(-6, 6, 6)[:, None]
    residual = rng.normal(size=300) + 0.3 * columns[2] / 1.0e-2 + model[1]
    normal = NormalEquations(ModelSpan.of(model, residual), columns)
    for indices in ([0], [2], [5], [1, 2], [0, 3, 5]):
        joined = np.vstack([model, columns[indices] / np.linalg.norm(columns[indices], axis=1)[:, None]])
        found = normal.add(indices)
        assert found.gain == pytest.approx(squares(model, residual) - squares(joined, residual), rel=1e-6)
        whole = np.vstack([model, columns[indices]]).T
        sizes = np.linalg.lstsq(whole / np.linalg.norm(whole, axis=0), residual, rcond=None)[0]
        expected = (sizes / np.linalg.norm(whole, axis=0))[len(model) :]
        np.testing.assert_allclose(found.sizes, expected, rtol=1e-6)


def test_a_column_of_the_model_gains_nothing() -> None:
    rng = np.random.default_rng(2)
    model = rng.normal(size=(3, 200))
    columns = np.vstack([2.0 * model[0] - model[2], rng.normal(size=200)])
    normal = NormalEquations(ModelSpan.of(model, rng.normal(size=200)), columns)
    assert normal.add([0]).gain == 0.0
    assert normal.add([1]).gain > 0.0


def short(constant_n: float = 0.0, columns: tuple[str, ...] = (), *, seed: int = 4, zero_n: float = 0.4) -> Measurement:
    """20 s of the machine, whose friction grows with the load."""
    found = recorded({**DRIFTING, "cell.zero_n": zero_n}, columns, seed=seed, time_s=SHORT_S)
    return replace(found, force_n=found.force_n + constant_n)


def linear_problem(rng: np.random.Generator) -> tuple[Bench, FittedModel]:
    """A bench with a model of three columns at its optimum, where a search always asks."""
    bench = bench_of([short()])
    jacobian = bench.reduce(rng.normal(size=(3, bench.rows)) * np.array([[1.0e-3], [1.0], [1.0e4]]))
    residual = bench.reduce(rng.normal(size=bench.rows))
    residual -= jacobian.T @ np.linalg.lstsq(jacobian.T, residual, rcond=None)[0]
    return bench, FittedModel(ModelParameters(DEFAULT_PLANT, (0.0,)), (), residual, 0.0, jacobian)


def test_held_out_is_leaving_out_and_fitting_again() -> None:
    """But for a ridge of a hundredth, which keeps a block solvable that holds all of a parameter."""
    bench, fitted = linear_problem(np.random.default_rng(3))
    whiten = white_whitener(bench, fitted.residual_n)
    found = held_out_errors(bench, fitted, whiten)
    for block in range(found.errors.size):
        inside = bench.block_of_row == block
        rest = ~inside & bench.usable
        step = np.linalg.lstsq(fitted.jacobian[:, rest].T, fitted.residual_n[rest], rcond=None)[0]
        error = (fitted.residual_n - step @ fitted.jacobian)[inside & bench.judged]
        np.testing.assert_allclose(found.steps[block], step, rtol=0.03, atol=0.03 * float(np.abs(step).min()))
        assert found.errors[block] == pytest.approx(float(error @ error), rel=1e-4)
        assert found.counts[block] == error.size
    assert found.rms_n == pytest.approx(np.sqrt(found.errors.sum() / found.counts.sum()))


def quiet_bench(rows: int = 12000) -> Bench:
    """A minute without anything, for noise alone."""
    time_s = np.arange(rows) / 200.0
    return bench_of([measurement(time_s, np.zeros(rows), np.zeros(rows) + 1.0e-3 * np.arange(rows), {})])


def coloured_noise(rng: np.random.Generator, rows: int) -> tuple[Floats, Floats]:
    """Noise with the spectrum 0.1^2 + 4 / (1 + (f/60)^2), f in lines; and that spectrum at the lines of its FFT."""
    lines = np.arange(rows // 2 + 1)
    level = 0.01 + 0.5 / (1.0 + (lines / 60.0) ** 2)
    waves = np.fft.rfft(rng.normal(size=rows)) * np.sqrt(level)
    return np.fft.irfft(waves, rows), level


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_known_spectrum_is_recovered_and_whitened(seed: int) -> None:
    """White level, total and the whole curve within 20 % in amplitude; whitened, every part of the band has variance 1."""
    bench = quiet_bench()
    noise_n, level = coloured_noise(np.random.default_rng(seed), bench.rows)
    whiten = coloured_whitener(bench, noise_n, np.empty((0, bench.rows)), np.ones(bench.rows))
    found = whiten.noises[0]
    assert 1.0 / found.weights[-1] == pytest.approx(0.1, rel=0.2), "the white level"
    assert whiten.floor_n == pytest.approx(float(np.std(noise_n)), rel=0.2)
    lines = np.unique(np.geomspace(5, level.size - 1, 40).astype(int))
    np.testing.assert_allclose(1.0 / found.weights[lines], np.sqrt(level[lines]), rtol=0.2)
    power = np.abs(np.fft.rfft(whiten(noise_n))) ** 2 / bench.rows
    assert float(np.mean(power)) == pytest.approx(1.0, abs=0.05)
    for low, high in ((20, 120), (120, 600), (600, 3000), (3000, 6000)):
        assert float(np.mean(power[low:high])) == pytest.approx(1.0, abs=0.25)


def test_white_noise_stays_white_under_its_whitening() -> None:
    bench = quiet_bench()
    noise_n = np.random.default_rng(7).normal(0.0, 0.3, bench.rows)
    whiten = coloured_whitener(bench, noise_n, np.empty((0, bench.rows)), np.ones(bench.rows))
    assert 1.0 / whiten.noises[0].weights[-1] == pytest.approx(0.3, rel=0.05)
    assert whiten.noises[0].total_n == pytest.approx(0.3, rel=0.05)
    np.testing.assert_allclose(whiten(noise_n), noise_n / 0.3, atol=0.5)


def test_a_linear_problem_is_solved_in_one_wave() -> None:
    """Offset, drift and the zero's dependence on temperature enter linearly."""
    time_s = SHORT_S
    columns = {"temperature_c": 23.0 + 4.0 * np.sin(0.6 * time_s)}
    machine = plant({"cell.drift_n_per_s": 0.05, "cell.zero_n_per_k": -0.3})
    volts = command_v(time_s)
    force_n = readings_n(machine, time_s, volts, columns) + np.random.default_rng(8).normal(0.0, 0.1, time_s.size)
    bench = bench_of([measurement(time_s, volts, force_n, columns)])
    whiten = white_whitener(bench, bench.measured_n)
    start = FitProblem(ModelParameters(MACHINE, (0.0,)), (DRIFT, ZERO_PER_K))
    (found,) = refine(bench, [start], whiten, waves=1)
    left = squares(whiten(found.jacobian), whiten(found.residual_n))
    assert found.chi2 == pytest.approx(left, rel=1e-7)
    assert found.parameters.value(DRIFT) == pytest.approx(0.05, abs=0.003)
    assert found.parameters.value(ZERO_PER_K) == pytest.approx(-0.3, abs=0.005)


def told(found: Diagnosis) -> list[tuple[str, tuple[str, ...]]]:
    return [(cause.name, tuple(sorted(cause.group))) for cause in found.causes]


def sizes(found: Diagnosis) -> Mapping[str, float]:
    return {name: each.value for cause in found.causes for name, each in cause.parameters.items()}


def assert_same(one: Diagnosis, other: Diagnosis) -> None:
    assert told(one) == told(other) and told(one) != []
    assert one.verdict == other.verdict
    assert sizes(other) == pytest.approx(sizes(one), rel=0.01)
    assert other.extended.held_out_rms_n == pytest.approx(one.extended.held_out_rms_n, rel=0.01)


@pytest.fixture(scope="module")
def plain() -> Diagnosis:
    return diagnose([short()])


def test_the_plain_one_is_right(plain: Diagnosis) -> None:
    assert plain.causes[0].name == "load-dependent-friction"


def test_what_every_machine_has_is_no_finding_and_no_noise() -> None:
    """Half a millisecond of delay under a hundredth of the usual noise: in the base model, and no work for other names."""
    volts, noise_n = command_v(SHORT_S), np.random.default_rng(11).normal(0.0, 0.01, SHORT_S.size)
    late_n = readings_n(plant({"regulator.delay_s": 5.0e-4}), SHORT_S, volts, {})
    found = diagnose([measurement(SHORT_S, volts, late_n + noise_n, {})])
    assert found.causes == ()
    assert found.baseline.rms_n == pytest.approx(0.01, rel=0.1)
    assert found.extended.held_out_rms_n == pytest.approx(0.01, rel=0.1)


@pytest.mark.parametrize("constant_n", [pytest.param(-30.0, marks=pytest.mark.long), 500.0])
def test_a_constant_added_to_the_force_changes_nothing(plain: Diagnosis, constant_n: float) -> None:
    assert_same(plain, diagnose([short(constant_n)]))


@pytest.mark.long
def test_the_order_of_covariates_changes_nothing() -> None:
    one = short(columns=("temperature_c", "supply_kpa", "feed_mm_s"))
    turned = dict(reversed(list(one.covariates.items())))
    assert list(turned) != list(one.covariates)
    assert_same(diagnose([one]), diagnose([replace(one, covariates=turned)]))


def test_a_shift_in_time_changes_nothing(plain: Diagnosis) -> None:
    """A clock that counts from yesterday: the reader begins at zero, so the diagnosis never knows."""
    one = short()
    assert one.command_v is not None
    shifted = {"time_s": one.time_s + 86400.0, "command_v": one.command_v, "force_n": one.force_n}
    read = measurement_of(Recording(Path("x.csv"), {}, shifted, one.rows, False))
    np.testing.assert_allclose(read.time_s, one.time_s, atol=1e-9)
    assert_same(plain, diagnose([read]))


@pytest.mark.long
def test_recordings_with_their_own_offsets_share_one_model(plain: Diagnosis) -> None:
    two = [short(), short(-7.0, seed=5)]
    bench = bench_of(two)
    whiten = white_whitener(bench, bench.measured_n)
    base = fit_base(bench, DEFAULT_PLANT, base_parameters(bench, frozenset()), whiten)
    assert base.parameters.offsets_n[0] - base.parameters.offsets_n[1] == pytest.approx(7.0, abs=0.05)
    found = diagnose(two)
    assert told(found)[0][0] == "load-dependent-friction"
    assert sizes(found)["load_dependent_n_per_n"] == pytest.approx(0.05, rel=0.1)
    assert found.extended.held_out_rms_n == pytest.approx(plain.extended.held_out_rms_n, rel=0.1)
    assert [trace.measurement for trace in found.traces] == two


def test_asking_twice_gives_the_same_answer(plain: Diagnosis) -> None:
    again = diagnose([short()])
    assert diagnosis_document(again, 1.0) == diagnosis_document(plain, 1.0)


def test_the_document_survives_json_and_has_the_contract_s_fields(plain: Diagnosis) -> None:
    document = diagnosis_document(plain, 2.5)
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert document["format"] == 1
    assert set(document) >= {
        "verdict", "baseline", "causes", "leftover", "not_identifiable", "rejected", "extended", "runtime_s"
    }  # fmt: skip
    cause = document["causes"][0]
    assert set(cause) == {"name", "group", "confidence", "parameters", "gain"}
    known = {parameter.name for parameter in BY_NAME[cause["name"]].parameters}
    assert set(cause["parameters"]) <= known
    assert set(cause["gain"]) == {"held_out_rms_before_n", "held_out_rms_after_n", "ci95", "share_of_excess"}


def test_a_diagnosis_needs_a_recording_and_a_known_name() -> None:
    with pytest.raises(ValueError, match="at least one recording"):
        diagnose([])
    with pytest.raises(KeyError):
        diagnose([short()], None, Options(without="gremlins"))


@pytest.mark.long
def test_a_step_of_the_command_is_met_to_a_tenth_of_a_tooth() -> None:
    """Five volts hold 280 teeth of 18 mV: a step that is off by 0.1 % is off by a quarter of a tooth at the top."""
    found = diagnose([recorded({"regulator.command_step_v": 0.0179}, noise_n=0.05, seed=6)])
    assert [cause.name for cause in found.causes] == ["command-quantisation"]
    assert found.causes[0].parameters["command_step_v"].value == pytest.approx(0.0179, rel=3e-4)


def test_a_bench_is_a_value_that_no_step_of_a_search_changes() -> None:
    """What leaves rows or columns out gives another bench; what was weighed before stays as it was."""
    rng = np.random.default_rng(6)
    bench, fitted = linear_problem(rng)
    columns, rows = rng.normal(size=(2, bench.rows)), np.arange(bench.rows) == 1500
    whiten = white_whitener(bench, fitted.residual_n)
    before = bench.usable.copy(), bench.reduce(columns), whiten(fitted.residual_n)
    fewer = bench.without_rows(rows).without_columns(columns)
    np.testing.assert_array_equal(bench.usable, before[0])
    np.testing.assert_array_equal(bench.reduce(columns), before[1])
    np.testing.assert_array_equal(whiten(fitted.residual_n), before[2])
    assert int(bench.judged.sum()) == int(fewer.judged.sum()) + 1
    assert float(np.abs(fewer.reduce(columns)).max()) < 1e-9 * float(np.abs(before[1]).max())
    with pytest.raises(FrozenInstanceError):
        bench.usable = ~rows  # type: ignore[misc]


def test_rows_whose_times_are_in_doubt_weigh_less_only_while_the_force_moves() -> None:
    bench, fitted = linear_problem(np.random.default_rng(7))
    ramp_n = np.where(bench.time_s() > 10.0, bench.time_s(), 10.0)
    weights = timing_weights(bench, ramp_n, late_s=0.1, noise_n=0.1)
    assert weights[100] == 1.0
    assert weights[1500] == pytest.approx(1.0 / np.sqrt(2.0))
    whiten = white_whitener(bench, fitted.residual_n, weights)
    assert not whiten.knows_times
    assert white_whitener(bench, fitted.residual_n).knows_times


def test_a_search_whose_effects_are_all_accepted_ends_with_them() -> None:
    """Nothing is left to compare then, and no vector to whiten: of a catalogue of one effect it ended in a ValueError."""
    start, effect = prepare_search([short()], MACHINE, Options()), BY_NAME["load-dependent-friction"]
    found = search_effects(start.bench, start.base, [effect], start.whiten)
    assert [each.effect for each in found.accepted] == [effect] and not found.last.ranked
