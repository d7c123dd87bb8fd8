"""Which rows may be judged: by what a quality column means, by readings that were renewed, by times that can be believed."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gateway.recording import Recording, RecordingError, read_table
from gateway.recording.foreign.time_stamps import parse_stamp, seconds_from_stamps
from gateway.recording.measurement import measurement_of
from gateway.recording.tables.row_validity import Floats, flag_clipped, flag_repeated, valid_by_quality
from gateway.recording.tables.time_axis import check_time_axis
from tests.recording.test_measurement_of import TIME_S, N, columns, measured


def quality(*counts: tuple[float, int]) -> np.ndarray:
    return np.concatenate([np.full(count, value) for value, count in counts])


@pytest.mark.parametrize(
    ("column", "is_ours", "valid", "words"),
    [
        (quality((0.0, 50), (1.0, 40), (2.0, 10)), True, 90, "10 rows are not judged: overload or unknown"),
        (quality((0.0, 5), (1.0, 95)), True, 100, ""),
        (quality((0.0, 5), (1.0, 95)), False, 95, "5 rows are not judged: quality is not 1"),
        (quality((0.0, 95), (1.0, 5)), False, 95, "5 rows are not judged: quality is not 0"),
        (quality((192.0, 90), (0.0, 10)), False, 90, "10 rows are not judged: quality is not 192"),
        (quality((192.0, 70), (24.0, 30)), False, 70, "30 rows are not judged: quality is below 192"),
        (quality((192.0, 70), (0.0, 30)), False, 70, "30 rows are not judged: quality is below 192"),
        (quality((192.0, 60), (216.0, 15), (24.0, 25)), False, 75, "25 rows are not judged: quality is below 192"),
        (quality((192.0, 70), (64.0, 30)), False, 70, "30 rows are not judged: quality is below 192"),
        (quality((100.0, 60), (90.0, 40)), False, 100, "what quality means by a good reading is not clear"),
        (quality((192.0, 60), (300.0, 40)), False, 100, "what quality means by a good reading is not clear"),
        (quality((0.0, 60), (1.0, 30), (2.0, 10)), False, 90, "10 rows are not judged: overload or unknown"),
        (quality((0.0, 50), (1.0, 50)), False, 100, ""),
        (quality((0.0, 98), (np.nan, 2)), True, 98, "2 rows are not judged: overload or unknown"),
        (quality((np.nan, 10)), False, 10, "quality holds no numbers and was not used"),
        (np.arange(20.0) % 9, False, 20, "quality takes 9 values: no flag"),
        (np.tile(np.append(np.zeros(93), np.arange(1.0, 8.0)), 1), False, 93, "7 rows are not judged"),
    ],
)
def test_what_a_quality_column_means_is_told_by_whose_it_is_and_by_what_is_usual(
    column: np.ndarray, is_ours: bool, valid: int, words: str
) -> None:
    flags, notes = valid_by_quality(column, is_ours)
    assert int(flags.sum()) == valid
    assert notes == [] if not words else words in notes[0]


def walk(rows: int, sigma: float, seed: int = 1) -> np.ndarray:
    """A force in counts of 0.1 N that moves by some of them from row to row, from 20 N on."""
    steps = np.round(np.random.default_rng(seed).normal(0.0, sigma, rows))
    return 20.0 + 0.1 * np.cumsum(steps)


def logged_twice(force_n: np.ndarray, every: int) -> np.ndarray:
    force_n = force_n.copy()
    force_n[every::every] = force_n[every - 1 :: every][: force_n[every::every].size]
    return force_n


@pytest.mark.parametrize("sigma", [1.2, 20.0])
def test_readings_that_were_logged_twice_are_found_and_those_of_a_coarse_converter_are_not(sigma: float) -> None:
    force_n = walk(4000, sigma)
    assert not flag_repeated(force_n)[0].any()
    flags, notes = flag_repeated(logged_twice(force_n, 3))
    assert flags.sum() > 1000 and "logged twice, or not renewed" in notes[0]
    assert np.flatnonzero(flags)[0] > 0


@pytest.mark.parametrize("force_n", [np.zeros(0), np.ones(1), np.full(100, np.nan), np.full(100, 5.0)])
def test_a_force_that_does_not_move_repeats_itself_by_right(force_n: np.ndarray) -> None:
    flags, notes = flag_repeated(force_n)
    assert flags.size == force_n.size and not flags.any() and notes == []


def test_two_or_three_equal_readings_are_chance() -> None:
    force_n = np.random.default_rng(2).normal(20.0, 1.0, 400)
    force_n[100:102] = force_n[99]
    assert not flag_repeated(force_n)[0].any()


def timed(*stamps_s: float) -> Recording:
    columns = {"time_s": np.array(stamps_s)}
    return Recording(
        Path("a.csv"), {}, columns, len(stamps_s), False, (), lines=range(2, 2 + len(stamps_s)), suggestion=""
    )


def test_of_rows_with_one_stamp_the_last_stays_and_rounding_is_no_way_back() -> None:
    axis = check_time_axis(timed(0.0, 0.1, 0.1, 0.2 + 5e-10, 0.2, 0.3))
    assert axis.kept.tolist() == [0, 2, 4, 5]
    assert "2 rows repeat the time stamp before" in axis.notes[0]
    with pytest.raises(RecordingError, match="time runs backwards"):
        check_time_axis(timed(0.0, 0.1, 0.1 - 1e-6, 0.2))


@pytest.mark.parametrize(("unknown", "is_refused"), [(2, False), (3, True)])
def test_a_fifth_of_the_times_may_be_unknown(unknown: int, is_refused: bool) -> None:
    recording = timed(*[np.nan] * unknown, *(0.1 * k for k in range(10 - unknown)))
    if is_refused:
        with pytest.raises(RecordingError, match="not a time"):
            check_time_axis(recording)
    else:
        assert f"{unknown} rows without a time" in check_time_axis(recording).notes[0]


@pytest.mark.parametrize(("step_s", "unit"), [(2.0, "ms"), (999.0, "ms"), (1000.0, "us"), (1.0e6, "ns")])
def test_rows_that_are_too_far_apart_are_refused_with_the_unit_that_they_look_like(step_s: float, unit: str) -> None:
    with pytest.raises(RecordingError, match=rf"Are the times in {unit}\?"):
        check_time_axis(timed(*(step_s * k for k in range(10))))


@pytest.mark.parametrize(("step_s", "is_asked"), [(0.9, False), (1.0, True), (1.9, True)])
def test_rows_of_a_second_are_asked_for_their_unit(step_s: float, is_asked: bool) -> None:
    notes = check_time_axis(timed(*(step_s * k for k in range(10)))).notes
    assert any("are the times in ms?" in note for note in notes) is is_asked


def test_behind_a_gap_half_a_second_is_not_judged() -> None:
    times_s = np.concatenate([0.01 * np.arange(100), 2.0 + 0.01 * np.arange(100)])
    axis = check_time_axis(timed(*times_s))
    assert np.flatnonzero(axis.after_gap).tolist() == list(range(100, 150))
    late = replace(timed(*times_s), columns={"time_s": np.where(times_s < 1.0, times_s, times_s - 0.95)})
    assert not check_time_axis(late).after_gap.any(), "a pause of less than ten rows is none"


def test_behind_a_standstill_of_the_gateway_half_a_second_is_not_judged_and_it_is_named() -> None:
    """What was sent meanwhile came late; another logger's rows tell nothing of that."""
    times_s = np.concatenate([0.01 * np.arange(100), 1.06 + 0.01 * np.arange(100)])
    theirs = timed(*times_s)
    ours = replace(theirs, columns=theirs.columns | {name: np.zeros(200) for name in ("sent_v", "sent_age_s")})
    assert not check_time_axis(theirs).after_gap.any()
    axis = check_time_axis(ours)
    assert np.flatnonzero(axis.after_gap).tolist() == list(range(100, 150))
    assert "the gateway's machine stood still" in axis.notes[0]


