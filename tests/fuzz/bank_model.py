"""What a register bank must answer, said once more from the documented rules: shares no code with the gateway.

Command block, its two float faces, coils, roles apart; the owner; nothing behind it that could refuse an edge.
"""

import struct
from dataclasses import dataclass, field
from math import isfinite

BLOCKS = ((0, 15), (100, 131), (200, 295), (300, 395), (400, 431), (1000, 1199), (1500, 1699))
FORCE_MAX, VOLTAGE_MAX = 60.0, 10_000.0
# counts per unit, signed, low, high
FIELDS = (
    (1, False, 0, 65535), (100, True, 0, FORCE_MAX), (10, True, 0, 3276.7), (1, False, 0, 65535), (1, False, 0, 65535),
    (1, True, 0, VOLTAGE_MAX), (10, True, -180, 180), (100, True, 0, FORCE_MAX), (1, True, 0, 10000), (1, True, 0, 32767),
    (1, False, 0, 65535), (100, True, 0, 327.67), (1, True, 0, 32767),
)  # fmt: skip
PROOF_RESERVED = (401, 430, 431)
STATUS_RESERVED = (
    64,
    65,
    66,
    67,
    74,
    75,
)  # of a float face: owner_ip, and the second half of refusal_value, which none shows
"""Words between 400 and 431 that no register has: 0 may be written to them, as to all reserved words."""
ACTIVE_RESERVED = (1501, 1641, 1646, 1647, 1648, 1649, 1651)
NAMED, FACES = len(FIELDS), {200: "abcd", 300: "cdab"}
ENABLE, TAKE, KNOWN, MOMENTARY = 1, 8, 15, 2 | 4 | 8
Words = list[int]


class Refused(Exception):  # noqa: N818
    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


def single(value: float) -> float:
    return float(struct.unpack(">f", struct.pack(">f", value))[0])


def float_of(words: Words, order: str) -> float:
    high, low = words if order == "abcd" else reversed(words)
    return float(struct.unpack(">f", struct.pack(">HH", high, low))[0])


