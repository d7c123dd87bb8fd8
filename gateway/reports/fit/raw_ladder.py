"""The recording of a ladder as it came, thinned for a picture: no extreme is lost, and what its rows were made for is named."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.bsfm.fit.projected_problem import Floats
from gateway.bsfm.ladder.labels import CHECK, WALK, Labels
from gateway.bsfm.ladder.ladder_error import LadderError
from gateway.bsfm.ladder.rows import usable_rows

_COLUMNS: Final = 500  # of the picture: each keeps its first, least, greatest and last row
_LADDER: Final = CHECK + 1  # the phase of the groups


@dataclass(frozen=True, slots=True)
class RawLadder:
    """Rows of a ladder's recording. changes: (time, words) where another part of the run begins; sentence: what it is."""

    time_s: list[float]
    command_v: list[float]
    force_n: list[float]
    changes: tuple[tuple[float, str], ...]
    sentence: str


def raw_ladder(columns: Mapping[str, Floats], facts: Mapping[str, object]) -> RawLadder | None:
    """Return the rows to draw; None where the table has none."""
    try:
        rows = usable_rows(columns, facts)
    except LadderError:
        return None
    keep = _extremes(rows.time_s, rows.force_n)
    duration_s = float(rows.time_s[-1] - rows.time_s[0])
    labels = Labels.of(columns)
    changes = () if labels is None else _changes(rows.time_s, labels.part(rows.row))
    count = f"{len(rows.time_s):,}".replace(",", " ")
    return RawLadder(
        rows.time_s[keep].tolist(),
        rows.command_v[keep].tolist(),
        rows.force_n[keep].tolist(),
        changes,
        f"{count} readings in {duration_s:.0f} s, none left out of the extremes that are drawn.",
    )


def _extremes(time_s: Floats, force_n: Floats) -> "np.ndarray[tuple[int], np.dtype[np.int64]]":
    """Rows that a picture needs: of each of its columns the first, the least, the greatest and the last."""
    if len(time_s) <= 4 * _COLUMNS:
        return np.arange(len(time_s), dtype=np.int64)
    column = np.floor((time_s - time_s[0]) / (time_s[-1] - time_s[0]) * _COLUMNS)
    starts = np.flatnonzero(np.diff(column, prepend=-1.0))
    ends = np.append(starts[1:], len(time_s))
    kept = [
        row
        for start, end in zip(starts.tolist(), ends.tolist(), strict=True)
        for row in (start, start + int(force_n[start:end].argmin()), start + int(force_n[start:end].argmax()), end - 1)
    ]
    return np.unique(np.array(kept, dtype=np.int64))


def _changes(time_s: Floats, labels: Labels) -> tuple[tuple[float, str], ...]:
    """Where the groups of the ladder and where the partial reversals begin."""
    found = []
    for phase, words in ((_LADDER, "ladder begins"), (WALK, "reversals begin")):
        rows = np.flatnonzero(labels.phase == phase)
        if rows.size:
            found.append((float(time_s[rows[0]]), words))
    return tuple(found)
