"""Requests as a master may send them, or never should: every function, every block and its edges, all ways to spell."""

import struct
from random import Random

from gateway.registers.upload.coefficients import CoefficientSet
from tests.calibrations.coefficients import calibration, requests_of, staged
from tests.simulation.masters.spelling import (
    coil_pdu,
    coils_pdu,
    floats_pdu,
    mask_pdu,
    read_and_write_pdu,
    read_pdu,
    write_one_pdu,
    write_pdu,
)

EDGES = tuple(
    place
    for first, last in ((0, 15), (100, 131), (200, 295), (300, 395), (400, 431), (1000, 1199), (1500, 1699))
    for place in (first, first + 1, last - 1, last, last + 1)
)
WORDS = (*[0] * 8, *[1] * 8, 2, 2, 4, 8, 9, 9, 13, 16, 17, 32, 64, 3, 5, 6, 10, 128, 0x8000, 0xFFFF)
"""Control words; enable and stop most often."""
FORCES = (0, 300, 800, 1200, 2500, 2500, 6000, 6001, -1, 32767, -32768)
FLOATS = (0.0, 3.0, 12.0, 12.34, 25.0, 60.0, 60.004, 61.0, -1.0, 2.34e-41, 1e-4, float("nan"), float("inf"), 1e30)
COUNTS = (1, 1, 2, 3, 13, 16, 17, 32, 123, 124, 125, 126, 2000, 2001, 0, 65535)
WORTH = 0, 0, 1, 2, 100, 180, 1800, 10000, 10001, 32767, 32768, 65535
COMMIT, SELECT = 1145, 1149
STOPS = (
    write_one_pdu(0, 0), write_pdu(0, 0, 0), coil_pdu(0, on=False), mask_pdu(0, 0, 0), coils_pdu(0, 0, 8),
    floats_pdu(200, 0.0, is_swapped=False), floats_pdu(300, 0.0, 0.0, is_swapped=True), read_and_write_pdu(100, 4, 0, 0),
)  # fmt: skip
"""Each clears the control word, and sets nothing beside it."""


def draw_command(draw: Random, beat: int) -> bytes:
    """A write of the command block, in one of its spellings."""
    word, force, force_n = draw.choice(WORDS), draw.choice(FORCES), draw.choice(FLOATS)
    block = [word, force, *(draw.choice(WORTH) if draw.random() < 0.1 else 0 for _ in range(14))]
    block[3], block[4] = draw.choice((0, 0, 0, 0, 1, 2)), beat
    size = draw.choice((1, 2, 2, 5, 5, 6, 13, 16))
    swapped, first = draw.choice(
        ((False, 200), (True, 300), (False, 300), (True, 200)) if draw.random() < 0.1 else ((False, 200), (True, 300))
    )
    k = draw.randrange(13)
    return draw.choice(
        (
            write_pdu(0, *block[:size]),
            write_pdu(0, *block[:size]),
            write_pdu(1, force, 0, 0, beat),
            write_one_pdu(0, word),
            write_one_pdu(1, force),
            write_one_pdu(4, beat),
            write_one_pdu(k, draw.choice(WORTH)),
            write_pdu(k, *(draw.choice((0, 0, draw.choice(WORTH))) for _ in range(draw.randrange(1, 4)))),
            read_and_write_pdu(100, 32, 0, *block[:size]),
            read_and_write_pdu(draw.choice(EDGES), draw.choice((1, 4, 125)), 0, *block[:size]),
            struct.pack(">BHHH", 22, draw.choice((1, 1, 5)), 0xFFFF, draw.choice((300, 1000))),  # bits that are kept
            mask_pdu(0, 0xFFFF & ~word, word),
            mask_pdu(draw.choice((0, 1, 1, 3, 4)), draw.choice((0, 0xFFFF, 0xFF00)), draw.choice((*WORTH, 300, 1000))),
            coil_pdu(draw.choice((0, 0, 1, 2, 3, 4, 5, 6, 15, 16, 100)), on=draw.random() < 0.5),
            coils_pdu(
                draw.choice((0, 0, 1, 3, 9, 100)),
                draw.getrandbits(8) if draw.random() < 0.5 else word,
                draw.choice((1, 4, 7, 8)),
            ),
            floats_pdu(first, float(word), force_n, is_swapped=swapped),
            floats_pdu(first + 2, force_n, is_swapped=swapped),
            floats_pdu(first + 2 * k, draw.choice((*FLOATS, 5.0, 65535.0)), is_swapped=swapped),
        )
    )


