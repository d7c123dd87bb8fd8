"""Whether the plant in use makes the force worse: what is compared, how often it must show, and when a warning ends."""

from pathlib import Path

import numpy as np
import pytest

from gateway.diagnosis.force_error import commanded_force, error_blocks
from gateway.plants.force_reference import ForceReference, keep_reference
from gateway.recording.tables.column_names import DERIVED, PULLING
from gateway.registers.words import State
from gateway.watch.force_watch import ForceWatch, PlantSince

COLUMNS = ("time_s", "setpoint_n", "force_n")
BAND_N = 0.8


def held(begin_s: float, seconds: float, off_n: float) -> np.ndarray:
    """Rows of 20 N that are held so far off."""
    time_s = begin_s + np.arange(0.0, seconds, 0.05)
    return np.column_stack((time_s, np.full(time_s.size, 20.0), np.full(time_s.size, 20.0 + off_n)))


@pytest.fixture
def watch(tmp_path: Path) -> ForceWatch:
    """Plant 3 is in use since 100 s; before, the force was 0.2 N off."""
    rows = dict(zip(COLUMNS, held(0.0, 60.0, 0.2).T, strict=True))
    keep_reference(tmp_path, ForceReference(3, "0001.rec", 0, error_blocks(commanded_force(rows))))
    watch = ForceWatch(tmp_path, BAND_N)
    watch.follow(PlantSince(3, 100.0))
    return watch


def looked(watch: ForceWatch, *parts: np.ndarray) -> str:
    watch.look(np.vstack(parts).tobytes(), COLUMNS)
    return watch.sentence


def test_two_looks_in_a_row_make_a_warning_and_one_ends_it(watch: ForceWatch) -> None:
    worse, as_before = held(100.0, 60.0, 0.9), held(100.0, 60.0, 0.2)
    assert [looked(watch, rows) for rows in (worse, as_before, worse)] == ["", "", ""]
    assert looked(watch, worse).startswith(
        "since plant 3 is in use the force is 0.90 N (rms) off what is commanded, with the rig's own plant it was 0.20 N "
        "(0001.rec): 4.5 times, 95 % interval 4.5 .. 4.5; "
    )
    assert looked(watch, held(200.0, 5.0, 0.2)) != "", "too few rows to compare say nothing"
    assert looked(watch, as_before) == ""


def test_a_change_that_disturbs_nobody_is_none(watch: ForceWatch) -> None:
    assert [looked(watch, held(100.0, 60.0, 0.2 + 0.24 * BAND_N)) for _ in range(3)] == ["", "", ""]


def test_rows_of_before_the_plant_are_no_witness(watch: ForceWatch) -> None:
    assert [looked(watch, held(0.0, 100.0, 5.0), held(100.0, 60.0, 0.2)) for _ in range(3)] == ["", "", ""]


def test_another_plant_is_not_blamed_for_the_one_before(watch: ForceWatch) -> None:
    for _ in range(2):
        looked(watch, held(100.0, 60.0, 0.9))
    watch.follow(PlantSince(4, 170.0))
    assert looked(watch, held(170.0, 60.0, 0.9)) == ""


def test_what_is_long_ago_is_no_witness_either(watch: ForceWatch) -> None:
    """A machine that was repaired must not be called worse for as long as the ring remembers."""
    for _ in range(3):
        assert looked(watch, held(100.0, 120.0, 2.0), held(220.0, 310.0, 0.2)) == ""


def test_what_was_counted_against_one_plant_is_not_held_against_the_next(watch: ForceWatch, tmp_path: Path) -> None:
    assert looked(watch, held(100.0, 60.0, 0.9)) == ""
    rows = dict(zip(COLUMNS, held(0.0, 60.0, 0.2).T, strict=True))
    keep_reference(tmp_path, ForceReference(4, "0001.rec", 0, error_blocks(commanded_force(rows))))
    watch.follow(PlantSince(4, 170.0))
    assert looked(watch, held(170.0, 60.0, 0.9)) == "", "one look is none"
    assert looked(watch, held(170.0, 60.0, 0.9)) != ""


@pytest.mark.parametrize("share", [0.2, 0.3])
def test_a_quarter_of_the_rigs_band_is_what_matters(tmp_path: Path, share: float) -> None:
    """Of a wide band, too: 8 N leave 2 N to nobody's concern."""
    rows = dict(zip(COLUMNS, held(0.0, 60.0, 0.2).T, strict=True))
    keep_reference(tmp_path, ForceReference(3, "0001.rec", 0, error_blocks(commanded_force(rows))))
    wide = ForceWatch(tmp_path, 8.0)
    wide.follow(PlantSince(3, 100.0))
    for _ in range(2):
        looked(wide, held(100.0, 60.0, 0.2 + share * 8.0))
    assert bool(wide.sentence) == (share > 0.25)


def test_a_ring_without_a_row_says_nothing(watch: ForceWatch) -> None:
    watch.look(b"", COLUMNS)
    assert looked(watch, held(100.0, 0.04, 5.0)) == ""


def test_a_pull_is_no_witness_of_a_plant_that_pushes(watch: ForceWatch) -> None:
    """Neither beside what was pushed, nor where the ring holds pulls alone."""
    columns = tuple(dict.fromkeys((*COLUMNS, *DERIVED, PULLING)))

    def look(*parts: tuple[np.ndarray, bool]) -> str:
        rows = np.zeros((sum(len(values) for values, _ in parts), len(columns)))
        rows[:, : len(COLUMNS)] = np.vstack([values for values, _ in parts])
        rows[:, columns.index("state")] = State.HOLDING
        rows[:, columns.index(PULLING)] = np.concatenate([np.full(len(values), pulls) for values, pulls in parts])
        watch.look(rows.tobytes(), columns)
        return watch.sentence

    pushed, pulled, worse = held(100.0, 60.0, 0.2), held(160.0, 60.0, -44.0), held(100.0, 60.0, 0.9)
    for _ in range(2):
        assert look((pulled, True)) == ""
        assert look((pushed, False), (pulled, True)) == ""
    look((worse, False), (pulled, True))
    assert "0.90 N (rms)" in look((worse, False), (pulled, True))
    assert look((pulled, True)) != "", "pulls alone say nothing, nor that it is well again"
