"""Sets of coefficients for tests: recognisable by one number, of any order."""

import struct
from collections.abc import Iterator
from dataclasses import replace

from gateway.bsfm import Calibration
from gateway.registers.upload.coefficients import HEAD_BYTES, HEAD_WORDS, SET_WORDS, TAIL_FROM, CoefficientSet, set_crc

STRETCHES = ((0, 145), (TAIL_FROM, 200))
"""Words of the staging block that an upload writes: before and after those of the commit."""


def calibration(mark: int = 0, *, order: int = 2, number: int = 1, **changes: object) -> Calibration:
    """Tied branches from 0 N to (50 + mark / 8) N over 0..8 V: whoever reads back a mixture of two marks sees it."""
    top_n = 50.0 + mark / 8
    rising = tuple(top_n * k / order for k in range(order + 1))
    falling = tuple(force_n + (2.0 if 0 < k < order else 0.0) for k, force_n in enumerate(rising))
    given = Calibration(
        number=number,
        name=f"mark {mark}",
        order=order,
        x0_v=0.0,
        x1_v=8.0,
        rising_handles_n=rising,
        rising_weights=(1.0,) * (order + 1),
        falling_handles_n=falling,
        falling_weights=(1.0,) * (order + 1),
        blend_span_n=3.0 + mark / 8,
        rms_n=0.125,
        max_n=0.5,
        date_utc="2026-11-21",
        source=f"a test, mark {mark}",
        rig="demo",
        data_sha256=f"{mark:064x}",
    )
    return replace(given, **changes)  # type: ignore[arg-type]


def mark_of(given: Calibration) -> int:
    """The mark, after a check that every part of the calibration carries the same one."""
    mark = int(given.name.removeprefix("mark "))
    assert given == calibration(mark, order=given.order, number=given.number), "a mixture"
    return mark


def staged(given: CoefficientSet, *, length: int = SET_WORDS, slot: int = 0, crc: int | None = None) -> bytes:
    """The staging block of an upload, 400 bytes. length HEAD_WORDS: as masters of map version 1 fill it."""
    words = given.to_words()
    head, tail = words[:HEAD_BYTES], words[HEAD_BYTES:]
    if length == HEAD_WORDS:
        words, tail = head, bytes(len(tail))
    trailer = struct.pack(">H2xIH", length, set_crc(words) if crc is None else crc, slot)
    return head + trailer + bytes(10) + tail


def swapped(number: float) -> float:
    """What a master sends that has the two words of a float32 the other way round."""
    data = struct.pack(">f", number)
    return float(struct.unpack(">f", data[2:] + data[:2])[0])


def requests_of(block: bytes, most: int = 123) -> Iterator[tuple[int, bytes]]:
    """(address, words) of the writes that fill the staging block so, `most` words at a time."""
    for first, end in STRETCHES:
        for at in range(first, end, most):
            yield 1000 + at, block[2 * at : 2 * min(at + most, end)]
