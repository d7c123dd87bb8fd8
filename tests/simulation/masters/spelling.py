"""How masters spell one and the same command: every function of Modbus that writes, words, floats in both orders, coils.

A way gives the requests that begin a command, in their order, and the one that beats from then on.
"""

import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from math import isfinite, nan
from typing import NamedTuple

WRITES = frozenset((5, 6, 15, 16, 22, 23))
WORDS = {6: slice(3, 5), 16: slice(6, None), 23: slice(10, None)}
"""Where a request that writes words has them, by its function."""
ENABLE = 1
DISABLED_BY_BIT, BITS = -2, -1
"""Stand for a control word that nobody can tell from the request: of enable only it is known that it is cleared, or nothing."""


def write_pdu(address: int, *words: int) -> bytes:
    """FC16."""
    count = len(words)
    return struct.pack(f">BHHB{count}H", 16, address, count, 2 * count, *[word & 0xFFFF for word in words])


def write_one_pdu(address: int, word: int) -> bytes:
    """FC06."""
    return struct.pack(">BHH", 6, address, word & 0xFFFF)


def read_pdu(address: int, count: int) -> bytes:
    """FC03."""
    return struct.pack(">BHH", 3, address, count)


def read_and_write_pdu(first: int, count: int, address: int, *words: int) -> bytes:
    """FC23."""
    return struct.pack(">BHH", 23, first, count) + write_pdu(address, *words)[1:]


def mask_pdu(address: int, kept: int, word: int) -> bytes:
    """FC22: the bits of `kept` stay, the others become those of word."""
    return struct.pack(">BHHH", 22, address, kept & 0xFFFF, word & ~kept & 0xFFFF)


def coil_pdu(number: int, *, on: bool) -> bytes:
    """FC05."""
    return struct.pack(">BHH", 5, number, 0xFF00 if on else 0)


def coils_pdu(number: int, bits: int, count: int) -> bytes:
    """FC15."""
    return struct.pack(">BHHBB", 15, number, count, 1, bits & ((1 << count) - 1))


def floats_pdu(address: int, *numbers: float, is_swapped: bool) -> bytes:
    """FC16 on float32 values, high word first or low word first."""
    words = struct.unpack(f">{2 * len(numbers)}H", struct.pack(f">{len(numbers)}f", *numbers))
    if is_swapped:
        words = tuple(word for high, low in zip(words[::2], words[1::2], strict=True) for word in (low, high))
    return write_pdu(address, *words)


class Wish(NamedTuple):
    """What a master commands. voltage_v: drive this instead of a force, None for a force; beat: its heartbeat;
    program: of one that writes its whole block, in counts: ramp, force before contact, ramp from the contact on, width of the
    band and time in it."""

    control: int
    force_n: float
    beat: int
    voltage_v: float | None = None
    program: tuple[int, ...] = ()

    @property
    def words(self) -> tuple[int, ...]:
        if self.program:
            ramp, before_n, contact_ms, *band = self.program
            block = (self.control, round(100 * self.force_n), ramp, 0, self.beat, 0)
            return (*block, 0, before_n, contact_ms, 0, self.beat & 0x7FFF, *band)
        block = (self.control, round(100 * self.force_n), 0)
        return (*block, 0, self.beat) if self.voltage_v is None else (*block, 1, self.beat, round(1e3 * self.voltage_v))

    @property
    def numbers(self) -> tuple[float, ...]:
        return (float(self.control), self.force_n, 0.0, float(self.voltage_v is not None), float(self.beat & 0xFFFF))


@dataclass(frozen=True)
class Way:
    """begin: the requests of a new command; beat: what is sent again and again, all of it where nothing else is given."""

    begin: Callable[[Wish], tuple[bytes, ...]]
    beat: Callable[[Wish], bytes] | None = None


def _beat(wish: Wish) -> bytes:
    return write_one_pdu(4, wish.beat)


WAYS: dict[str, Way] = {
    "block": Way(lambda wish: (write_pdu(0, *wish.words),)),
    "read_and_write": Way(lambda wish: (read_and_write_pdu(100, 11, 0, *wish.words),)),
    "floats": Way(lambda wish: (floats_pdu(200, *wish.numbers, is_swapped=False),)),
    "swapped": Way(lambda wish: (floats_pdu(300, *wish.numbers, is_swapped=True),)),
    "singles": Way(lambda wish: (write_one_pdu(1, wish.words[1]), write_one_pdu(0, wish.control)), _beat),
    "mask": Way(
        lambda wish: (write_pdu(1, *wish.words[1:]), mask_pdu(0, ~(wish.control | ENABLE), wish.control)),
        lambda wish: mask_pdu(4, 0, wish.beat),
    ),
    "coil": Way(lambda wish: (write_pdu(1, *wish.words[1:]), coil_pdu(0, on=bool(wish.control & ENABLE))), _beat),
    "coils": Way(lambda wish: (write_pdu(1, *wish.words[1:]), coils_pdu(0, wish.control, 5)), _beat),
}


