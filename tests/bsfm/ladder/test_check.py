"""What makes a ladder one, judged from the data: each flaw is refused or repaired, with a sentence that says which."""

from collections.abc import Callable

import numpy as np
import pytest

from gateway.bsfm import Branches, Bsfm, LinearBlend, RationalBezier
from gateway.bsfm.ladder.check import CheckedLadder, Expectation, check_ladder, join_ladders
from gateway.bsfm.ladder.ladder_error import LadderError, LadderFlaw
from gateway.bsfm.ladder.measured_ladder import FALLING, RISING
from gateway.bsfm.ladder.rows import _far_forces

TOP_V, STEP_V, NEWTON_PER_VOLT = 8.0, 0.4, 8.0
Table = dict[str, np.ndarray]
REFERENCE = Bsfm(
    Branches(RationalBezier(0, 8, (0, 20, 64), (1, 1, 1)), RationalBezier(0, 8, (0, 44, 64), (1, 1, 1))),
    LinearBlend(8.0),
)
KNOWN = Expectation(reference=REFERENCE, named="1 (made up)")
ON_DEMO = {"rig": "demo"}


def stairs(groups: int = 3) -> list[float]:
    up = np.arange(0.0, TOP_V + 1e-9, STEP_V).tolist()
    return (up + up[-2::-1]) * groups


def recorded(
    voltages: list[float], dwell_s: float = 0.4, noise_n: float = 0.1, seed: int = 1, friction_n: float = 1.5
) -> Table:
    """50 Hz rows of a loop with friction that answers with a lag; a row's force is read before its command acts."""
    rng, rows, felt_v, force_n, time_s = np.random.default_rng(seed), [], 0.0, 0.0, 0.0
    for volts in [*voltages, voltages[-1]]:
        for _ in range(round(dwell_s / 0.02)):
            rows.append((time_s, volts, force_n + rng.normal(0.0, noise_n)))
            time_s += 0.02
            felt_v += (volts - felt_v) * 0.3
            thrust_n = NEWTON_PER_VOLT * felt_v
            force_n = float(np.clip(force_n, thrust_n - friction_n, thrust_n + friction_n))
    return dict(zip(("time_s", "command_v", "force_n"), np.array(rows).T.copy(), strict=True))


def check_table(table: Table, expected: Expectation = KNOWN, **facts: str) -> CheckedLadder:
    return check_ladder(table, ON_DEMO | facts, expected)


def refuse_table(table: Table, expected: Expectation = KNOWN, **facts: str) -> LadderError:
    with pytest.raises(LadderError) as caught:
        check_table(table, expected, **facts)
    return caught.value


def test_a_clean_ladder_passes_without_a_word_and_each_stair_is_one_point() -> None:
    checked = check_table(recorded(stairs()))
    assert checked.notes == ()
    assert checked.ladder.groups == (0, 1, 2)
    assert len(checked.ladder) == 3 * 41
    assert (checked.ladder.direction == RISING).sum() == 3 * 21
    assert checked.noise_n == pytest.approx(0.1, rel=0.1)
    middle = np.isclose(checked.ladder.voltage_v, 4.0)
    assert checked.ladder.force_n[middle & (checked.ladder.direction == RISING)] == pytest.approx(30.5, abs=0.2)
    assert checked.ladder.force_n[middle & (checked.ladder.direction == FALLING)] == pytest.approx(33.5, abs=0.2)


def test_partial_reversals_after_the_last_group_are_the_minor_loop_part() -> None:
    walk = [0.8 * k for k in range(1, 9)] + [5.2, 4.0, 2.8, 3.6, 4.4, 3.2, 2.0, 1.0]
    checked = check_table(recorded(stairs() + walk))
    assert len(checked.ladder) == 3 * 41
    assert checked.minor_v == pytest.approx([0.0, *walk])


def test_a_coarse_cycle_before_the_ladder_is_left_out_and_said() -> None:
    checked = check_table(recorded([0.0, 2.0, 4.0, 6.0, 8.0, 6.0, 4.0, 2.0, 0.0, *stairs()]))
    assert checked.ladder.groups == (0, 1, 2)
    assert "settled the friction" in checked.notes[0]


def test_a_resumed_reversal_part_adds_its_walk_and_no_group() -> None:
    cycle, walk = [0.0, 2.0, 4.0, 6.0, 8.0, 6.0, 4.0, 2.0, 0.0], [2.8, 5.6, 4.0, 2.0, 3.6, 4.8, 3.2, 1.0]
    rest = check_ladder(recorded(cycle + walk), ON_DEMO | {"ladder": {"first_group": 2, "groups": 2}}, KNOWN)
    assert rest.only_walk
    whole = join_ladders([check_table(recorded(stairs(2))), rest])
    assert whole.ladder.groups == (0, 1)
    assert len(whole.ladder) == 2 * 41, "the coarse cycle is no group"
    assert whole.minor_v == pytest.approx([0.0, *walk])
    with pytest.raises(LadderError, match="must lie beside it"):
        join_ladders([rest])


