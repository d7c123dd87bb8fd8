"""The command block: three faces of one snapshot (int16, float ABCD, float CDAB).

A write is decoded into a candidate, a whole new list of values, and nothing is stored until everything about it has been found
good. What the master reads back is what was accepted, rounded to each face's resolution; a float keeps its digits although the
int16 face cannot show them. Each edge bit (reset, tare, take ownership) reads back as 0, so that writing it again acts again.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import floor, radians
from struct import Struct
from typing import Final

from gateway.codes.refusals import RefusalReason
from gateway.registers.command import Channel, Command
from gateway.registers.image import RegisterImage
from gateway.registers.map.register_map import Block, RegisterMap
from gateway.registers.refusal import Refusal
from gateway.registers.rig_rules import BankRules
from gateway.registers.values import WordOrder, swap_words
from gateway.registers.words import ControlBit, Mode
from gateway.registers.writes.command_field import CommandField, command_field

NAMES: Final = (
    "control_word", "force_setpoint", "force_ramp", "mode", "heartbeat", "voltage_setpoint", "tilt_angle",
    "precontact_force", "contact_ramp", "payload", "command_sequence", "in_band_tolerance", "in_band_time",
)  # fmt: skip
"""Registers of the command block in the order of their offsets: what this code relies on, whatever else a map has."""
UNITS: Final = ("", "N", "N/s", "", "", "mV", "deg", "N", "ms", "g", "", "N", "ms")
"""Unit of each: `command` takes their values in these."""

CONTROL_WORD, FORCE_SETPOINT, MODE, HEARTBEAT, VOLTAGE_SETPOINT, SEQUENCE = 0, 1, 3, 4, 5, 10
_KNOWN_BITS: Final = 1 << 7
_CONTROL_WORDS: Final = tuple(ControlBit(word) for word in range(_KNOWN_BITS))  # building a flag costs a microsecond
_MODES: Final = {mode.value: mode for mode in Mode}
_WORD_STRUCTS: Final = tuple(Struct(f">{count}H") for count in range(129))
_FLOAT_STRUCTS: Final = tuple(Struct(f">{count}f") for count in range(129))

Values = list[float]
"""One value per word of the command block, in the registers' units; 0 in reserved ones."""