def test_gaps_are_told_with_their_number_length_and_place() -> None:
    times_s = np.concatenate([0.01 * np.arange(100), 2.0 + 0.01 * np.arange(100), 9.0 + 0.01 * np.arange(100)])
    (note,) = check_time_axis(timed(*times_s)).notes
    assert note.startswith("2 gaps in time (the longest 6.01 s, at 0.990 s the first): 100 rows up to 0.5 s")


@pytest.mark.parametrize("leap_s", [7300.0, 86_400.0, 1.79e9], ids=["two hours", "a day", "from 1970"])
def test_a_clock_that_leaps_ahead_is_refused_where_it_does(leap_s: float) -> None:
    """A logger without a clock of its own begins in 1970: simulated over the leap the same force was off by 16 N."""
    times_s = np.concatenate([0.01 * np.arange(100), leap_s + 0.01 * np.arange(100)])
    with pytest.raises(RecordingError, match=r"column time_s: \d+ h after the row before \(1 time in"):
        check_time_axis(timed(*times_s))


@pytest.mark.parametrize(("back_s", "clock"), [(3599.99, "went from summer time to winter time"), (7200.0, "was set")])
def test_a_clock_that_goes_back_by_an_hour_is_asked_for_its_season(back_s: float, clock: str) -> None:
    with pytest.raises(RecordingError, match=rf"time runs backwards .* a clock that {clock}, or the wrong column"):
        check_time_axis(timed(*(4000.0 + 0.01 * np.arange(9)), *(4000.09 - back_s + 0.01 * np.arange(9))))


