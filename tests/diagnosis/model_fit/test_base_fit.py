"""The base model of a recording that hardly says anything: what is not known stays where the start has it."""

import numpy as np
import pytest

from gateway.catalogue.sensing import CLOCK_OFFSET
from gateway.diagnosis import Measurement
from gateway.diagnosis.bench.bench import bench_of
from gateway.diagnosis.model_fit.base_fit import base_parameters, fit_base
from gateway.diagnosis.model_fit.normal_equations import NormalEquations, held_out_errors, model_span
from gateway.diagnosis.noise.whitening import white_whitener
from gateway.diagnosis.verdict import estimates_of
from tests.diagnosis.machine import MACHINE, NOISE_N, recorded, times_s


@pytest.mark.parametrize("seed", range(4))
def test_a_hold_says_nothing_of_the_gain(seed: int) -> None:
    """A fifth of a second of 10 mV in 20 s: before, the noise's own gain gave an area of 1e-7 or 0.02 m2, and -4451 N."""
    command_v = np.full(2000, 2.0)
    command_v[460:480] += 0.01 * np.sin(np.arange(20.0))
    hold = Measurement(
        name="hold",
        time_s=np.arange(2000) * 0.01,
        force_n=17.0 + np.random.default_rng(seed).normal(0.0, NOISE_N, 2000),
        usable=np.ones(2000, dtype=bool),
        repeated=np.zeros(2000, dtype=bool),
        command_v=command_v,
    )
    bench = bench_of([hold])
    fitted = fit_base(bench, MACHINE, base_parameters(bench, frozenset()), white_whitener(bench, bench.measured_n))
    assert bench.rms_n(fitted.residual_n) == pytest.approx(NOISE_N, rel=0.1)
    assert fitted.parameters.plant.cylinder.area_m2 == pytest.approx(MACHINE.cylinder.area_m2, rel=0.05)
    assert abs(fitted.parameters.offsets_n[0]) < 5.0


def test_what_a_number_at_the_end_of_its_range_would_save_beyond_it_is_not_the_model_s() -> None:
    """A delay of 0.1 s beyond the wires' own was no finding: held out, the base model had left half of what it leaves."""
    bench = bench_of([recorded({"regulator.delay_s": MACHINE.regulator.delay_s + 0.1}, time_s=times_s(20.0, 100.0))])
    whiten = white_whitener(bench, bench.measured_n)
    fitted = fit_base(bench, MACHINE, base_parameters(bench, frozenset(), late_s=0.035), whiten)
    assert fitted.parameters.value(CLOCK_OFFSET) == 0.035
    left_n = bench.rms_n(fitted.residual_n)
    assert left_n < held_out_errors(bench, fitted, whiten).rms_n < 1.3 * left_n
    columns = [k for k, each in enumerate(fitted.free, 1) if each.path == CLOCK_OFFSET.path]
    beyond = NormalEquations(model_span(fitted, whiten), whiten.spectra(fitted.jacobian[columns]))
    assert beyond.add([0]).gain > 0.1 * fitted.chi2


def test_the_intervals_of_a_fit_hold_the_truth_as_often_as_they_say() -> None:
    """Of 95 %: neither ten times too narrow, which would make any number a sure one, nor so wide that they say nothing."""
    shares = []
    for seed in range(6):
        bench = bench_of([recorded({}, seed=seed, time_s=times_s(30.0, 100.0))])
        whiten = white_whitener(bench, bench.measured_n)
        fitted = fit_base(bench, MACHINE, base_parameters(bench, frozenset()), whiten)
        for name, estimate in estimates_of(bench, fitted, fitted.free, whiten).items():
            if estimate.section in ("regulator", "cylinder", "friction", "contact"):
                low, high = estimate.ci95
                truth = getattr(getattr(MACHINE, estimate.section), name)
                shares.append(abs(estimate.value - truth) / (0.5 * (high - low)))
    inside = np.mean(np.array(shares) <= 1.0)
    assert inside >= 0.8, shares
    assert np.median(shares) > 0.1