@dataclass
class BankModel:
    """values: of the 16 words of the command block, in the registers' units. known_bits: of the control word."""

    values: list[float] = field(default_factory=lambda: [0.0] * 16)
    owner: str | None = None
    is_explicit: bool = False
    known_bits: int = KNOWN

    # -- reading

    def face(self, base: int) -> bytes:
        """The 16 words of the command block, or the 32 of a float face."""
        if base == 0:
            scales = [one[0] for one in FIELDS] + [1] * 3
            return struct.pack(">16H", *(round(v * s) & 0xFFFF for v, s in zip(self.values, scales, strict=True)))
        floats = [struct.pack(">f", value) for value in self.values]
        return b"".join(one if FACES[base] == "abcd" else one[2:] + one[:2] for one in floats)

    def check_address(self, address: int, count: int) -> None:
        if not any(first <= address and address + count - 1 <= last for first, last in BLOCKS):
            raise Refused(2)

    # -- writing

    def write(self, address: int, words: Words, host: str) -> None:
        """Raises Refused, and has changed nothing then."""
        self.check_address(address, len(words))
        if not self._is_writable(address, len(words)):
            raise Refused(2)
        if 400 <= address <= 431:
            self._write_proof(address, words)
            return
        base = 0 if address < 100 else address // 100 * 100
        if base not in (0, *FACES) or address - base >= 32:
            if any(words):
                raise Refused(3)
            return
        changed = self._values_of(base, address - base, words)
        covers = self._covers(base, address - base, len(words))
        self._admit(changed, covers, host)

    def _is_writable(self, address: int, count: int) -> bool:
        places = range(address, address + count)
        if 200 <= address <= 395:
            return all(place % 100 < 32 or place % 100 in STATUS_RESERVED for place in places)
        if address >= 1500:
            return all(place in ACTIVE_RESERVED for place in places)
        return address < 100 or all(place in (416, 417) or place in PROOF_RESERVED for place in places)

    def _write_proof(self, address: int, words: Words) -> None:
        given = dict(enumerate(words, address))
        echo = [given.pop(at) for at in (416, 417) if at in given]
        wrong = echo and (len(echo) < 2 or 1234.5 not in (float_of(echo, "abcd"), float_of(echo, "cdab")))
        if wrong or any(given.values()):
            raise Refused(3)

    def _covers(self, base: int, offset: int, count: int) -> range:
        if base == 0:
            return range(offset, offset + count)
        return range((offset + 1) // 2, (offset + 1) // 2 + count // 2)

    def _values_of(self, base: int, offset: int, words: Words) -> list[float]:
        changed = self.values.copy()
        if base == 0:
            for k, word in enumerate(words, offset):
                changed[k] = self._from_word(k, word)
        else:
            self._read_floats(changed, base, offset, words)
        if int(changed[0]) & ~self.known_bits or changed[3] not in (0, 1):
            raise Refused(3)
        return changed

    def _from_word(self, k: int, word: int) -> float:
        if k >= NAMED:
            if word:
                raise Refused(3)
            return 0.0
        scale, signed, low, high = FIELDS[k]
        value = (word - 65536 if signed and word > 32767 else word) / scale
        if value and not low <= value <= high:
            raise Refused(3)
        return value

    def _read_floats(self, changed: list[float], base: int, offset: int, words: Words) -> None:
        last = offset + len(words) - 1
        for k in range(offset // 2, last // 2 + 1):
            pair = [words[at - offset] if offset <= at <= last else None for at in (2 * k, 2 * k + 1)]
            given = [word for word in pair if word is not None]
            if k >= NAMED:
                if any(given):
                    raise Refused(3)
            elif len(given) < 2:
                raise Refused(3)
            else:
                changed[k] = self._from_float(k, float_of(given, FACES[base]))

    def _from_float(self, k: int, value: float) -> float:
        if value == 0.0:
            return 0.0
        _, signed, low, high = FIELDS[k]
        fits = isfinite(value) and min(low, single(low)) <= value <= max(high, single(high)) and abs(value) >= 1e-3
        if not fits or (not signed and value != int(value)):
            raise Refused(3)
        return value

    def _admit(self, changed: list[float], covers: range, host: str) -> None:
        before, word = int(self.values[0]), int(changed[0])
        stops = bool(before & ENABLE and not word & ENABLE)
        takes = bool(word & TAKE)
        if self.owner not in (None, host) and not takes:
            if not stops or word & MOMENTARY:
                if not word and tuple(covers) == (0,):
                    return
                raise Refused(6)
            changed, word, takes = self.values.copy(), 0, False
        if stops:
            changed[1] = changed[5] = 0.0
        elif takes and self.owner != host:  # nothing is ever pressed here
            changed[1], changed[5] = (changed[k] if k in covers else 0.0 for k in (1, 5))
        changed[0] = 0 if stops else word & ~MOMENTARY
        self.values = changed
        self._settle(host, takes, stops)

    def _settle(self, host: str, takes: bool, stops: bool) -> None:
        if takes:
            self.owner, self.is_explicit = host, True
        elif stops:
            self.owner, self.is_explicit = None, False
        elif self.values[0] or self.values[1] or self.values[5]:
            self.owner = host
        elif not self.is_explicit:
            self.owner = None

    # -- requests

    def answer(self, pdu: bytes, host: str) -> int | None:
        """The exception code that answers a request, 0 for none; None where the rules here do not say."""
        try:
            return self._answer(pdu, host)
        except Refused as refused:
            return refused.code

    def _answer(self, pdu: bytes, host: str) -> int | None:
        function = pdu[0]
        if function in (8, 17, 43):
            return None
        if function not in SHAPES:
            return 1
        if not SHAPES[function](pdu):
            return 3
        numbers = struct.unpack(f">{(len(pdu) - 1) // 2}H", pdu[1 : 1 + (len(pdu) - 1) // 2 * 2])
        return _ACTS[function](self, pdu, numbers, host)

    def read(self, _pdu: bytes, numbers: tuple[int, ...], _host: str) -> int:
        self.check_address(*numbers[:2])
        return 0

    def read_bits(self, _pdu: bytes, numbers: tuple[int, ...], _host: str) -> int:
        self._check_bits(*numbers[:2])
        return 0

    def _check_bits(self, address: int, count: int) -> None:
        if not any(first <= address and address + count <= first + 16 for first in (0, 100)):
            raise Refused(2)

    def write_words(self, pdu: bytes, numbers: tuple[int, ...], host: str) -> int | None:
        words = list(numbers[1:2]) if pdu[0] == 6 else list(struct.unpack(f">{numbers[1]}H", pdu[6:]))
        return self._write_or_skip(numbers[0], words, host)

    def _write_or_skip(self, address: int, words: Words, host: str) -> int | None:
        if 1000 <= address <= 1199:
            return None  # staging has a fuzz of its own
        self.write(address, words, host)
        return 0

    def write_coils(self, pdu: bytes, numbers: tuple[int, ...], host: str) -> int:
        address, count = numbers[0], numbers[1] if pdu[0] == 15 else 1
        self._check_bits(address, count)
        if pdu[0] == 5 and numbers[1] not in (0, 0xFF00):
            raise Refused(3)
        if address >= 100:
            raise Refused(2)
        bits = int.from_bytes(pdu[6:], "little") if pdu[0] == 15 else int(numbers[1] == 0xFF00)
        mask = (1 << count) - 1
        word = int(self.values[0]) & ~(mask << address) | (bits & mask) << address
        self.write(0, [word], host)
        return 0

    def mask(self, _pdu: bytes, numbers: tuple[int, ...], host: str) -> int | None:
        address, and_mask, or_mask = numbers
        self.check_address(address, 1)
        base = 0 if address < 100 else address // 100 * 100
        place = 2 * (address - base)
        known = (
            self.face(base)[place : place + 2] if base in (0, *FACES) else b""
        )  # beyond: reserved words, which are 0
        word = int.from_bytes(known, "big")
        return self._write_or_skip(address, [word & and_mask | or_mask & ~and_mask & 0xFFFF], host)

    def read_write(self, pdu: bytes, numbers: tuple[int, ...], host: str) -> int | None:
        self.check_address(*numbers[:2])
        return self._write_or_skip(numbers[2], list(struct.unpack(f">{numbers[3]}H", pdu[10:])), host)


def _counts(most: int, head: int) -> "Shape":
    return lambda pdu: len(pdu) == head and 1 <= int.from_bytes(pdu[3:5], "big") <= most


def _carries(most: int, at: int, per_item: float) -> "Shape":
    def check(pdu: bytes) -> bool:
        if len(pdu) <= at + 2 or not 1 <= (count := int.from_bytes(pdu[at : at + 2], "big")) <= most:
            return False
        size = 2 * count if per_item == 2 else -(-count // 8)
        return pdu[at + 2] == size == len(pdu) - at - 3

    return check


def _read_write_shape(pdu: bytes) -> bool:
    return len(pdu) > 9 and 1 <= int.from_bytes(pdu[3:5], "big") <= 125 and _carries(121, 7, 2)(pdu)


Shape = type(_read_write_shape)
SHAPES = {
    1: _counts(2000, 5), 2: _counts(2000, 5), 3: _counts(125, 5), 4: _counts(125, 5), 5: lambda pdu: len(pdu) == 5,
    6: lambda pdu: len(pdu) == 5, 15: _carries(1968, 3, 1 / 8), 16: _carries(123, 3, 2), 22: lambda pdu: len(pdu) == 7,
    23: _read_write_shape,
}  # fmt: skip
_ACTS = {
    1: BankModel.read_bits, 2: BankModel.read_bits, 3: BankModel.read, 4: BankModel.read, 5: BankModel.write_coils,
    6: BankModel.write_words, 15: BankModel.write_coils, 16: BankModel.write_words, 22: BankModel.mask,
    23: BankModel.read_write,
}  # fmt: skip


def assert_nothing_changed(before: bytes, now: bytes, pdu: bytes) -> None:
    """Of the bank's image, but for the registers that tell of the refusal itself, in three faces."""
    after = bytearray(now)
    for first, size in ((118, 4), (268, 8), (368, 8)):
        after[2 * first : 2 * (first + size)] = before[2 * first : 2 * (first + size)]
    assert after == before, pdu.hex()
