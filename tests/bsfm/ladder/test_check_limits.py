"""A ladder near the bounds of what is one: what noise hides, what a saturated cell leaves, whose rows count, how parts join."""

import numpy as np
import pytest

from gateway.bsfm.ladder.check import Expectation, join_ladders
from gateway.bsfm.ladder.ladder_error import LadderError, LadderFlaw
from tests.bsfm.ladder.test_check import REFERENCE, Table, check_table, recorded, refuse_table, stairs, with_force

ROWS_A_STAIR, STAIRS_UP = 20, 21


def noise_n(size: int, sigma_n: float) -> np.ndarray:
    return np.random.default_rng(5).normal(0.0, sigma_n, size)


def test_a_force_that_is_noise_alone_is_not_called_a_model() -> None:
    """Means of a dwell spread by more than a newton where one reading spreads by more than two."""
    error = refuse_table(with_force(lambda force: 2.0 + noise_n(len(force), 3.0)))
    assert error.flaw is LadderFlaw.FORCE_CONSTANT


def test_where_the_cell_ends_is_known_a_noisy_stop_is_one() -> None:
    """No two stairs agree to a count there."""
    table = with_force(lambda force: np.minimum(force, 52.0) + noise_n(len(force), 0.3))
    known = Expectation(reference=REFERENCE, named="1", saturation_n=52.0)
    checked = check_table(table, known)
    assert checked.ladder.voltage_v.max() <= 6.4 and not checked.closed
    assert check_table(recorded(stairs())).closed, "and where it never was at its end"


@pytest.mark.parametrize("other", [lambda force: 1000.0 * force + 100.0, lambda force: force + 500.0])
def test_a_force_that_is_beyond_the_cell_on_every_stair_is_of_another_unit_or_zero(other) -> None:
    known = Expectation(reference=REFERENCE, named="1", saturation_n=98.0, force_unit="N")
    with pytest.raises(LadderError, match="load cell ends at 98 N: another unit, zero or cell") as refused:
        check_table(with_force(other), known)
    assert refused.value.flaw is LadderFlaw.SATURATED


def test_a_force_that_still_moves_at_the_end_of_its_stairs_is_told() -> None:
    checked = check_table(recorded(stairs(), dwell_s=0.12, noise_n=0.01))
    assert any("dwells too short" in note for note in checked.notes)


def test_a_force_that_dips_on_the_way_down_has_no_inverse_either() -> None:
    table = recorded(stairs())
    stair = np.arange(len(table["force_n"])) // ROWS_A_STAIR % (2 * (STAIRS_UP - 1))
    dip = (stair >= STAIRS_UP) & (table["command_v"] > 4.0) & (table["command_v"] < 5.5)
    error = refuse_table(table | {"force_n": np.where(dip, table["force_n"] - 12.0, table["force_n"])})
    assert error.flaw is LadderFlaw.NOT_INCREASING and "on the way down" in str(error)
    assert "contact or air lost on the way" in str(error), "what a ladder cannot see of itself"


@pytest.mark.parametrize(("share", "is_taken"), [(0.017, True), (0.023, False)])
def test_a_stair_may_lie_below_the_one_before_by_a_fiftieth_of_the_range(share: float, is_taken: bool) -> None:
    table = recorded(stairs())
    force_n, rows = table["force_n"].copy(), np.arange(len(table["force_n"]))
    is_up = rows // ROWS_A_STAIR % (2 * (STAIRS_UP - 1)) < STAIRS_UP
    before, dips = (is_up & np.isclose(table["command_v"], volts) for volts in (4.8, 5.2))
    has_settled = rows % ROWS_A_STAIR >= ROWS_A_STAIR // 2
    rise_n = np.mean(force_n[dips & has_settled]) - np.mean(force_n[before & has_settled])
    force_n[dips] -= rise_n + share * np.ptp(force_n)
    if is_taken:
        check_table(table | {"force_n": force_n})
    else:
        assert refuse_table(table | {"force_n": force_n}).flaw is LadderFlaw.NOT_INCREASING


