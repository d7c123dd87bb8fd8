"""One reading that alone is far off spoils neither a stair's force nor what is known of the noise."""

from random import Random

import numpy as np
import pytest

from gateway.bsfm.ladder.lone_reading import LONE_N, without_lone_reading
from gateway.bsfm.ladder.settled_points import find_settled_points

CALM_N = [20.0, 20.1, 19.9, 20.0, 20.2]


@pytest.mark.parametrize("at", range(6))
@pytest.mark.parametrize("said_n", [58.0, -30.0, 20.1 + 1.1 * LONE_N])
def test_the_one_that_is_alone_is_left_out_wherever_it_is(at: int, said_n: float) -> None:
    assert without_lone_reading([*CALM_N[:at], said_n, *CALM_N[at:]]) == CALM_N


@pytest.mark.parametrize(
    "forces_n", [[], [58.0], [20.0, 58.0], CALM_N, [*CALM_N, 58.0, 57.0], [10.0, 12.0, 14.0, 16.0, 18.0]]
)
def test_nothing_else_is_left_out(forces_n: list[float]) -> None:
    """Two that agree, a force that moves, too few to tell."""
    assert without_lone_reading(forces_n) == forces_n


def test_of_much_noise_next_to_nothing_is_left_out() -> None:
    rng = Random(4)
    windows = [[rng.gauss(20.0, 2.0) for _ in range(20)] for _ in range(500)]
    assert sum(len(without_lone_reading(window)) < 20 for window in windows) < 20, "4 in 100 of the noisiest cells"


@pytest.mark.parametrize("rate_hz", [10, 100])
def test_a_false_reading_in_the_end_of_a_dwell_moves_no_point_of_a_fit(rate_hz: int) -> None:
    volts = np.repeat(np.arange(5.0), rate_hz)
    force_n = np.roll(8.0 * volts, 1)
    spoiled_n = force_n.copy()
    spoiled_n[3 * rate_hz - 2] = 70.0
    clean, spoiled = (find_settled_points(np.arange(volts.size) / rate_hz, volts, one) for one in (force_n, spoiled_n))
    assert spoiled.force_n.tolist() == pytest.approx(clean.force_n.tolist(), abs=0.01)