def test_a_pause_of_an_hour_is_a_gap() -> None:
    assert check_time_axis(timed(*(0.01 * np.arange(100)), *(3600.0 + 0.01 * np.arange(100)))).after_gap.sum() == 50


def test_one_row_and_none_have_a_time_axis_too() -> None:
    assert check_time_axis(timed(7.0)).time_s.tolist() == [0.0]
    assert check_time_axis(timed()).time_s.size == 0
    assert check_time_axis(timed(7.0, 8.5)).time_s.tolist() == [0.0, 1.5]


@pytest.mark.parametrize(
    "stamp", ["2026-01-01T12:00:00+02:00", "2026-01-01T05:30:00-04:30", "2026-01-01 10:00:00", "2026-01-01T10:00:00Z"]
)
def test_the_zone_of_a_stamp_counts_either_way(stamp: str) -> None:
    assert parse_stamp(stamp) == parse_stamp("2026-01-01T10:00:00.000")


@pytest.mark.parametrize("cell", ["12.5", "-", "1e-3", "2026-13-45T10:00:00", "noon", ""])
def test_what_is_no_stamp_is_none(cell: str) -> None:
    assert parse_stamp(cell) is None


def test_clocks_that_pass_midnight_go_on_and_stamps_that_nobody_knows_stay_unknown() -> None:
    clocks = np.array([parse_stamp(clock) for clock in ("23:59:59.5", "00:00:00.5", "00:00:01.5")], dtype=float)
    assert np.diff(seconds_from_stamps(clocks)) == pytest.approx([1.0, 1.0])
    twice = np.array([parse_stamp(clock) for clock in ("20:00:00", "04:00:00", "12:00:00") * 2], dtype=float)
    assert np.diff(seconds_from_stamps(twice)) == pytest.approx(8.0 * 3600.0), "two nights"
    set_back = np.array([parse_stamp(clock) for clock in ("12:00:02", "12:00:01", "12:00:03")], dtype=float)
    assert np.diff(seconds_from_stamps(set_back)) == pytest.approx([-1.0, 2.0]), "a clock that was set back is no night"
    assert np.isnan(seconds_from_stamps(np.full(3, np.nan))).all()


