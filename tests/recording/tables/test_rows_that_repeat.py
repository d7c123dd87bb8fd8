"""Readings that repeat: written again, or resting, coarse, or equal by chance; and how rare what is not good must be."""

import numpy as np
import pytest

from gateway.recording.tables.row_validity import flag_repeated, valid_by_quality


@pytest.mark.parametrize(("others", "kept"), [(20, 80), (21, 100)])
def test_a_fifth_may_be_less_than_good_and_more_is_what_is_usual(others: int, kept: int) -> None:
    column = np.concatenate([np.ones(100 - others), np.zeros(others)])
    assert int(valid_by_quality(column, False)[0].sum()) == kept


def moving(rows: int, count_n: float, repeat_every: int = 0, seed: int = 1) -> np.ndarray:
    """A noisy force in whole counts of a display, in which every so many rows a reading is written again."""
    rng = np.random.default_rng(seed)
    force_n = np.round((20.0 + 3.0 * np.sin(np.arange(rows) / 40.0) + rng.normal(0.0, 0.05, rows)) / count_n) * count_n
    if repeat_every:
        force_n[repeat_every::repeat_every] = force_n[repeat_every - 1 : -1 : repeat_every]
    return force_n


@pytest.mark.parametrize("count_n", [1e-4, 0.01, 0.03, 0.1])
@pytest.mark.parametrize("seed", range(5))
def test_what_a_coarse_display_repeats_by_itself_is_no_reading_written_again(count_n: float, seed: int) -> None:
    flags, notes = flag_repeated(moving(4000, count_n, seed=seed))
    assert not flags.any() and notes == []


@pytest.mark.parametrize("count_n", [0.01, 0.02])
def test_readings_that_are_written_again_stand_out_of_a_display_that_repeats_some(count_n: float) -> None:
    flags, _ = flag_repeated(moving(4000, count_n, repeat_every=3))
    assert flags.mean() > 0.25


def test_a_force_that_rests_at_0_or_at_an_end_of_its_range_repeats_by_itself() -> None:
    force_n = moving(4000, 1e-4)
    force_n[1000:1400], force_n[2000:2400], force_n[3000:3400] = 0.0, 60.0, -5.0
    assert not flag_repeated(force_n)[0].any()


def test_a_few_that_are_equal_by_chance_are_none() -> None:
    force_n = moving(4000, 1e-4)
    for row in range(500, 3700, 400):
        force_n[row] = force_n[row - 1]
    assert not flag_repeated(force_n)[0].any(), "eight of four thousand"
    for row in range(300, 3900, 60):
        force_n[row] = force_n[row - 1]
    assert 55 < flag_repeated(force_n)[0].sum() < 75


def test_a_force_that_stands_on_few_levels_repeats_by_itself() -> None:
    """Steps that are too few, or all of one count, tell nothing of the resolution."""
    held = np.repeat([1.0, 2.0, 3.0, 4.0, 5.0, 4.0, 3.0, 2.0], 50)
    creeping = 20.0 + 0.01 * np.repeat(np.tile([0, 1, 2, 3, 2, 1], 20), 5)
    for force_n in (held, creeping):
        flags, notes = flag_repeated(force_n)
        assert not flags.any() and notes == []