def draw_read(draw: Random) -> bytes:
    function, address = draw.choice((1, 2, 3, 3, 3, 4)), draw.choice((*EDGES, 16, 99, 115, 116, 232, 0, 100))
    return struct.pack(">BHH", function, address & 0xFFFF, draw.choice(COUNTS))


def draw_edge(draw: Random) -> bytes:
    """A write at, or across, the edge of a block; half a value; a value that may not be written."""
    address = draw.choice((*EDGES, 201, 203, 233, 117, 121, 401, 416, 417, 1002, 1003))
    count = draw.choice((1, 1, 2, 2, 3, 16, 17, 32, 121, 123))
    words = [draw.choice((0, 0, 0, 1, 0x449A, 0x5000))] * count
    return draw.choice(
        (write_pdu(address, *words), write_one_pdu(address, words[0]), read_and_write_pdu(100, 2, address, *words[:121]),
         mask_pdu(address, 0, words[0]), write_pdu(416, 0x449A, 0x5000), write_pdu(416, 0x5000, 0x449A))
    )  # fmt: skip


def draw_garbage(draw: Random) -> bytes:
    """Functions that nobody serves, shapes that no function has."""
    whole = draw.choice((draw_read, draw_edge))(draw)
    return draw.choice(
        (
            bytes((draw.randrange(256),)) + draw.randbytes(draw.choice((0, 0, 1, 4, 5, 30))),
            whole[: draw.randrange(1, len(whole))],
            (whole + draw.randbytes(draw.randrange(1, 4)))[:253],
            struct.pack(">BHH", 8, draw.choice((0, 0, 1, 4, 10, 255)), draw.getrandbits(16)),
            bytes((43, draw.choice((14, 14, 13)), draw.randrange(6), draw.choice((0, 1, 6, 7, 128, 255)))),
            b"\x11",
            struct.pack(">BHH", 5, draw.choice((0, 3, 15, 16, 99, 100, 116)), draw.choice((1, 0xFF, 0xFFFF, 0xFE00))),
            struct.pack(">BHHB", 16, 0, draw.choice((0, 1, 2, 124)), draw.choice((0, 1, 2, 4)))
            + bytes(draw.choice((0, 2, 4))),
            struct.pack(">BHH", draw.choice((1, 2, 3, 4)), 0xFFFF, draw.choice((1, 2, 125))),
        )
    )


class Upload:
    """One party's set on its way: a write at a time, in an order of its own, and the commit."""

    def __init__(self, draw: Random) -> None:
        self._draw, self._waiting = draw, list[bytes]()

    def next(self) -> bytes:
        draw = self._draw
        if draw.random() < 0.08:
            return write_one_pdu(draw.choice((COMMIT, SELECT)), draw.choice((0, 1, 2, 3, 4, 7, 8, 65535)))
        if not self._waiting:
            words = staged(CoefficientSet.of_calibration(calibration(draw.choice((3, 8)), order=draw.choice((2, 3)))))
            pieces = requests_of(words, draw.choice((60, 123)))
            self._waiting = [struct.pack(">BHHB", 16, at, len(data) // 2, len(data)) + data for at, data in pieces]
            if draw.random() < 0.3:
                draw.shuffle(self._waiting)
            self._waiting.append(write_one_pdu(COMMIT, draw.choice((1, 1, 2))))
            if draw.random() < 0.3:
                del self._waiting[draw.randrange(len(self._waiting))]
        return self._waiting.pop(0)


def draw_request(draw: Random, beat: int, upload: Upload) -> bytes:
    which = draw.random()
    if which < 0.5:
        return draw_command(draw, beat)
    if which < 0.66:
        return draw_read(draw)
    if which < 0.78:
        return draw_edge(draw)
    return draw_garbage(draw) if which < 0.88 else upload.next()


READ_STATUS = read_pdu(100, 32)