def held_readings(rng: np.random.Generator) -> Floats:
    """Thirty levels of 0 to 40 N, 40 readings each, with a noise of 0.1 N."""
    return np.repeat(rng.uniform(0.0, 40.0, 30), 40) + rng.normal(0.0, 0.1, 1200)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_readings_at_the_end_of_the_cell_s_range_are_no_witness(side: float) -> None:
    """A cell that ended at 30 N was given a supply that saturates and outliers, of confidence 0.99, and a noise of 0 N."""
    force_n = side * np.minimum(held_readings(np.random.default_rng(3)), 30.0)
    usable = np.ones(force_n.size, dtype=bool)
    usable[:40] = False
    clipped, notes = flag_clipped(force_n, usable)
    assert np.array_equal(clipped, usable & (force_n == side * 30.0)) and clipped.sum() > 40
    assert len(notes) == 1 and f"stand at {side * 30.0:.5g} N" in notes[0]


@pytest.mark.parametrize(
    "made_n",
    [
        pytest.param(lambda force_n: force_n, id="as it is"),
        pytest.param(lambda force_n: np.round(np.minimum(force_n, 30.0) / 0.5) * 0.5, id="coarser than its noise"),
        pytest.param(lambda force_n: np.where(np.arange(1200) // 100 == 5, 50.0, force_n), id="frozen for a while"),
        pytest.param(lambda force_n: np.zeros(force_n.size), id="dead"),
        pytest.param(lambda force_n: 30.0 * (np.arange(force_n.size) // 200 % 2), id="two levels, which tell no step"),
    ],
)
def test_readings_that_rest_at_the_largest_for_another_reason_are_kept(made_n: Callable[[Floats], Floats]) -> None:
    force_n = made_n(held_readings(np.random.default_rng(4)))
    clipped, notes = flag_clipped(force_n, np.ones(force_n.size, dtype=bool))
    assert not clipped.any() and notes == []


def test_what_a_column_of_quality_calls_good_may_still_be_no_witness() -> None:
    """Of rows without a force, and of those behind a gap, a logger may say that all is well."""
    gap_s = np.where(TIME_S >= 2.0, 0.2, 0.0)
    force_n = columns()["force_n"]
    force_n[7] = np.nan
    found = measured(time_s=TIME_S + gap_s, force_n=force_n, quality=np.zeros(N))
    assert np.flatnonzero(~found.usable).tolist() == [7, *range(400, 500)]


@pytest.mark.sampled
@pytest.mark.parametrize("good", ["ok", "Good", "VALID"])
@pytest.mark.parametrize("bad", ["bad", "Invalid", "OVERLOAD"])
def test_a_reading_that_its_logger_calls_bad_in_whatever_word_is_no_witness(
    tmp_path: Path, good: str, bad: str
) -> None:
    """Half of them are: a rare value would be left out whatever it is called."""
    words = [bad if row % 2 else good for row in range(N)]
    rows = zip(TIME_S, columns()["command_v"], columns()["force_n"], words, strict=True)
    table = tmp_path / "told.csv"
    table.write_text("time_s,command_v,force_n,quality\n" + "\n".join(",".join(map(str, row)) for row in rows))
    assert measurement_of(read_table(table)).usable.tolist() == [word == good for word in words]


def test_a_position_with_a_hole_is_in_metres_too() -> None:
    position_mm = 10.0 + 5.0 * np.sin(TIME_S)
    position_mm[7] = np.nan
    found = measured(position_mm=position_mm).position_m
    assert found is not None and np.nanmax(np.abs(found - 1.0e-3 * position_mm)) < 1.0e-12
    assert found[7] == pytest.approx(1.0e-3 * (10.0 + 5.0 * np.sin(TIME_S[7])), rel=1.0e-4)


def test_a_leap_of_the_clock_is_at_the_row_behind_it() -> None:
    times_s = np.arange(60) * 0.01
    times_s[40:] += 86_400.0
    table = Recording(Path("a.csv"), {}, {"time_s": times_s}, 60, False, lines=range(2, 62))
    with pytest.raises(RecordingError, match=r"^a\.csv:42, column time_s: 24 h after the row before"):
        check_time_axis(table)
