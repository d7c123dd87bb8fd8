"""Spikes and coarse counts: what is counted as one, what of them is told, and what is none."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gateway.catalogue.sensing import OUTLIER, OUTLIER_SHARE
from gateway.diagnosis.search.direct_evidence import FEWEST_SPIKES, find_outliers, find_quantisation

ROWS, NOISE_N = 4000, 0.1


def bench_of(usable: np.ndarray) -> Any:
    channel = SimpleNamespace(rows=slice(0, ROWS), is_force=True, recording=0)
    return SimpleNamespace(
        rows=ROWS,
        channels=[channel],
        measured_n=np.zeros(ROWS),
        usable=usable,
        judged=usable,
        rms_n=lambda residual_n: float(np.sqrt(np.mean(residual_n[usable] ** 2))),
    )


def residual_of(spikes_n: list[float]) -> np.ndarray:
    """Noise, and spikes a hundred rows apart."""
    residual_n = np.random.default_rng(2).normal(0.0, NOISE_N, ROWS)
    residual_n[100 : 100 * (len(spikes_n) + 1) : 100] = spikes_n
    return residual_n


@pytest.mark.parametrize("spikes_n", [[5.0] * 20, [5.0, -5.0] * 10, [-5.0] * 20])
def test_spikes_have_one_size_to_whichever_side_they_go(spikes_n: list[float]) -> None:
    found = find_outliers(bench_of(np.ones(ROWS, dtype=bool)), residual_of(spikes_n), 0.0)
    assert found is not None and np.flatnonzero(found.rows).tolist() == list(range(100, 2100, 100))
    told = {parameter: value for parameter, value, _ in found.values}
    assert told[OUTLIER] == pytest.approx(5.0, abs=0.05) and told[OUTLIER_SHARE] == 20 / ROWS
    assert found.after_n == pytest.approx(NOISE_N, rel=0.05) and found.before_n > 3.0 * found.after_n


def test_a_row_that_is_no_witness_is_no_spike() -> None:
    usable = np.ones(ROWS, dtype=bool)
    usable[100:1100] = False
    found = find_outliers(bench_of(usable), residual_of([5.0] * 20), 0.0)
    assert found is not None and np.flatnonzero(found.rows).tolist() == list(range(1100, 2100, 100))


@pytest.mark.parametrize(
    ("spikes_n", "quantum_n"), [([5.0] * (FEWEST_SPIKES - 1), 0.0), ([5.0] * 20, 6.0), ([0.3] * 20, 0.0)]
)
def test_a_few_one_count_and_what_noise_may_do_are_no_finding(spikes_n: list[float], quantum_n: float) -> None:
    assert find_outliers(bench_of(np.ones(ROWS, dtype=bool)), residual_of(spikes_n), quantum_n) is None


def readings(quantum_n: float, noise_n: float = 0.1) -> np.ndarray:
    force_n = 20.0 + 5.0 * np.sin(np.arange(ROWS) / 60.0) + np.random.default_rng(6).normal(0.0, noise_n, ROWS)
    return np.round(force_n / quantum_n) * quantum_n if quantum_n else force_n


def bench_with(*forces_n: np.ndarray) -> Any:
    usable = np.ones(ROWS, dtype=bool)
    bench = bench_of(usable)
    bench.measurements = [SimpleNamespace(force_n=force_n, usable=usable) for force_n in forces_n]
    return bench


NOISE = np.random.default_rng(7).normal(0.0, 0.1, ROWS)


@pytest.mark.parametrize(("known_n", "is_found"), [(0.0, True), (0.05, True), (0.2, False), (0.3, False)])
def test_steps_that_are_known_are_no_finding_and_coarser_ones_are(known_n: float, is_found: bool) -> None:
    found = find_quantisation(bench_with(readings(0.2)), NOISE, known_n)
    assert (found is not None) == is_found
    if found is not None:
        assert found.values[0][1] == pytest.approx(0.2, rel=1.0e-6) and found.after_n < found.before_n


def test_levels_that_lie_on_no_lattice_are_no_steps_of_a_converter() -> None:
    levels = 10.0 + np.cumsum(np.tile([1.0, 1.37], 10))
    found_n = levels[np.argmin(np.abs(readings(0.0)[:, None] - levels), axis=1)]
    assert find_quantisation(bench_with(found_n), NOISE, 0.0) is None
    fine = bench_with(readings(0.2), readings(0.0))
    assert find_quantisation(fine, NOISE, 0.0) is None, "one of two recordings has none"
