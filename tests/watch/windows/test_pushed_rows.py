"""The ring holds pulls, too, for those who draw them; the watch, whose plant pushes, judges as if they were not there."""

from typing import Any

import numpy as np

from gateway.service.running_rig.recording.recorded_row import COLUMNS
from gateway.watch.pushed_rows import pushed_rows
from gateway.watch.window import Window, window_of
from tests.watch.windows.test_window import run_of, steps

Rows = dict[str, "np.ndarray[Any, np.dtype[np.float64]]"]


def ring_of(rows: Rows) -> bytes:
    return np.column_stack([rows[name] for name in COLUMNS]).astype("<f8").tobytes()


def run_with_a_pull(from_s: float, to_s: float) -> Rows:
    rows = run_of(130.0, steps, pulling=lambda at_s: from_s <= at_s < to_s)
    rows["force_n"] = np.where(rows["pulling"] == 1.0, -rows["force_n"], rows["force_n"])
    return rows


def test_a_pull_at_the_end_leaves_the_window_before_it() -> None:
    pushed, pulled = run_of(120.0, steps), run_with_a_pull(120.0, 130.0)
    before, behind = (window_of(ring_of(rows), COLUMNS, 20.0) for rows in (pushed, pulled))
    assert isinstance(before, Window) and isinstance(behind, Window)
    assert behind.end_s == before.end_s
    assert np.all(behind.measurement.force_n > -1.0)


def test_behind_a_pull_the_watch_begins_anew_as_behind_any_gap() -> None:
    assert window_of(ring_of(run_with_a_pull(100.0, 120.0)), COLUMNS, 20.0) == "the run is younger than the window"


def test_a_ring_of_pulls_alone_is_an_empty_one() -> None:
    assert pushed_rows(ring_of(run_with_a_pull(0.0, 130.0)), COLUMNS)["time_s"].size == 0
    assert pushed_rows(b"", COLUMNS)["time_s"].size == 0
