"""What the push gate leaves to the long run: what is marked `long`, of a `sampled` table two cases in three, and as much of
what a search draws."""

from collections.abc import Iterable, Iterator
from typing import Any, Final
from zlib import crc32

import hypothesis
import pytest

SAMPLED: Final = 3
"""Of so many cases of a table, or examples of a law, one is run in the push gate."""


def examples(count: int) -> int:
    """Return how many examples hypothesis draws: so many in a long run, one in three of them in the push gate."""
    is_push = hypothesis.settings.default is not None and hypothesis.settings.default.derandomize
    return -(-count // SAMPLED) if is_push else count


def scenes(count: int, budget: int) -> int:
    """Return how many scenes a drawn search plays: one in three of count in the push gate, budget times count in a long run."""
    return count * budget if budget > 1 else -(-count // SAMPLED)


def striped(rows: Iterable[Any], columns: Iterable[Any]) -> list[Any]:
    """Return each of rows beside each of columns, as parameters of a test, of which a push runs every third diagonal: each row
    with some columns, and each column with some rows."""
    cells = [(row, column, (i + k) % SAMPLED == 1) for i, row in enumerate(rows) for k, column in enumerate(columns)]
    return [pytest.param(row, column, marks=() if is_run else pytest.mark.long) for row, column, is_run in cells]


def leave_out_long(items: list[pytest.Item], *, in_silence: bool) -> None:
    """Skip what needs the bigger budget. in_silence: drop it, for to skip a test takes as long as a short one runs."""
    skip = pytest.mark.skip(reason="needs the bigger budget: ./tools/test --long")
    long = [item for item in items if "long" in item.keywords] + list(beyond_samples(items))
    for item in long:
        item.add_marker(skip)
    if in_silence:
        left_out = set(long)
        items[:] = [item for item in items if item not in left_out]


def beyond_samples(items: list[pytest.Item]) -> Iterator[pytest.Item]:
    """Return what the push gate leaves out of `sampled` tables: always the same cases, drawn by their names' checksums, since
    neighbours in a table are much alike."""
    tables: dict[str, list[pytest.Item]] = {}
    for item in items:
        if "sampled" in item.keywords:
            tables.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for cases in tables.values():
        cases.sort(key=lambda case: crc32(case.nodeid.encode()))
        yield from cases[-(-len(cases) // SAMPLED) :]