def test_one_row_per_stair_is_paired_by_its_turns_whichever_row_the_force_stands_in() -> None:
    dwelt = check_table(recorded(stairs(), noise_n=0.0)).ladder
    table = {
        "time_s": np.arange(len(dwelt)) * 1.0,
        "command_v": dwelt.voltage_v.copy(),
        "force_n": dwelt.force_n.copy(),
    }
    own = check_table(table)
    late = check_table({name: np.append(values, values[-1]) for name, values in table.items()} | {
        "time_s": np.arange(len(dwelt) + 1) * 1.0,
        "force_n": np.append(0.0, dwelt.force_n),
    })  # fmt: skip
    for checked, words in ((own, "its own row"), (late, "the row before")):
        assert any(words in note for note in checked.notes)
        assert np.array_equal(checked.ladder.voltage_v, dwelt.voltage_v)
        assert np.array_equal(checked.ladder.force_n, dwelt.force_n)


def with_force(change: Callable[[np.ndarray], np.ndarray]) -> Table:
    table = recorded(stairs())
    return table | {"force_n": change(table["force_n"])}


def test_three_samples_are_no_ladder() -> None:
    error = refuse_table({name: values[:3] for name, values in recorded(stairs()).items()})
    assert error.flaw is LadderFlaw.TOO_SHORT
    assert "3 rows" in str(error)


def test_one_direction_only_is_refused() -> None:
    error = refuse_table(recorded(stairs(1)[:21]))
    assert error.flaw is LadderFlaw.ONE_DIRECTION
    assert "20 rising and 0 falling" in str(error)


def test_constant_force_is_not_called_a_model() -> None:
    error = refuse_table(with_force(lambda force: np.full_like(force, 2.0)))
    assert error.flaw is LadderFlaw.FORCE_CONSTANT
    assert "no air, no contact, or a dead load cell" in str(error)


def test_constant_command_is_refused() -> None:
    table = recorded(stairs())
    assert refuse_table(table | {"command_v": np.full_like(table["force_n"], 3.0)}).flaw is LadderFlaw.COMMAND_CONSTANT


def test_swapped_columns_are_named_in_fine_and_in_coarse_tables() -> None:
    table = recorded(stairs())
    fine = refuse_table(table | {"command_v": table["force_n"], "force_n": table["command_v"]})
    ladder = check_table(table).ladder
    coarse = refuse_table(
        {"time_s": np.arange(len(ladder)) * 1.0, "command_v": ladder.force_n, "force_n": ladder.voltage_v}
    )
    for error in (fine, coarse):
        assert error.flaw is LadderFlaw.SWAPPED
        assert "change the two names" in str(error)


def test_an_inverted_sign_says_how_to_put_it_right() -> None:
    error = refuse_table(with_force(lambda force: -force))
    assert error.flaw is LadderFlaw.SIGN
    assert "sign: -1" in str(error)


def test_kgf_instead_of_newton_is_seen_against_the_model_and_against_the_pressure() -> None:
    table = with_force(lambda force: force / 9.80665)
    pressure = table["command_v"] * 80.0
    by_model = refuse_table(table)
    by_pressure = refuse_table(table | {"pressure_kpa": pressure}, Expectation(area_mm2=100.0))
    for error in (by_model, by_pressure):
        assert error.flaw is LadderFlaw.UNIT
        assert "kgf" in str(error)


def test_a_unit_that_is_written_down_is_converted_and_said() -> None:
    table = recorded(stairs())
    weight = table["force_n"] / 9.80665
    named = {"time_s": table["time_s"], "command_v": table["command_v"], "force_kgf": weight}
    for checked in (check_table(named), check_table(table | {"force_n": weight}, force_unit="kgf")):
        assert checked.slope_n_per_v == pytest.approx(8.0, rel=0.02)
        assert any("turned into newtons" in note for note in checked.notes)


def test_a_small_cylinder_passes_once_its_unit_is_stated() -> None:
    table = with_force(lambda force: force / 9.80665)
    checked = check_table(table, Expectation(reference=REFERENCE, named="1", force_unit="N"))
    assert "times what calibration 1 has" in checked.notes[0]


def test_a_saturated_cell_costs_its_stairs_only() -> None:
    checked = check_table(with_force(lambda force: np.minimum(force, 52.0)))
    assert checked.ladder.voltage_v.max() == pytest.approx(6.0)
    assert any("saturated" in note and "ends at 6.00 V" in note for note in checked.notes)


