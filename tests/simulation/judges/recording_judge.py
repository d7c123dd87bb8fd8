"""Whether recordings tell what was on the wires: each row a reading that came then, each voltage one that was sent then. Reads
the files by their documented layout; no code of the gateway is used here."""

import json
import struct
from bisect import bisect_left
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import islice
from math import inf, isfinite
from pathlib import Path
from zlib import crc32

MAGIC, MARK = b"\x89FGR1\r\n\n", b"FGB\x1e"
FEWEST = 12
"""Rows of a recording that can be told from what came at another time."""
NEW_ZERO_S = 1.0
"""After somebody has tared."""
HEARD_S = 0.01
"""So much later, at most, a master hears that its tare was taken: a reading may come in between."""
COUNT_N, COUNT_V = 1e-6, 0.006
ON_WIRE_S = 0.08
"""From a setting's first byte to its last, behind whatever is on the wire before it."""
AROUND_CUT_S = 0.1
AWAKE_S = 0.02
DATED_S = 0.3  # what has waited through a standstill is dated at its beginning, no longer before
TURN_S = 0.05
"""The longest pause of a loop between two ticks."""
MOST_TOLD, MOST = 4, 20_000
RANGE_N = 95.0
"""What is more may be called an overload."""
Row = dict[str, float]


@dataclass
class History:
    """What came from the load cell, N (None where it was no plain reading), what reached the output, V, and when somebody
    tared, a line was cut or its last sentence sent, control went on after a standstill, or was about to stand still (a turn
    before); each with its time, s. is_plain: readings are sentences whose number is the force; has_valve: one that pulls turns
    its sign; weighed_s: from then on a payload may hang at the cell, whose weight the gateway takes off."""

    is_plain: bool = True
    has_valve: bool = False
    weighed_s: float = inf
    readings: deque[tuple[float, float | None]] = field(default_factory=lambda: deque(maxlen=MOST))
    settings: deque[tuple[float, float]] = field(default_factory=lambda: deque(maxlen=MOST))
    tares: deque[float] = field(default_factory=lambda: deque(maxlen=2_000))
    cuts: deque[float] = field(default_factory=lambda: deque(maxlen=2_000))
    awoken: deque[float] = field(default_factory=lambda: deque(maxlen=2_000))
    frozen: deque[float] = field(default_factory=lambda: deque(maxlen=2_000))

    @property
    def is_whole(self) -> bool:
        """Whether nothing has been forgotten: what is older than that is not judged."""
        return max(len(self.readings), len(self.settings)) < MOST


def judge_recordings(folder: Path, history: History) -> Iterator[str]:
    """Say what does not hold. A recording tells no time that a schedule knows, so it is laid where it fits best."""
    for path in sorted(folder.rglob("*.fgr")):
        rows = read_rows(path.read_bytes())
        if len(rows) >= FEWEST:
            yield from (f"recording {path.name}: {words}" for words in judge_rows(rows, history))


