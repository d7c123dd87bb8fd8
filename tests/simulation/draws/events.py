"""What happens to a gateway, drawn from a seed: what masters of every kind ask, what fails in the world, what is done to the
machine. Each event is whole by itself, so that any of them can be left out.
"""

import struct
from collections.abc import Iterator
from heapq import merge
from operator import attrgetter
from random import Random

from tests.simulation.draws.behaviours import draw_behaviours, draw_frames, draw_paths, draw_refused
from tests.simulation.draws.event import Event
from tests.simulation.draws.rare_events import LADDER_S, draw_jam, draw_ladder, draw_rare_events
from tests.simulation.draws.sequences import draw_sequences
from tests.simulation.kernel.spoiled import KINDS
from tests.simulation.masters.socket_lines import draw_line
from tests.simulation.masters.spelling import (
    WAYS,
    coils_pdu,
    mask_pdu,
    read_and_write_pdu,
    read_pdu,
    write_one_pdu,
    write_pdu,
)

FAULTS = ("no-air", "no-contact", "sign-inverted", "cell-cut", "cell-frozen", "output-cut")
VALVE_FAULTS = ("valve-cut", "valve-stuck")
"""These mean nothing to a rig without a valve."""
LATE_S = (0.005, 0.4)
"""Sooner than a reply's time-out, and long after it."""
SAID = {
    "output": (b"0\r\n", b"510\r\n", b"1023\r\n", b"UNKNOWN COMMAND\r\n", b"OUT OF RANGE\r\n", b"!017021\r", b"\r\n"),
    "load_cell": (
        b"OL,GS,        kg\r\n",
        b"OL,GS,+9999.99kg\r\n",
        b"ST,GS,+0000.00kg\r\n",
        b"ST,GS,-0004.00kg\r\n",
        b"ST,GS,+0001.20 N\r\n",
        b"ST,NT,+0001.20kg\r\n",
        b"ST,GS,     nankg\r\n",
        b"\r\n",
        b"510\r\n",
    ),
    "valve": (
        b"\x01\x05\x00\x00\xff\x00\x8c\x3a",
        b"\x01\x01\x01\x01\x90\x48",
        b"\x01\x01\x01\x00\x51\x88",
        b"\x01\x85\x02\xc3\x51",
    ),
    "bus": (b"\x00", b"\x01\x03\x00\x64\x00", b"\x01\x06\x00\x00\x00\x01\x48\x0c", b"\x11\x03\x00\x6b\x00\x03\x76\x87"),
}
"""What a device may say at another time, or another device at its place."""


def draw_events(seed: int, duration_s: float) -> Iterator[Event]:
    """What happens, in its order: a little more than two events a second, and what is rare (rare_events.py,
    sequences.py)."""
    usual = merge(draw_usual(Random(seed), duration_s), draw_rare_events(seed, duration_s), key=attrgetter("at_s"))
    more = (draw(seed) for draw in (draw_jam, draw_sequences, draw_behaviours, draw_refused, draw_frames, draw_paths))
    usual = merge(usual, *more, key=attrgetter("at_s"))
    ladder = tuple(draw_ladder(seed))
    quiet_s = LADDER_S if ladder else 0.0  # nearly everything else would end it
    return merge(ladder, (event for event in usual if event.at_s >= quiet_s), key=attrgetter("at_s"))


def draw_usual(chance: Random, duration_s: float) -> Iterator[Event]:
    """A little more than two events a second, in their order."""
    at_s = 0.0
    while (at_s := at_s + chance.expovariate(2.4)) < duration_s:
        event = _draw_one(chance, round(at_s, 4))
        yield event
        if event.what == "terminate" and chance.random() < 0.5:  # and it stands still on its way down
            at_s = event.at_s + chance.uniform(0.0, 0.25)
            yield Event(round(at_s, 4), "machine", "stop", (round(chance.uniform(0.05, 0.6), 4), 0.0))


def _draw_one(chance: Random, at_s: float) -> Event:
    draw = chance.random()
    if draw < 0.11:
        return _draw_spoil(chance, at_s)
    return Event(at_s, "person", "say", data=draw_line(chance)) if draw < 0.16 else _draw(chance, at_s)