def test_a_force_that_friction_holds_on_the_way_down_is_no_saturated_cell() -> None:
    """A dry slide lost the top of its range to `saturated load cell, or no more supply pressure`: 0.5 V of 5 V."""
    checked = check_table(recorded(stairs(), noise_n=0.0, friction_n=6.0))
    top = checked.ladder.force_n > checked.ladder.force_n.max() - 0.02
    assert len(np.unique(checked.ladder.voltage_v[top])) >= 3  # of the way down
    assert (checked.ladder.voltage_v.max(), checked.closed, checked.notes) == (TOP_V, True, ())


def test_a_cell_saturated_for_most_of_the_way_is_refused() -> None:
    assert refuse_table(with_force(lambda force: np.minimum(force, 20.0))).flaw is LadderFlaw.SATURATED


def test_a_group_cut_short_is_left_out_and_alone_it_is_refused() -> None:
    cut = stairs(1)[:30]
    checked = check_table(recorded(stairs(2) + cut))
    assert checked.ladder.groups == (0, 1)
    assert any("cut short" in note for note in checked.notes)
    assert refuse_table(recorded(cut)).flaw is LadderFlaw.CUT_SHORT


def test_rows_without_numbers_are_left_out_with_the_first_one_named() -> None:
    table = recorded(stairs())
    table["force_n"][[40, 41, 300]] = np.nan
    checked = check_table(table)
    assert len(checked.ladder) == 3 * 41
    assert checked.notes == (
        "3 of 2480 rows without a usable number in time, command or force, the first is data row 41: left out",
    )


@pytest.mark.sampled
@pytest.mark.parametrize("value", [-9999.0, 9999.0, -999.25, 1.0e30])
@pytest.mark.parametrize("name", ["force_n", "command_v"])
def test_what_a_logger_writes_for_no_value_is_no_reading(name: str, value: float) -> None:
    """One in the mean of a stair was told as a cell in kgf, as one with its sign inverted, or was a top of 1056 N."""
    clean = recorded(stairs())
    for rows in ([795], [795, 1195, 415], list(range(19, 2400, 160))):
        table = {**clean, name: clean[name].copy()}
        table[name][rows] = value
        checked = check_table(table)
        assert checked.ladder.force_n == pytest.approx(check_table(clean).ladder.force_n, abs=0.1)
        assert f"{len(rows)} of 2480 rows with a " in checked.notes[0]
        assert f"the first is data row {min(rows) + 1}: left out" in checked.notes[0]


def test_what_was_really_pressed_in_a_long_rest_is_no_sentinel() -> None:
    resting = recorded([0.0] * 4000 + stairs())
    assert check_table(resting).notes == ()


def test_what_many_rows_of_one_command_say_is_its_force_and_what_one_says_is_none() -> None:
    def far(*forces_n: float) -> list[int]:
        force_n = np.array(forces_n)
        return np.flatnonzero(_far_forces(np.ones(len(force_n)), force_n, np.isfinite(force_n))).tolist()

    assert far(*[0.1] * 6, *[10.0] * 4) == [], "it came late in the dwell"
    assert far(*[0.1] * 19, 10.0) == [19]


def test_a_table_of_mostly_nothing_is_refused() -> None:
    table = recorded(stairs())
    table["force_n"][::3] = np.nan
    assert refuse_table(table).flaw is LadderFlaw.NOT_FINITE


def test_repeated_and_late_rows_are_left_out() -> None:
    table = {name: np.insert(values, 100, values[90]) for name, values in recorded(stairs()).items()}
    assert "does not advance" in check_table(table).notes[0]


def test_a_force_that_dips_on_the_way_up_has_no_inverse() -> None:
    table = recorded(stairs())
    dip = (table["command_v"] > 4.0) & (table["command_v"] < 5.5)
    error = refuse_table(table | {"force_n": np.where(dip, table["force_n"] - 12.0, table["force_n"])})
    assert error.flaw is LadderFlaw.NOT_INCREASING
    assert "has no inverse" in str(error)


def test_another_rigs_file_is_refused_by_name() -> None:
    error = refuse_table(recorded(stairs()), Expectation(rig="irc5-cell"))
    assert error.flaw is LadderFlaw.OTHER_RIG
    assert "--rig demo" in str(error)


def test_a_ramp_is_not_a_ladder() -> None:
    time_s = np.arange(1000) * 0.01
    volts = 4.0 - 4.0 * np.cos(time_s)
    assert refuse_table({"time_s": time_s, "command_v": volts, "force_n": 8.0 * volts}).flaw is LadderFlaw.NO_STAIRS


def test_missing_columns_are_told_with_those_that_are_there() -> None:
    table = recorded(stairs())
    assert "there: time_s, voltage, force_n" in str(
        refuse_table({"time_s": table["time_s"], "voltage": table["command_v"], "force_n": table["force_n"]})
    )
    assert "no column force_n" in str(refuse_table({"time_s": table["time_s"], "command_v": table["command_v"]}))
