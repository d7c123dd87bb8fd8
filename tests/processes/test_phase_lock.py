"""The tick comes right behind a cell that streams at its rate, and behind nothing else."""

from collections.abc import Callable
from random import Random

import pytest

from gateway.processes.phase_lock import ARRIVALS, BEHIND_S, TOLERANCE_S, PhaseLock

PERIOD_S = 0.01
BEGIN_S = 5000.0
MOST_S = 0.1 * PERIOD_S


def follow(arrival_before: Callable[[float], float], ticks: int) -> tuple[list[float], float]:
    """All shifts but the zeros, and by how much the last tick was due behind the newest arrival then."""
    lock, due_s, shifts = PhaseLock(PERIOD_S), BEGIN_S, []
    for _ in range(ticks):
        due_s += PERIOD_S
        arrival_s = arrival_before(due_s)
        if shift_s := lock.shift_s(arrival_s, due_s):
            shifts.append(shift_s)
            due_s += shift_s
    return shifts, due_s - arrival_before(due_s)


def stream(period_s: float, phase_s: float, jitter_s: float = 0.0) -> Callable[[float], float]:
    """The newest arrival until some time, of a cell that streams."""

    def newest(now_s: float) -> float:
        number = int((now_s - BEGIN_S - phase_s) / period_s)
        while (arrival_s := BEGIN_S + phase_s + number * period_s + jitter_s * Random(number).random()) > now_s:
            number -= 1
        return arrival_s

    return newest


@pytest.mark.parametrize("phase_s", [0.0, 0.0002, 0.004, 0.0051, 0.0097])
@pytest.mark.parametrize("every", [1, 2, 5])
def test_the_tick_comes_right_behind_a_steady_stream_of_its_rate_or_a_part_of_it(phase_s: float, every: int) -> None:
    shifts, behind_s = follow(stream(every * PERIOD_S, phase_s), 8 * ARRIVALS * every)
    assert behind_s % PERIOD_S == pytest.approx(BEHIND_S, abs=TOLERANCE_S + 1e-9)
    assert all(abs(shift_s) <= MOST_S + 1e-12 for shift_s in shifts)
    assert len(shifts) <= 6, "half a period at most, the shorter way, and then it stays"


def test_a_cell_whose_clock_goes_otherwise_is_followed_all_the_time() -> None:
    _, behind_s = follow(stream(PERIOD_S * (1.0 + 2e-4), 0.003), 5000)
    assert behind_s == pytest.approx(BEHIND_S, abs=TOLERANCE_S + ARRIVALS * PERIOD_S * 2e-4)


def test_jitter_of_a_wire_does_not_move_the_tick_for_ever() -> None:
    shifts, behind_s = follow(stream(PERIOD_S, 0.004, jitter_s=0.0004), 100 * ARRIVALS)
    assert -0.0004 < behind_s - BEHIND_S < 0.0004
    assert sum(map(abs, shifts[6:])) < 100 * 0.0002


@pytest.mark.parametrize("period_s", [0.001, 1.0 / 80.0, 0.004, 0.0137])
def test_another_rate_is_not_followed(period_s: float) -> None:
    shifts, _ = follow(stream(period_s, 0.0033), 20 * ARRIVALS)
    assert not shifts or period_s == 0.001, "ten arrivals a period: one of them is always right before the tick"
    assert all(abs(shift_s) < 0.001 for shift_s in shifts)


def test_what_arrives_as_it_likes_is_not_followed() -> None:
    shifts, _ = follow(stream(PERIOD_S, 0.002, jitter_s=0.005), 20 * ARRIVALS)
    assert not shifts


def test_an_arrival_that_is_told_again_counts_once() -> None:
    lock = PhaseLock(PERIOD_S)
    assert all(lock.shift_s(BEGIN_S, BEGIN_S + 0.005 + k * PERIOD_S) == 0.0 for k in range(10 * ARRIVALS))
    fresh = [lock.shift_s(BEGIN_S + k * PERIOD_S, BEGIN_S + k * PERIOD_S + 0.005) for k in range(1, ARRIVALS)]
    assert [bool(shift_s) for shift_s in fresh] == [False] * (ARRIVALS - 2) + [True]
