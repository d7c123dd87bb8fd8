"""Spikes: what is counted as one, what of them is told, and what is none."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gateway.catalogue.sensing import OUTLIER, OUTLIER_SHARE
from gateway.diagnosis.search.direct_evidence import FEWEST_SPIKES, find_outliers

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
