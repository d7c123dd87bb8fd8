"""The count of a load cell is learned from its changes: one disturbed digit, finer than the display's step, is none."""

from math import inf

import pytest

from tests.control.supervision.readings.test_stuck_sensor import QUANTUM_N, Cell, Watched

FALSE_COUNTS = 0.2  # a display that steps by five, and a last digit of one


class DisturbedCell(Cell):
    """Its reading of one number is read wrong on the way."""

    disturbed_at = 30

    def value_n(self) -> float:
        value_n = super().value_n()
        return value_n + FALSE_COUNTS * QUANTUM_N if self._k == self.disturbed_at else value_n


@pytest.mark.parametrize("rate_hz", [10.0, 20.0, 100.0])
def test_a_cell_that_rightly_repeats_itself_is_not_dead_behind_one_false_digit(rate_hz: float) -> None:
    """It was called frozen, two of these eight, by noise that seemed five times as large."""
    for seed in range(8):
        assert Watched().after(DisturbedCell(0.2, seed, rate_hz), 3000.0 / rate_hz) == inf


@pytest.mark.sampled
@pytest.mark.parametrize("disturbed_at", [1, 2, 3, 4])
@pytest.mark.parametrize("counts", [0.1, 0.2, 0.3])
def test_a_false_digit_in_the_first_readings_is_no_count_either(disturbed_at: int, counts: float) -> None:
    """There was no larger count to go back to: of a quiet cell the first change of all was kept for good, and two of these
    eight were called frozen."""
    for seed in range(8):
        watched, cell = Watched(), DisturbedCell(counts, seed, 20.0)
        cell.disturbed_at = disturbed_at
        assert watched.after(cell, 150.0) == inf
        assert watched.watch._noise.count_n == pytest.approx(QUANTUM_N)


@pytest.mark.parametrize("disturbed_at", [30, 400, 1500])
def test_how_soon_a_frozen_cell_is_found_is_told_behind_a_false_digit_as_without(disturbed_at: int) -> None:
    found_s = []
    for kind in (Cell, DisturbedCell):
        watched, cell = Watched(), kind(0.3, 1, 20.0)
        cell.disturbed_at = disturbed_at  # type: ignore[attr-defined]
        assert watched.after(cell, 150.0) == inf
        found_s.append(watched.watch.found_s)
    assert found_s[1] == pytest.approx(found_s[0], rel=0.1)


def test_a_count_that_shows_again_and_again_is_learned() -> None:
    """A display that was set to a finer step while the gateway ran."""
    watched = Watched()
    assert watched.after(Cell(0.5, 1, 100.0), 20.0) == inf
    finer = Cell(1.0, 2, 100.0, quantum_n=0.1 * QUANTUM_N)
    assert watched.after(finer, 20.0) == inf
    assert watched.watch._noise.count_n == pytest.approx(0.1 * QUANTUM_N)
