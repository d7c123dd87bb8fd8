"""Who judges recordings sees what a recording tells otherwise than it was."""

import json
import struct
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from math import nan
from pathlib import Path
from random import Random
from zlib import crc32

import pytest

from tests.simulation.judges.recording_judge import History, Row, judge_recordings, judge_rows
from tests.simulation.masters.spelling import (
    coil_pdu,
    hangs_payload,
    mask_pdu,
    read_and_write_pdu,
    write_one_pdu,
    write_pdu,
)

COLUMNS = ("time_s", "force_n", "sent_v", "sent_age_s")


def recorded(rows: list[tuple[float, ...]]) -> bytes:
    """A recording's file of these rows, in two batches."""
    header = json.dumps({"columns": COLUMNS}).encode()
    data = b"\x89FGR1\r\n\n" + struct.pack("<II", len(header), crc32(header)) + header
    for number, part in enumerate((rows[:5], rows[5:])):
        payload = b"".join(struct.pack("<4d", *row) for row in part)
        counts = struct.pack("<II", number, len(part))
        data += b"FGB\x1e" + counts + struct.pack("<I", crc32(payload, crc32(counts))) + payload
    return data


def spoil_row(column: str, value: float) -> Callable[[list[Row]], None]:
    return lambda rows: rows[8].__setitem__(column, value)


@pytest.mark.parametrize(
    ("spoil", "seen"),
    [
        (lambda rows: None, ""),
        (spoil_row("sent_v", nan), ""),
        (spoil_row("force_n", 0.5), "it tells 0.50 N"),
        (spoil_row("force_n", nan), "it tells none"),
        (spoil_row("time_s", 0.41), "nothing came at"),
        (spoil_row("sent_v", 3.0), "3.000 V at"),
        (spoil_row("sent_age_s", 0.3), "never came to the output"),
        (lambda rows: [row.update(force_n=row["force_n"] + 0.5) for row in rows[6:]], "the zero at"),
    ],
)
def test_a_recording_that_tells_something_else_is_seen(
    spoil: Callable[[list[Row]], None], seen: str, tmp_path: Path
) -> None:
    """Twenty readings and twenty settings, each sent 10 ms before a reading and on its way for 5 ms; 16 are recorded, with a
    zero of 1 N."""
    history, chance = History(), Random(3)
    for number in range(20):
        history.readings.append((1.0 + 0.05 * number, round(chance.uniform(0.0, 40.0), 2)))
        history.settings.append((0.995 + 0.05 * number, 0.1 * number))
    rows = [
        {
            "time_s": 0.05 * at,
            "force_n": history.readings[3 + at][1] - 1.0,
            "sent_v": 0.1 * (3 + at),
            "sent_age_s": 0.01,
        }  # type: ignore[operator]
        for at in range(16)
    ]
    spoil(rows)
    (tmp_path / "0001.fgr").write_bytes(recorded([tuple(row.values()) for row in rows]))
    broken = list(judge_recordings(tmp_path, history))
    assert bool(broken) == bool(seen)
    assert not broken or any(line.startswith("recording 0001.fgr: ") and seen in line for line in broken)


def test_a_tare_moves_the_zero_and_a_pulling_valve_turns_the_sign(tmp_path: Path) -> None:
    history = History(has_valve=True, tares=deque([1.45]))
    history.readings.extend((1.0 + 0.05 * number, 7.0 + 0.1 * number**2) for number in range(20))
    row = {"sent_v": nan, "sent_age_s": nan}
    zeros = [(1.0, 1.0)] * 5 + [(-1.0, -1.0)] * 5 + [(1.0, 0.25)] * 10
    forces = [
        sign * (force_n or 0.0) - zero_n for (_, force_n), (sign, zero_n) in zip(history.readings, zeros, strict=True)
    ]
    rows = [row | {"time_s": 0.05 * at, "force_n": force_n} for at, force_n in enumerate(forces)]
    assert judge_rows(rows, history) == []
    assert len(judge_rows(rows, replace(history, has_valve=False))) > 1
    assert len(judge_rows(rows, replace(history, tares=deque()))) == 1


def test_a_tare_among_readings_that_were_no_plain_ones_has_moved_the_zero() -> None:
    history = History(tares=deque([1.3]))
    history.readings.extend((1.0 + 0.05 * number, 7.0 if number < 5 or number > 50 else None) for number in range(60))
    row = {"sent_v": nan, "sent_age_s": nan}
    rows = [
        row | {"time_s": at_s - 1.0, "force_n": nan if force_n is None else force_n - (1.0 if at_s > 1.3 else 0.0)}
        for at_s, force_n in history.readings
    ]
    assert judge_rows(rows, history) == []
    assert "the zero at" in judge_rows(rows, replace(history, tares=deque()))[0]


def test_a_payload_that_somebody_has_hung_moves_the_zero(tmp_path: Path) -> None:
    history = History(weighed_s=1.5)
    history.readings.extend((1.0 + 0.05 * number, 7.0 + 0.1 * number**2) for number in range(20))
    row = {"sent_v": nan, "sent_age_s": nan}
    rows = [
        row | {"time_s": at_s - 1.0, "force_n": (force_n or 0.0) - (0.3 if at_s > 1.52 else 0.0)}
        for at_s, force_n in history.readings
    ]
    assert judge_rows(rows, history) == []
    assert "the zero at" in judge_rows(rows, replace(history, weighed_s=1.8))[0]


@pytest.mark.parametrize(
    ("pdu", "hangs"),
    [
        (write_pdu(9, 33), True),
        (write_pdu(0, *9 * [1], 0), False),
        (write_pdu(0, *9 * [0], 1), True),
        (write_pdu(10, 7), False),
        (write_pdu(218, 0x4204, 0), True),
        (write_pdu(300, *18 * [1], 0, 0x4204), True),
        (write_one_pdu(9, 1), True),
        (write_one_pdu(8, 1), False),
        (mask_pdu(9, 0xFFFF, 1), True),
        (read_and_write_pdu(100, 1, 8, 0, 5), True),
        (coil_pdu(9, on=True), False),
    ],
)
def test_who_hangs_a_payload_is_told_by_the_request(pdu: bytes, hangs: bool) -> None:
    assert hangs_payload(pdu) is hangs