def _draw(chance: Random, at_s: float) -> Event:
    draw, master = chance.random(), chance.choice(("worker", "worker", "rival"))
    if draw < 0.30:
        return _draw_command(chance, at_s, master)
    if draw < 0.36:
        return Event(at_s, master, chance.choice(("calibrate", "self_test", "self_test")))
    if draw < 0.47:
        return Event(at_s, master, chance.choice(("reset", "reset", "let_go", "fall_silent", "disconnect", "tare")))
    if draw < 0.51:
        return Event(at_s, "integrator", "upload")
    if draw < 0.64:
        unit = chance.choice((1, 1, 1, 1, 1, 1, 0, 2, 247, 255))
        return Event(at_s, chance.choice(("worker", "rival", "fool")), "ask", (unit,), _stupid(chance))
    if draw < 0.69:
        return Event(at_s, "villain", "send_raw", data=_hostile(chance))
    if draw < 0.86:
        fault = chance.choice(VALVE_FAULTS if chance.random() < 0.1 else FAULTS)
        return Event(at_s, "world", fault, (float(chance.random() < 0.35),))
    if draw < 0.92:
        return Event(
            at_s, chance.choice(("output", "load_cell", "valve", "bus")), chance.choice(("pull", "push", "push"))
        )
    what = chance.choice(
        ("kill", "stop", "kill_guardian", "terminate", "disk_full", "disk_hung", "disk_free", "clock_jump")
    )
    return Event(at_s, "machine", what, (round(chance.uniform(0.005, 0.3), 4), chance.uniform(-1e6, 1e6)))


def _draw_command(chance: Random, at_s: float, master: str) -> Event:
    what = chance.choice(("hold", "hold", "hold", "hold", "take", "take", "pull", "drive"))
    number = chance.uniform(0.0, 9.0 if what == "drive" else 66.0)
    way = chance.choice(tuple(WAYS)) if chance.random() < 0.4 else "block"
    return Event(at_s, master, what, (round(number, 2),), way=way)


def _draw_spoil(chance: Random, at_s: float) -> Event:
    """Something on a wire that the device did not say so: most often one answer of it, now and then many in a row."""
    line = chance.choice(("output",) * 5 + ("load_cell",) * 3 + ("valve", "bus"))
    said = chance.choice(SAID[line]) if chance.random() < 0.8 else chance.randbytes(chance.randrange(1, 40))
    if chance.random() < 0.2:
        return Event(at_s, line, "say", data=said)
    kind, count = chance.choice(KINDS), chance.choice((1, 1, 1, 2, 3, 12))
    if line == "bus" and kind == "late":
        kind = "lost"  # a request that its master has given up long ago: nobody could tell it from a new one
    number = round(chance.uniform(*LATE_S) if kind == "late" else chance.random(), 4)
    return Event(at_s, line, kind, (float(count), number), said)


def _stupid(chance: Random) -> bytes:
    """A request that may be refused: any register, any value, any function."""
    address = chance.choice(
        (0, 0, 0, 1, 4, chance.randrange(0, 16), chance.randrange(100, 130), 200, 300, 416, 1000, 1147, 1500)
    )
    count = chance.choice((1, 1, 2, 5, 13, chance.randrange(1, 124)))
    words = [chance.choice((0, 1, 2, 9, 33, 65535, chance.randrange(65536))) for _ in range(count)]
    if address == 0 and words:
        words[0] &= ~0x60  # runs of their own (bits 5 and 6) move without a master's lease, by right
    function = chance.choice((3, 4, 1, 2, 5, 6, 15, 16, 16, 16, 22, 23, 43, 99))
    if function == 16:
        return write_pdu(address, *words)
    if function == 6:
        return write_one_pdu(address, words[0])
    if function in (1, 2, 3, 4):
        return struct.pack(">BHH", function, address, chance.choice((0, 1, 10, 125, 126, 65535)))
    return _stupid_bits(chance, function, address, words)


def _stupid_bits(chance: Random, function: int, address: int, words: list[int]) -> bytes:
    """The same by functions that change bits, or that do two things; and any bytes behind any function."""
    if function == 5:
        return struct.pack(">BHH", 5, chance.choice((0, 1, 2, 3, 4)), chance.choice((0, 0xFF00, 0x1234)))
    if function == 22:
        return mask_pdu(address, chance.randrange(65536) | 0x60, chance.randrange(65536))
    if function == 15 and chance.random() < 0.7:
        return coils_pdu(chance.choice((0, 0, 1, 3)), chance.randrange(32), chance.randrange(1, 3))
    if function == 23 and chance.random() < 0.7:
        return read_and_write_pdu(chance.choice((100, 0, 99)), chance.choice((1, 10, 200)), address, *words)
    return bytes((function,)) + chance.randbytes(chance.randrange(0, 40))


def _hostile(chance: Random) -> bytes:
    whole = struct.pack(">HHHB", 7, 0, 6, 1) + read_pdu(100, 10)
    return chance.choice(
        (
            chance.randbytes(chance.randrange(1, 400)),
            whole[: chance.randrange(1, len(whole))],
            whole * chance.randrange(2, 60),
            struct.pack(">HHHB", 1, 0, 65535, 1),
            struct.pack(">HHHB", 1, 9, 6, 1) + whole[7:],
        )
    )
