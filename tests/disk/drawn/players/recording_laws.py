"""What recordings must hold after what was told of them; and what a retention may take: what is too old, and as many bytes as
there are too many."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from gateway.profiles.recordings_section import Retention
from gateway.recording import RecordingEntry, read_recording
from gateway.service.running_rig.recording.recorded_row import COLUMNS

_REST = (0.0,) * (len(COLUMNS) - COLUMNS.index("force_n") - 1)

Sizes = dict[str, tuple[int, float]]
"""Bytes and time of the end (s of the epoch), by the file's name."""


def row_of(time_s: float, sample: Any, *_: Any) -> tuple[float, ...]:
    """A row that is known by its number."""
    return (time_s, 1.0, float(sample.number), *_REST)


def marked(folder: Path) -> set[str]:
    """Names of the recordings that have the mark of who keeps them."""
    return {f"{name.removesuffix('.keep')}.fgr" for name in os.listdir(folder) if name.endswith(".keep")}  # noqa: PTH208


def spared(before: Sizes, after: Sizes, limits: Retention, wall_s: float) -> str:
    """Return what has gone and need not, in words; empty for nothing."""
    gone = [name for name in before if name not in after]
    not_old = [name for name in gone if limits.days is None or wall_s - before[name][1] <= limits.days * 86400.0]
    total, most = sum(size for size, _ in after.values()), max((before[name][0] for name in not_old), default=0)
    if not_old and (limits.bytes is None or total + most <= limits.bytes):
        return f"{not_old} went, {total} bytes are left of {limits}"
    return ""


def out_of_turn(before: Sizes, pruned: set[str], protected: set[str]) -> str:
    """Return what was left and is older than what has gone, in words; empty for nothing, and where a clock was set back."""
    times = [before[name][1] for name in sorted(before)]
    older = {name for name in set(before) - pruned - protected if name < max(pruned, default="")}
    return f"{older} stayed, and newer ones went: {pruned}" if older and times == sorted(times) else ""


def broken_rows(entries: list[RecordingEntry], told: dict[str, int], durable: set[str], last: int) -> Iterator[str]:
    """Say where what was told is not there, or something is there twice, out of order, or was never recorded.

    told: rows by the file's name; durable: names of files that were synced; last: number of the last row.
    """
    rows_in = {entry.path.name: entry.rows for entry in entries if not entry.fault}
    numbers: list[int] = []
    for entry in entries:
        if not entry.fault:
            numbers += [int(one) for one in read_recording(entry.path).columns["force_n"]]
        elif entry.path.name in durable:
            yield entry.fault
    if numbers != sorted(set(numbers)) or not set(numbers) <= set(range(last + 1)):
        yield f"rows {numbers}, {last} were recorded"
    for name, rows in told.items():
        if rows_in.get(name, 0) < rows and (rows or name in durable):
            yield f"{name}: {rows} rows were told, {rows_in.get(name)} are there"
