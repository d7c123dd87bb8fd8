"""The slew limit of a replay, marched only where it binds, is the plain march."""

import numpy as np
import pytest

from gateway.twin.replay.lags import _limit_slew


def march(pressure_pa: np.ndarray, most_pa: np.ndarray) -> np.ndarray:
    """Step by step, without a shortcut."""
    passed = [float(pressure_pa[0])]
    for asked, most in zip(pressure_pa[1:].tolist(), most_pa.tolist(), strict=True):
        passed.append(passed[-1] + max(-most, min(most, asked - passed[-1])))
    return np.array(passed)


@pytest.mark.parametrize("seed", range(20))
def test_where_a_slew_limit_binds_the_pressure_is_that_of_a_plain_march(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = int(rng.integers(2, 400))
    steps = rng.normal(0.0, 1.0e4, rows) * (rng.random(rows) < rng.random())
    pressure_pa = 1.0e5 + np.cumsum(steps)
    most_pa = np.full(rows - 1, rng.random() * 2.0e4) if seed % 2 else rng.random(rows - 1) * 2.0e4
    assert _limit_slew(pressure_pa, most_pa) == pytest.approx(march(pressure_pa, most_pa), abs=1.0e-9)
    assert _limit_slew(pressure_pa, float(most_pa.max())) == pytest.approx(
        march(pressure_pa, np.full(rows - 1, most_pa.max())), abs=1.0e-9
    )