class CommandBlock:
    """Accepted values, and their three faces in the image."""

    def __init__(self, register_map: RegisterMap, rules: BankRules, image: RegisterImage) -> None:
        block = register_map.block("command")
        registers = register_map.registers_of("command")
        if tuple((r.name, r.address - block.first) for r in registers) != tuple((n, k) for k, n in enumerate(NAMES)):
            raise ValueError(f"map {register_map.name}: block command must hold {', '.join(NAMES)} in this order")
        if foreign := [
            f"{r.name} in {r.unit or 'counts'}" for r, unit in zip(registers, UNITS, strict=True) if r.unit != unit
        ]:
            known = ", ".join(f"{name} in {unit}" for name, unit in zip(NAMES, UNITS, strict=True) if unit)
            raise ValueError(f"map {register_map.name}: {', '.join(foreign)}; a command is taken with {known}")
        self.values: Values = [0.0] * block.words
        self._shown = self.values
        self._last_words: tuple[int, bytes, Values] = (0, b"", [])  # offset, words, what they mean
        self._registers, self._map = registers, register_map
        self.fields: tuple[CommandField | None, ...] = self._fields(rules)
        self._counts = [field.counts_per_unit if field else 1 for field in self.fields]
        self._image = image
        self._rules = rules
        self.first = block.first
        self._floats = [(b, b.repeats["command"]) for b in register_map.blocks if "command" in b.repeats]

    def allow_force(self, limits_n: Sequence[float], source: str) -> None:
        """Accept from now on setpoints of 0 or limits_n (lowest, highest), whose they are is told by source; forces up to the
        smaller of the rig's limit and theirs, of a lowest beyond the rig's limit none. Empty: the rig's alone."""
        rules = self._rules
        if limits_n:
            high_n = max(0.0, min(limits_n[-1], rules.force_max_n))
            low_n = max(0.0, limits_n[0])
            if low_n > high_n:
                low_n = high_n = 0.0  # no force is in both
            rules = replace(rules, setpoint_min_n=low_n, force_max_n=high_n, force_source=source)
        self.fields = self._fields(rules)
        self._last_words = (0, b"", [])

    def lower_force(self) -> tuple[float, float] | None:
        """Take an accepted setpoint that the limits in use forbid down to the largest allowed that a word can say, which
        may be written as it reads; (before, after), None where it is within them."""
        field, setpoint_n = self.fields[FORCE_SETPOINT], self.values[FORCE_SETPOINT]
        if field is None or setpoint_n <= field.high:
            return None
        lowered = self.values.copy()
        lowered[FORCE_SETPOINT] = self.round_force(field.high)
        self.store(lowered, int(lowered[CONTROL_WORD]))
        return setpoint_n, lowered[FORCE_SETPOINT]

    def round_force(self, force_n: float) -> float:
        """Return the largest force, N, up to this one that a word can say, which may be written as it reads."""
        counts_per_n = self._counts[FORCE_SETPOINT]
        return floor(round(force_n * counts_per_n, 6)) / counts_per_n

    def _fields(self, rules: BankRules) -> tuple[CommandField | None, ...]:
        count, registers = len(self.values), self._registers
        named = (command_field(register, rules, self._map) for register in registers)
        return (*named, *(None,) * (count - len(registers)))

    def holds(self, block: Block, address: int) -> bool:
        """Return whether this address is in a face of the command block, named or reserved."""
        base = block.repeats.get("command")
        return block.first == self.first if base is None else base <= address < base + 2 * len(self.values)

    def address(self, block: Block, offset: int) -> int:
        """Return where a word of the command block is in this face."""
        return self.first + offset if not block.repeats else block.repeats["command"] + 2 * offset

    def offsets(self, block: Block, address: int, count: int) -> range:
        """Return which words of the command block a write of these words sets, reserved ones among them."""
        if not block.repeats:
            return range(address - self.first, address - self.first + count)
        start = (address - block.repeats["command"] + 1) // 2
        return range(start, start + count // 2)

    def names(self, block: Block, address: int, count: int) -> Sequence[str]:
        """Return the registers that a write of these words sets."""
        if not block.repeats:
            return NAMES[address - self.first : address - self.first + count]
        offsets = self.offsets(block, address, count)
        return NAMES[offsets.start : offsets.stop]

    def decode(self, block: Block, address: int, data: bytes) -> Values:
        """Return a candidate: the accepted values with those of this write put over them. Refusal (03) for a bad one."""
        if not block.repeats:
            return self._decode_words(address, data)
        return self._decode_floats(block, address, data)

    def _decode_words(self, address: int, data: bytes) -> Values:
        offset = address - self.first
        known_offset, known_data, values = self._last_words
        if data != known_data or offset != known_offset:  # many masters write the same words over and over
            values = self._judge_words(offset, data)
            self._last_words = (offset, data, values)
        candidate = self.values.copy()
        candidate[offset : offset + len(values)] = values
        return candidate

    def _judge_words(self, offset: int, data: bytes) -> Values:
        values: Values = []
        words = _WORD_STRUCTS[len(data) // 2].unpack(data)
        for at, word in enumerate(words, offset):
            if not word:
                values.append(0.0)  # most are
            elif (field := self.fields[at]) is not None:
                values.append(field.of_word(word, self.first + at))
            else:
                raise reserved_word_refusal(self.first + at, word)
        return values

    def _decode_floats(self, block: Block, address: int, data: bytes) -> Values:
        """Reserved words may be cut (a single 0 is fine); whole values have been seen to by the caller."""
        candidate = self.values.copy()
        start, end = 0, len(data)
        if (address - block.first) % 2:
            start = 2
        end -= (end - start) % 4
        check_zeros(address, data[:start])
        check_zeros(address + end // 2, data[end:])
        middle = data[start:end]
        order = block.word_order
        offset = (address + start // 2 - block.repeats["command"]) // 2
        numbers = _FLOAT_STRUCTS[len(middle) // 4].unpack(middle if order is WordOrder.ABCD else swap_words(middle))
        for k, number in enumerate(numbers):
            field, at = self.fields[offset + k], address + start // 2 + 2 * k
            if field is not None:
                candidate[offset + k] = field.of_float(number, at, order)
            else:
                check_zeros(at, middle[4 * k : 4 * k + 4])
        return candidate

    def check_known(self, values: Values, block: Block) -> None:
        """Refuse bits that the rig does not support, and modes that do not exist (03)."""
        word = int(values[CONTROL_WORD])
        if unsupported := word & ~int(self._rules.supported_bits):
            bit = unsupported.bit_length() - 1
            name = f" ({ControlBit(1 << bit).name})".lower() if 1 << bit < _KNOWN_BITS else ""
            text = f"control_word bit {bit}{name}: not supported by rig {self._rules.rig_name}"
            raise Refusal(RefusalReason.UNSUPPORTED_BIT, self.address(block, CONTROL_WORD), text, value=float(word))
        if values[MODE] not in _MODES:
            known = ", ".join(f"{mode.value} {mode.name.lower()}" for mode in Mode)
            text = f"mode = {values[MODE]:g}, known are {known}"
            raise Refusal(RefusalReason.UNSUPPORTED_BIT, self.address(block, MODE), text, value=values[MODE])

    def store_heartbeat(self, heartbeat: int) -> None:
        """Accept a write that changes no value but this."""
        self.values = self.values.copy()
        self.values[HEARTBEAT] = heartbeat
        self._image.fall_behind()

    def store(self, candidate: Values, control_word: int) -> None:
        """Accept: from now on these are the values. control_word: without its edge bits."""
        candidate[CONTROL_WORD] = control_word
        self.values = candidate
        self._image.fall_behind()

    def show(self) -> None:
        """Pack what has been accepted since the last time into all three faces."""
        before, self._shown = self._shown, self.values
        for offset, value in enumerate(self.values):
            if value != before[offset]:
                self._show(offset, value)

    def _show(self, offset: int, value: float) -> None:
        count = round(value * self._counts[offset]) & 0xFFFF
        self._image.write(self.first + offset, _WORD_STRUCTS[1].pack(count))
        for block, base in self._floats:
            high_first = _FLOAT_STRUCTS[1].pack(value)
            words = high_first if block.word_order is WordOrder.ABCD else swap_words(high_first)
            self._image.write(base + 2 * offset, words)

    def command(
        self, values: Values, control_word: int, number: int, received_s: float, sender: tuple[str, Channel]
    ) -> Command:
        """Return these values in SI units, in the order of NAMES. control_word: as written, edge bits included; sender: who
        writes, by which channel."""
        v = values
        return Command(
            _CONTROL_WORDS[control_word],
            v[1],
            v[2],
            _MODES[int(v[3])],
            int(v[4]),
            v[5] / 1000.0,
            radians(v[6]),
            v[7],
            v[8] / 1000.0,
            v[9] / 1000.0,
            int(v[10]),
            v[11],
            v[12] / 1000.0,
            number,
            received_s,
            *sender,
        )

    def differences(self, before: Values, after: Values) -> str:
        """Return `force_setpoint 0.00 N -> 12.00 N`: what a write changed, heartbeat and sequence apart (they always
        change)."""
        return ", ".join(
            f"{field.name} {field.format(old)} -> {field.format(new)}"
            for k, (field, old, new) in enumerate(zip(self.fields, before, after, strict=True))
            if field is not None and old != new and k not in (HEARTBEAT, SEQUENCE)
        )


def check_zeros(address: int, data: bytes) -> None:
    """Refuse anything but 0 in reserved words (03)."""
    for k in range(0, len(data), 2):
        if word := data[k] << 8 | data[k + 1]:
            raise reserved_word_refusal(address + k // 2, word)


def reserved_word_refusal(address: int, word: int) -> Refusal:
    """Return the refusal of a number other than 0 in a reserved word."""
    text = f"address {address} is reserved: {word} was written, only 0 is accepted"
    return Refusal(RefusalReason.RESERVED, address, text, value=float(word))
