"""The master of a serial line, and what else is on its wire: other units with their answers, noise, halves of frames, another
master. Nothing is executed but what was asked of this unit, or of all, once; and one request at most is answered."""

import struct
from collections.abc import Callable
from itertools import pairwise
from random import Random

from gateway.modbus import Peer
from tests.fuzz.frame_model import crc
from tests.service.requests.drawn.reference import is_whole
from tests.service.requests.drawn.world import SerialFace, World

SOON_S = 0.04
SILENCE_S, SPLITS_S, GIVEN_UP_S = 0.004, (0.0, 0.001, 0.004, 0.016), 0.03
"""Longer than the silence of the line; what adapters part a frame by; longer than anybody waits for the rest of a frame."""
FOREIGN = 9, 17, 200
LENGTHS_KNOWN = 1, 2, 3, 4, 5, 6, 15, 16, 22, 23
START = struct.pack(">BHHBHH", 16, 0, 2, 4, 1, 1200)
"""Enable with 12 N: what nobody has asked for where it is inside of another's frame."""


def frame_of(unit: int, pdu: bytes) -> bytes:
    body = bytes((unit,)) + pdu
    return body + crc(body)


class Bus:
    """executed: of this line, by the judge, in order."""

    def __init__(self, world: World, face: SerialFace, executed: Callable[[], list[bytes]]) -> None:
        self._world, self._face, self._executed = world, face, executed
        self.peer: Peer = face.server.settings.peer
        self.name, self.unit, self.broken = str(self.peer), face.server.settings.unit, list[str]()
        for (
            other
        ) in FOREIGN:  # an adapter may part frames only of units that are known on the line, that no request is made of
            self.say(frame_of(other, struct.pack(">BHH", 3, 0, 1)), 0.01)
            self.say(frame_of(other, b"\x03\x02\0\1"), 0.01)
        self.ask(struct.pack(">BHH", 3, 100, 2))

    def ask(self, pdu: bytes, unit: int | None = None, noise: bytes = b"", cuts: tuple[float, ...] = ()) -> None:
        """One request, in as many pieces as there are cuts (places, as shares of it) and one; unit: another's, or 0."""
        world, unit = self._world, self.unit if unit is None else unit
        if noise:
            self.say(noise, 0.1)
        sent, done, began_s = len(self._face.sent), len(self._executed()), world.clock.now_s
        frame = frame_of(unit, pdu)
        if cuts and is_whole(pdu) and pdu[0] in LENGTHS_KNOWN:
            places = [0, *sorted({round(share * len(frame)) for share in cuts}), len(frame)]
            for at, end in pairwise(places):
                self.say(frame[at:end], 0.012 if end < len(frame) else 0.0)
        else:
            self.say(frame)
        world.run(0.03)
        self._judge_asked(pdu, unit, noise, (sent, done, began_s + 0.012 * len(cuts)))

    def _judge_asked(self, pdu: bytes, unit: int, noise: bytes, before: tuple[int, int, float]) -> None:
        sent, done, began_s = before
        if unit not in (0, self.unit) or not is_whole(pdu):
            self._world.run(0.05)  # what comes soon behind half a request belongs to it
        answers, executed = self._face.sent[sent:], self._executed()[done:]
        if unit != self.unit:
            if answers:
                self.broken.append(f"unit {unit} is answered {answers}")
            is_done = unit == 0 and is_whole(pdu) and pdu[0] in (5, 6, 15, 16, 22)
            if (unit and executed) or (is_done and executed != [pdu]):
                self.broken.append(f"{pdu.hex()} to unit {unit} is executed as {executed}")
            return
        if not is_whole(pdu):
            return
        if len(answers) != 1 or executed != [pdu]:
            self.broken.append(f"{pdu.hex()} behind noise {noise.hex()}: {answers} by {executed}")
            return
        (at_s, data) = answers[0]
        if data[-2:] != crc(data[:-2]) or data[0] != self.unit or data[1] & 0x7F != pdu[0] & 0x7F:
            self.broken.append(f"{pdu.hex()} is answered {data.hex()}")
        if at_s - began_s > SOON_S:
            self.broken.append(f"{pdu.hex()} is answered after {at_s - began_s} s")

    def say(self, data: bytes, then_s: float = 0.0) -> None:
        self._face.hear(data, self._world.clock.now_s)
        self._world.run(then_s)

    # -- what else is on the wire

    def overhear(self, draw: Random, pdu: bytes) -> str:
        """Others speak; pdu: what this line's own master asks for among it, where it does."""
        self._world.run(0.05)
        sent, done = len(self._face.sent), len(self._executed())
        acts = (self._given_up, self._spoiled, self._row, self._broadcast_row, self._stray, self._broken_off)
        how, wanted, most = draw.choice((self._foreign_exchange, *acts))(draw, pdu)
        self._world.run(0.05)
        answers, executed = self._face.sent[sent:], self._executed()[done:]
        if executed != wanted or len(answers) > most:
            self.broken.append(f"{how}: {[one.hex() for one in executed]} is executed, {answers} answered")
        return f"{self.name} {how}"

    def _foreign_exchange(self, draw: Random, _pdu: bytes) -> tuple[str, list[bytes], int]:
        """Another unit is read, or written, and what it is told or tells looks like a request to this one."""
        inside = frame_of(draw.choice((self.unit, 0)), START)
        stuff = bytes(draw.randrange(4) * 2) + inside
        stuff += bytes(len(stuff) % 2) + bytes(2 * draw.randrange(3))
        count = len(stuff) // 2
        asked, told = draw.choice(
            (
                (struct.pack(">BHH", 3, 0, count), bytes((3, len(stuff))) + stuff),
                (struct.pack(">BHHB", 16, 0, count, len(stuff)) + stuff, struct.pack(">BHH", 16, 0, count)),
                (struct.pack(">BHHHHB", 23, 0, count, 0, count, len(stuff)) + stuff, bytes((23, len(stuff))) + stuff),
                (struct.pack(">BHH", 6, 0, 1), struct.pack(">BHH", 6, 0, 1)),
                (struct.pack(">BHH", 3, 0, 1), b"\x83\x02"),
            )
        )
        unit = draw.choice(FOREIGN)
        for frame in (frame_of(unit, asked), frame_of(unit, told)):
            at = frame.find(inside)
            cuts = sorted(
                {draw.randrange(1, len(frame)) for _ in range(draw.randrange(3))} | ({at} if at > 0 else set())
            )
            cuts = cuts if draw.random() < 0.5 else []
            for start, end in zip([0, *cuts], [*cuts, len(frame)], strict=True):
                self.say(frame[start:end], draw.choice(SPLITS_S) if end < len(frame) else 0.0)
            self._world.run(draw.choice((SILENCE_S, 0.01)))
        return f"unit {unit} {asked.hex()} {told.hex()}", [], 0

    def _given_up(self, draw: Random, pdu: bytes) -> tuple[str, list[bytes], int]:
        """Half of a request, and its master asks for something else when it has given it up."""
        half = frame_of(self.unit, START)[: draw.randrange(1, 12)]
        self.say(half, GIVEN_UP_S)
        if not is_whole(pdu):
            return f"half {half.hex()}", [], 0
        self.say(frame_of(self.unit, pdu))
        return f"half {half.hex()} and {pdu.hex()}", [pdu], 1

    def _stray(self, draw: Random, pdu: bytes) -> tuple[str, list[bytes], int]:
        """A line that floats puts a byte or two before a request."""
        stray = bytes(
            draw.choice((0, 0xFF, 0x55, FOREIGN[0], draw.randrange(256))) for _ in range(draw.randrange(1, 3))
        )
        if not is_whole(pdu) or pdu[0] not in LENGTHS_KNOWN:
            pdu = struct.pack(">BHH", 3, 100, 2)
        self.say(stray + frame_of(self.unit, pdu))
        return f"{stray.hex()} before {pdu.hex()}", [pdu], 1

    def _broken_off(self, draw: Random, _pdu: bytes) -> tuple[str, list[bytes], int]:
        """What another unit is told, or tells, breaks off behind what looks like a request to this one."""
        inside = frame_of(draw.choice((self.unit, 0)), START)
        head = draw.choice((bytes((3, 60)), struct.pack(">BHHB", 16, 0, 30, 60))) + bytes(2 * draw.randrange(3))
        begun = bytes((draw.choice(FOREIGN),)) + head + inside + bytes(draw.randrange(6))
        self.say(begun)
        return f"broken off {begun.hex()}", [], 0

    def _spoiled(self, draw: Random, pdu: bytes) -> tuple[str, list[bytes], int]:
        """A request with a byte that was changed on its way."""
        frame = bytearray(frame_of(self.unit, pdu))
        frame[draw.randrange(len(frame))] ^= 1 << draw.randrange(8)
        self.say(bytes(frame))
        return f"spoiled {bytes(frame).hex()}", [], 0

    def _row(self, draw: Random, pdu: bytes) -> tuple[str, list[bytes], int]:
        """Two masters, or one that waits for no answer: both are executed in order, the last is answered."""
        first = struct.pack(">BHH", 3, 100, draw.randrange(1, 5))
        if not is_whole(pdu) or pdu[0] not in LENGTHS_KNOWN:
            pdu = first
        self.say(frame_of(self.unit, first) + frame_of(self.unit, pdu))
        return f"a row of {first.hex()} {pdu.hex()}", [first, pdu], 1

    def _broadcast_row(self, draw: Random, pdu: bytes) -> tuple[str, list[bytes], int]:
        """A beat for all, and a request right behind it."""
        beat = struct.pack(">BHH", 6, 4, draw.randrange(1, 60000))
        self.say(frame_of(0, beat), SILENCE_S)
        if not is_whole(pdu):
            return f"all {beat.hex()}", [beat], 0
        self.say(frame_of(self.unit, pdu))
        return f"all {beat.hex()} and {pdu.hex()}", [beat, pdu], 1
