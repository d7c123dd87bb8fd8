"""What is told at the edge of the band, or of a trim's range, does not come and go with the noise of the cell."""

from collections.abc import Iterator
from itertools import pairwise
from random import Random

import pytest

from gateway.codes.warning_bits import WarningBit
from gateway.control import Trim
from gateway.control.force_loop.trim import TrimIntegral
from gateway.control.sample_conditioning import Reading
from gateway.control.supervision.in_band import SettlingCheck
from gateway.registers.words import LimitedBy
from tests.control.bench import enabled
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


def test_a_trim_that_has_used_up_its_range_does_not_come_and_go_with_a_moving_target() -> None:
    """Each step of a ramp faded the trim by a hair, and each reading took it back: A340 came a hundred times a second."""
    bench = enabled(gain_n_per_v=4.0)
    bench.force(20.0)
    bench.run(3.0)
    first = len(bench.history)
    bench.write(force_setpoint_n=30.0, force_ramp_n_per_s=5.0)
    bench.run(1.0)
    told = [bool(record.output.warnings & WarningBit.TRIM_SATURATED) for record in bench.history[first:]]
    assert told == [True] * len(told)


def test_a_travel_of_nothing_leaves_a_trim_at_its_limit() -> None:
    """A payload that counts along the ramp moved the target by a rounding error."""
    trim = TrimIntegral(Trim(gain_v_per_n_s=1.0, limit_v=0.5))
    trim.integrate(9.0, 1.0)
    trim.travel(1e-17)
    assert (trim.value_v, trim.limited_by) == (0.5, LimitedBy.TRIM_RANGE)
