"""One settled point per dwell; what is on its way is none."""

from collections.abc import Callable

import numpy as np
import pytest

from gateway.bsfm.ladder.settled_points import find_settled_points


@pytest.mark.parametrize("rate_hz", [10.0, 25.0, 100.0])
def test_the_one_reading_of_a_slew_is_no_point_however_slow_the_readings(rate_hz: float) -> None:
    """A stair goes up over a voltage that lasts one row, whose force is still the one of before."""
    volts, forces = [0.0] * 20, [0.0] * 20
    for stair in (2.0, 4.0):
        volts += [stair - 1.0, *[stair] * round(1.5 * rate_hz)]
        forces += [forces[-1], forces[-1], *np.full(round(1.5 * rate_hz) - 1, 10.0 * stair)]
    times = np.arange(len(volts)) / rate_hz
    points = find_settled_points(times, np.array(volts), np.array(forces))
    assert points.voltage_v.tolist() == [0.0, 2.0, 4.0]
    assert points.force_n.tolist() == pytest.approx([0.0, 20.0, 40.0])


def dwells(tail_n: Callable[[int, np.ndarray], np.ndarray], stairs: int = 40) -> float:
    """Noise of stairs of 1 s at 80 Hz; tail_n: force from the stair's number and the time within it."""
    within_s = np.arange(80) / 80.0
    force_n = np.concatenate([tail_n(stair, within_s) for stair in range(stairs)])
    volts = np.repeat(0.1 * np.arange(stairs), 80)
    return find_settled_points(np.arange(force_n.size) / 80.0, volts, np.roll(force_n, 1)).noise_n


def test_the_noise_at_rest_is_neither_what_creeps_nor_a_knock() -> None:
    rng = np.random.default_rng(5)
    noise: Callable[[], np.ndarray] = lambda: rng.normal(0.0, 0.1, 80)  # noqa: E731
    assert dwells(lambda stair, at_s: stair + noise()) == pytest.approx(0.1, rel=0.1)
    assert dwells(lambda stair, at_s: stair + 2.0 * at_s + noise()) == pytest.approx(0.1, rel=0.1)
    knocked = lambda stair, at_s: stair + noise() + 5.0 * (stair == 7) * (at_s > 0.9)  # noqa: E731
    assert dwells(knocked) == pytest.approx(0.1, rel=0.1)


def test_two_readings_to_a_stair_show_the_noise_as_well() -> None:
    rng = np.random.default_rng(6)
    volts = np.repeat(0.1 * np.arange(80), 5)
    force_n = np.roll(8.0 * volts, 1) + rng.normal(0.0, 0.1, 400)
    points = find_settled_points(np.arange(400) / 10.0, volts, force_n)
    assert points.noise_n == pytest.approx(0.1, rel=0.2)


@pytest.mark.parametrize("lost", [1, 2, 4])
def test_rows_that_are_lost_at_a_stairs_beginning_leave_the_one_before_as_it_was(lost: int) -> None:
    """The first row of a stair reads the force of the one before; behind a gap it is on its way: 0.5 N in a mean of five."""
    stair = np.repeat(np.arange(10), 20)
    within = np.tile(np.arange(20), 10)
    before_n = np.where(within == 0, 2.0 * np.maximum(stair - 1, 0), 0.0)
    force_n = np.where(within == 0, before_n, 2.0 * stair)
    kept = (within == 0) & (stair == 0) | (within >= lost)
    points = find_settled_points(np.arange(200)[kept] / 20.0, 0.5 * stair[kept], force_n[kept])
    assert points.force_n.tolist() == pytest.approx(list(range(0, 20, 2)))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("late", [0, 1])
def test_a_table_of_one_row_to_a_stair_is_read_by_its_turns_whatever_the_sign_of_its_force(
    sign: float, late: int
) -> None:
    """Of a cell whose wires are exchanged the force falls where the voltage rises, as clearly."""
    volts = np.array([0.0, 1.0, 2.0, 3.0, 2.0, 1.0, 0.0, 1.0, 2.0, 1.0, 0.0, 0.0])
    force_n = sign * np.roll(8.0 * volts, late)
    points = find_settled_points(1.0 * np.arange(len(volts)), volts, force_n)
    assert points.force_n.tolist() == pytest.approx((sign * 8.0 * points.voltage_v).tolist())
    assert len(points) == len(volts) - late
