"""What is told at the edge of the band comes once, and does not come and go with the noise of the cell."""

from collections.abc import Iterator
from itertools import pairwise
from random import Random

import pytest

from gateway.control.sample_conditioning import Reading
from gateway.control.supervision.in_band import SettlingCheck
from tests.control.supervision.test_in_band import UNREACHABLE_S, at, demand

TICK_S = 0.01


def play(
    check: SettlingCheck, forces_n: list[float], cell_s: float, in_band_time_s: float = 0.25
) -> Iterator[SettlingCheck]:
    """Show it one reading after the other, each for its ticks."""
    for k, force_n in enumerate(forces_n):
        for tick in range(round(cell_s / TICK_S)):
            reading = Reading(contact_n=force_n, interval_s=cell_s, is_new=tick == 0, is_usable=True)
            inputs = at(k * cell_s + tick * TICK_S)._replace(reading=reading)
            check.judge_force(demand(in_band_time_s=in_band_time_s), inputs, 10.0, 10.0)
            yield check


@pytest.mark.parametrize("cell_s", [0.01, 0.02, 0.1, 0.2])
@pytest.mark.parametrize("off_n", [1.0, 1.02, 1.05])
def test_a_force_at_the_very_edge_is_not_missed_and_found_again_with_the_noise(cell_s: float, off_n: float) -> None:
    """Of a cell of 0.05 N rms A301 came eight times a minute."""
    rng = Random(f"{cell_s} {off_n}")
    forces_n = [10.0 + off_n + rng.gauss(0.0, 0.05) for _ in range(round(60.0 / cell_s))]
    was, comes = False, 0
    for check in play(SettlingCheck(UNREACHABLE_S), forces_n, cell_s):
        comes, was = comes + (check.unreachable and not was), check.unreachable
    assert comes <= 2


@pytest.mark.parametrize(("off_n", "found_s"), [(0.7, 0.3), (0.95, UNREACHABLE_S)])
def test_a_missed_force_that_stays_in_the_band_is_found_at_its_edge_too(off_n: float, found_s: float) -> None:
    check = SettlingCheck(UNREACHABLE_S)
    forces_n = [13.0] * 300 + [10.0 + off_n] * 300
    missed_s = [TICK_S * k for k, one in enumerate(play(check, forces_n, TICK_S)) if one.unreachable]
    assert (missed_s[0], missed_s[-1]) == pytest.approx((UNREACHABLE_S, 3.0 + found_s), abs=2.0 * TICK_S)
    assert check.in_band


@pytest.mark.parametrize("in_band_time_s", [0.0, 0.1])
@pytest.mark.parametrize(("noise_n", "is_told"), [(0.3, False), (0.6, True), (1.0, True)])
def test_a_band_that_comes_and_goes_without_pause_is_told(noise_n: float, is_told: bool, in_band_time_s: float) -> None:
    """With an in-band time of 0 it came a thousand times a minute, and W361 did not: each time it counted as held."""
    rng = Random(1)
    forces_n = [10.0 + rng.gauss(0.0, noise_n) for _ in range(2000)]
    told = [one.is_noisy for one in play(SettlingCheck(UNREACHABLE_S), forces_n, TICK_S, in_band_time_s)]
    assert any(told) is is_told
    assert sum(now and not before for before, now in pairwise(told)) == is_told, "and once"