def judge_rows(rows: list[Row], history: History) -> list[str]:
    """Return what does not hold where the rows fit best."""
    best = MOST_TOLD * ["it fits nowhere"]
    readings = dict[int, float | None]()
    for at_s, force_n in history.readings:  # of two that an adapter has handed over as one nobody knows which is which
        readings[_key(at_s)] = None if _key(at_s) in readings else force_n
    settings = sorted(history.settings)
    anchors_s = (
        rows[0]["time_s"],
        rows[len(rows) // 2]["time_s"],
    )  # a reading that has waited for control to awake came before
    for begun_s in (at_s - anchor_s for anchor_s in anchors_s for at_s, _ in history.readings):
        found = list(islice(_judge_laid(rows, begun_s, readings, settings, history), len(best)))
        if not found:
            return []
        best = min(best, found, key=len)
    return best


def read_rows(data: bytes) -> list[Row]:
    """Return the rows of all whole batches; none where a kill has cut the header, behind which the first would come."""
    at = len(MAGIC) + 8
    length, crc = struct.unpack_from("<II", data, len(MAGIC)) if len(data) >= at else (0, 0)
    if len(data) < at + length:
        return []
    assert data.startswith(MAGIC) and crc32(data[at : at + length]) == crc
    columns, at, rows = json.loads(data[at : at + length])["columns"], at + length, list[Row]()
    layout = struct.Struct(f"<{len(columns)}d")
    while data[at : at + 4] == MARK and at + 16 <= len(data):
        _, _, count, _ = struct.unpack_from("<4sIII", data, at)
        end = at + 16 + count * layout.size
        if end > len(data):
            break
        rows += (dict(zip(columns, values, strict=True)) for values in layout.iter_unpack(data[at + 16 : end]))
        at = end
    return rows


def _judge_laid(
    rows: list[Row],
    begun_s: float,
    readings: dict[int, float | None],
    settings: list[tuple[float, float]],
    history: History,
) -> Iterator[str]:
    """Say what does not hold where the first row is the reading of begun_s."""
    zeros_n, known_s = tuple[float, ...](), begun_s
    for row in rows:
        at_s = begun_s + row["time_s"]
        if _is_near(history.awoken, at_s, AWAKE_S) or _is_near(history.frozen, at_s, TURN_S):
            continue  # what has waited for it came before, or behind what it was taken for
        key = _key(at_s)
        if key not in readings:
            if not _is_near(history.awoken, at_s + DATED_S, DATED_S):
                yield f"nothing came at {at_s:.4f}"
            continue
        force_n = readings[key] if history.is_plain else None
        if force_n is None or not isfinite(row["force_n"]):
            if force_n is not None and abs(force_n) < RANGE_N:
                yield f"{force_n:.2f} N came at {at_s:.4f}, and it tells none"
        else:
            zeros_n, before_n = _zeros(row["force_n"], force_n, history), zeros_n
            same_n = tuple(one for one in before_n if any(abs(one - other) < COUNT_N for other in zeros_n))
            since_s, known_s = at_s - known_s + NEW_ZERO_S, at_s  # what came between was no plain reading
            if before_n and not same_n and not _is_zero_new(history, at_s, since_s):
                yield f"{force_n:.2f} N came at {at_s:.4f}, and it tells {row['force_n']:.2f} N, the zero at {before_n} N"
            zeros_n = same_n or zeros_n
        if isfinite(row["sent_v"]) and not _was_sent(row, at_s - row["sent_age_s"], settings, history):
            yield f"{row['sent_v']:.3f} V at {at_s - row['sent_age_s']:.4f} never came to the output"


def _is_zero_new(history: History, at_s: float, since_s: float) -> bool:
    heard_s = at_s + HEARD_S  # who wrote hears of it later
    return heard_s >= history.weighed_s or _is_near(history.tares, heard_s, since_s + HEARD_S)


def _zeros(told_n: float, force_n: float, history: History) -> tuple[float, ...]:
    """Return where the zero may be: a valve that pulls turns the sign."""
    return (force_n - told_n, force_n + told_n) if history.has_valve else (force_n - told_n,)


def _was_sent(row: Row, sent_s: float, settings: list[tuple[float, float]], history: History) -> bool:
    at = bisect_left(settings, (sent_s, 0.0))
    for came_s, voltage_v in islice(settings, at, None):
        if came_s > sent_s + ON_WIRE_S:
            break
        if abs(voltage_v - row["sent_v"]) < COUNT_V:
            return True
    return _is_near(history.cuts, sent_s + ON_WIRE_S, AROUND_CUT_S + ON_WIRE_S)


def _is_near(times_s: Iterable[float], at_s: float, before_s: float) -> bool:
    for time_s in times_s:  # noqa: SIM110  # asked ten thousand times for a schedule, mostly of nothing
        if 0.0 <= at_s - time_s <= before_s:
            return True
    return False


def _key(at_s: float) -> int:
    return round(at_s * 1e5)
