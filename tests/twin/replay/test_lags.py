"""A slew limit behind the lags lets the pressure through as a plain march does."""

import numpy as np
import pytest

from gateway.twin import Drive, Plant, Regulator, Replay


def march(pressure_pa: np.ndarray, most_pa: np.ndarray) -> np.ndarray:
    passed = [float(pressure_pa[0])]
    for asked, most in zip(pressure_pa[1:].tolist(), most_pa.tolist(), strict=True):
        passed.append(passed[-1] + max(-most, min(most, asked - passed[-1])))
    return np.array(passed)


@pytest.mark.parametrize("seed", range(5))
def test_where_a_slew_limit_binds_the_pressure_is_that_of_a_plain_march(seed: int) -> None:
    rng = np.random.default_rng(seed)
    time_s = np.concatenate([[0.0], np.cumsum(rng.uniform(0.002, 0.004, 400))])
    command_v = np.repeat(rng.uniform(0.5, 9.0, 41), 10)[:401]
    drive, slew_pa_per_s = Drive(time_s=time_s, command_v=command_v), float(rng.uniform(5.0e5, 5.0e6))
    free, limited = (
        Replay(drive)
        .run([Plant(regulator=Regulator(lag_s=0.03, slew_pa_per_s=slew)) for slew in (1.0e12, slew_pa_per_s)])
        .pressure_pa
    )
    np.testing.assert_allclose(limited, march(free, slew_pa_per_s * np.diff(time_s)), atol=1.0e-3)
    assert np.abs(limited - free).max() > 1.0e3