once_each = lru_cache(4096)
"""Of what several judges ask of one and the same request."""


def written_address(pdu: bytes) -> int:
    """The first address that a write changes."""
    return int.from_bytes(pdu[5:7] if pdu[0] == 23 else pdu[1:3])


def written_words(pdu: bytes) -> bytes:
    """The words that a write carries, nothing of another request."""
    return pdu[WORDS[pdu[0]]] if pdu[0] in WORDS else b""


MODE, BEAT = 3, 4


@once_each
def word_of(pdu: bytes, place: int) -> float | None:
    """What a write would set this word of the command to; None where it is not among what it writes, not a number where nobody
    can tell."""
    data = written_words(pdu)
    address = written_address(pdu)
    if pdu[0] == 22:
        return nan if address == place or address >= 200 else None
    if data and address <= place and len(data) >= 2 * (place + 1 - address):
        return float(struct.unpack_from(">H", data, 2 * (place - address))[0])
    for first in (200 + 2 * place, 300 + 2 * place):
        at = 2 * (first - address)
        if data and -2 <= at < len(data):
            four = data[at : at + 4] if at >= 0 else b""
            four = four if first < 300 else four[2:] + four[:2]
            return float(struct.unpack(">f", four)[0]) if len(four) == 4 else nan
    return None


def setpoints_of(pdu: bytes) -> tuple[float, ...]:
    """What a write would set force_setpoint to, in its counts; not a number where that cannot be told from the request."""
    if pdu[0] == 22 and pdu[1:3] == b"\x00\x01":
        return (nan,)
    data = written_words(pdu)
    address = written_address(pdu)
    if data and address <= 1 and len(data) >= 2 * (2 - address):
        return struct.unpack_from(">h", data, 2 * (1 - address))
    for first in (202, 302):
        if data and first - 2 <= address <= first and len(data) >= 2 * (first - address) + 4:
            four = data[2 * (first - address) :][:4]
            number = struct.unpack(">f", four if first == 202 else four[2:] + four[:2])[0]
            return (100.0 * number,) if isfinite(number) else ()
    return ()


PAYLOAD = (9, 1), (218, 2), (318, 2)
TILT = (6, 1), (212, 2), (312, 2)
"""Where they stand, and in how many words."""


def hangs_payload(pdu: bytes) -> bool:
    """Decide whether a write may set another payload than 0, whose weight then counts as the cell's zero."""
    return any(map(any, _told_at(PAYLOAD, pdu)))


def tells_weight(pdu: bytes) -> bool:
    """Decide whether a write tells a payload or a tilt, 0 as well."""
    return any(_told_at(PAYLOAD + TILT, pdu))


def takes_set(pdu: bytes) -> bool:
    """Decide whether a master commits what others have staged, or selects a slot."""
    return pdu[0] == 6 and written_address(pdu) in (1145, 1149)


def _told_at(places: tuple[tuple[int, int], ...], pdu: bytes) -> Iterator[bytes]:
    """What a write tells of each of these places, and how it is masked; nothing of those that it leaves alone."""
    data, address = pdu[3:7] if pdu[0] == 22 else written_words(pdu), written_address(pdu)
    at = [(2 * (first - address), 2 * count) for first, count in places if first >= address] if data else []
    return (data[begin : begin + count] for begin, count in at)


@once_each
def control_of(pdu: bytes) -> int | None:
    """The control word that a write would set, None where it is not among what it writes; BITS where it changes single bits,
    DISABLED_BY_BIT where enable is cleared among them."""
    if pdu[0] not in WRITES or len(pdu) < (10 if pdu[0] == 23 else 5):
        return None
    address = struct.unpack_from(">H", pdu, 5 if pdu[0] == 23 else 1)[0]
    if pdu[0] in (5, 15, 22):
        return None if address >= 16 or (pdu[0] == 22 and address) else _bits_of(pdu, address)
    data = written_words(pdu)
    if address in (200, 300) and len(data) >= 4:
        number = struct.unpack(">f", data[:4] if address == 200 else data[2:4] + data[:2])[0]
        return int(number) if isfinite(number) and 0 <= number < 65536 else BITS
    return struct.unpack_from(">H", data)[0] if address == 0 and len(data) >= 2 else None


def _bits_of(pdu: bytes, address: int) -> int:
    """Whether a write of single bits clears enable: coil 0, or bit 0 of the word."""
    word = struct.unpack_from(">H", pdu, 3)[0]
    if pdu[0] == 22:
        is_cleared = len(pdu) >= 7 and not (word | struct.unpack_from(">H", pdu, 5)[0]) & ENABLE
    elif pdu[0] == 5:
        is_cleared = address == 0 and word == 0
    else:
        is_cleared = address == 0 and len(pdu) > 6 and not pdu[6] & ENABLE
    return DISABLED_BY_BIT if is_cleared else BITS