def test_steps_that_the_noise_hides_are_not_called_a_slipping_tool() -> None:
    error = refuse_table(with_force(lambda force: force + noise_n(len(force), 6.0)))
    assert error.flaw is LadderFlaw.NOT_INCREASING and "which may hide the steps" in str(error)


def test_groups_of_several_parts_stay_apart() -> None:
    """A fit leaves them out one at a time, and two under one number would be one."""
    first, second = check_table(recorded(stairs(2))), check_table(recorded(stairs(3), seed=2))
    whole = join_ladders([first, second])
    assert whole.ladder.groups == (0, 1, 2, 3, 4) and len(whole.ladder) == 5 * 41
    assert np.array_equal(whole.ladder.force_n[: 2 * 41], first.ladder.force_n)


def test_one_part_without_its_top_leaves_the_whole_without_it() -> None:
    cut, whole = check_table(with_force(lambda force: np.minimum(force, 52.0))), check_table(recorded(stairs(2)))
    assert (cut.closed, whole.closed) == (False, True)
    assert [join_ladders(parts).closed for parts in ([cut, whole], [whole, cut], [whole, whole])] == [
        False,
        False,
        True,
    ]


def spoiled(table: Table, rows: list[int], value_n: float) -> Table:
    force_n = table["force_n"].copy()
    force_n[rows] = value_n
    return table | {"force_n": force_n}


def test_an_overloaded_reading_is_left_out_and_so_is_one_that_is_late() -> None:
    """Each would carry its stair away, for it stands in the part that is averaged."""
    table, last = recorded(stairs()), 10 * ROWS_A_STAIR - 2
    sound = check_table(table).ladder.force_n
    quality = np.zeros(len(table["time_s"]))
    quality[last] = 2.0
    overloaded = check_table(spoiled(table, [last], 90.0) | {"quality": quality})
    time_s = table["time_s"].copy()
    time_s[last] = time_s[last - 5]
    late = check_table(spoiled(table, [last], 90.0) | {"time_s": time_s})
    for checked, words in ((overloaded, "with the load cell overloaded"), (late, "does not advance")):
        assert checked.ladder.force_n == pytest.approx(sound, abs=0.5)
        assert words in checked.notes[0]


def test_a_command_below_zero_is_none() -> None:
    table = recorded(stairs())
    error = refuse_table(table | {"command_v": table["command_v"] - 2.0})
    assert error.flaw is LadderFlaw.COLUMNS


def test_rows_of_our_own_run_that_have_no_number_take_no_other_row_s_stair() -> None:
    """Labels are of rows: without the rows in front of them that are left out they would be a stair further down."""
    table = recorded(stairs(2))
    stair = np.arange(len(table["time_s"])) // ROWS_A_STAIR
    last = stair == stair.max()
    group = np.where(last, -1, stair // (2 * STAIRS_UP - 1))
    table |= {"phase": np.where(last, 5, 3), "group": group, "stair": stair}
    table = {name: column.astype(float) for name, column in table.items()}
    whole = check_table(table).ladder
    for first, count in ((0, 15), (405, 4)):
        gaps = {name: column.copy() for name, column in table.items()}
        gaps["force_n"][first : first + count] = np.nan
        assert check_table(gaps).ladder.force_n == pytest.approx(whole.force_n, abs=0.2)
        assert list(check_table(gaps).ladder.group) == list(whole.group)


@pytest.mark.parametrize("force_n", [1e300, -1e200, 1e61])
def test_a_force_that_no_square_can_hold_is_no_number(force_n: float) -> None:
    """`fit` of such a table ended with an internal error: no order was better than another."""
    error = refuse_table(with_force(lambda force: np.where(force > 10.0, force_n, force)))
    assert error.flaw is LadderFlaw.NOT_FINITE
