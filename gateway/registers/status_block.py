"""The status block and its two float faces: a Status in, packed words out, in microseconds.

What the bank knows itself (owner, last refusal) lies between the published registers and is written when it changes; a publish
leaves it alone. What is not finite is unavailable: NaN, or 0x8000 in int16 (0 in counters). A measured value beyond int16 is
clamped there, and exact in the float blocks.
"""

from collections.abc import Sequence
from math import isfinite
from operator import attrgetter, mul
from struct import Struct
from struct import error as PackError  # noqa: N812
from typing import Final, NamedTuple

from gateway.modbus import Peer
from gateway.registers.command import Status
from gateway.registers.image import RegisterImage
from gateway.registers.map.register_map import Register, RegisterMap
from gateway.registers.refusal import Refusal
from gateway.registers.values import (
    RAW_LIMITS,
    UNAVAILABLE_INT16,
    WordOrder,
    carried_by_float32,
    words_swapped_from_little_endian,
)
from gateway.registers.writes.ownership import ip_number

_SOURCES: Final = {
    "status_word": "status_word",
    "state": "state",
    "force_measured": "force_measured_n",
    "force_requested": "force_requested_n",
    "force_accepted": "force_accepted_n",
    "force_applied": "force_applied_n",
    "output_voltage": "output_voltage_v",
    "feedforward": "feedforward_v",
    "trim": "trim_v",
    "limited_by": "limited_by",
    "fault_code": "fault_code",
    "warning_word": "warning_word",
    "sample_age": "sample_age_s",
    "loop_time": "loop_time_s",
    "heartbeat_echo": "heartbeat_echo",
    "sequence_echo": "sequence_echo",
    "calibration_id": "calibration_id",
    "model_residual": "model_residual_n",
    "pressure": "pressure_pa",
    "missed_ticks": "missed_ticks",
    "calibration_phase": "calibration_phase",
    "calibration_progress": "calibration_progress",
    "calibration_stored": "calibration_stored",
    "residual_cause": "residual_cause",
    "calibration_time_left": "calibration_time_left_s",
    "plant_id": "plant_id",
}
"""Register -> field of Status."""

_UNITS_PER_SI: Final = {
    "": 1.0,
    "N": 1.0,
    "s": 1.0,
    "mV": 1.0e3,
    "ms": 1.0e3,
    "us": 1.0e6,
    "kPa": 1.0e-3,
    "permille": 1.0e3,
}
BANK_REGISTERS: Final = ("owner_ip", "refusal_address", "refusal_reason", "refusal_value")


class _Scale(NamedTuple):
    """From a field of Status to its register's unit, and on to counts."""

    units_per_si: float
    counts_per_unit: int
    low: int
    high: int
    unavailable: int

    def count(self, number: float) -> int:
        """What the register shows of any number, also of one that it does not carry."""
        count = number * self.counts_per_unit
        if self.low <= count <= self.high:
            return round(count)
        if not isfinite(number):
            return self.unavailable
        return self.high if count > self.high else self.low


class _Run(NamedTuple):
    """Neighbouring published registers, packed in one go: which of them (end: one behind), and where each face has them."""

    first: int
    end: int
    words: Struct
    words_at: int
    high_first: Struct
    high_first_at: int
    low_first: Struct
    low_first_at: int


class StatusBlock:
    """Raises ValueError for a map that lacks a register which the bank or control fills."""

    def __init__(self, register_map: RegisterMap, image: RegisterImage) -> None:
        registers = {register.name: register for register in register_map.registers_of("status")}
        if missing := [name for name in (*_SOURCES, *BANK_REGISTERS) if name not in registers]:
            raise ValueError(f"map {register_map.name}: block status lacks {', '.join(missing)}")
        published = [register for register in registers.values() if register.name in _SOURCES]
        if foreign := [f"{each.name} in {each.unit}" for each in published if each.unit not in _UNITS_PER_SI]:
            known = ", ".join(unit for unit in _UNITS_PER_SI if unit)
            raise ValueError(f"map {register_map.name}: {', '.join(foreign)}; status is published in {known}")
        self._image = image
        self._fields = attrgetter(*(_SOURCES[register.name] for register in published))
        self._scales = tuple(_scale(register) for register in published)
        self._units_per_si = tuple(scale.units_per_si for scale in self._scales)
        self._counts_per_unit = tuple(scale.counts_per_unit for scale in self._scales)
        self._runs = tuple(_runs(register_map, published))
        self._own = {name: _faces(register_map, name) for name in BANK_REGISTERS}
        self._shown_owner: tuple[str | None, str] | None = None
        self._watchdogs = next((one for one in register_map.registers if one.name == "watchdogs"), None)

    def publish(self, status: Status) -> None:
        """Write everything that control and service know into all three faces."""
        numbers = list(map(mul, self._fields(status), self._units_per_si))
        try:
            counts = list(map(round, map(mul, numbers, self._counts_per_unit)))
            if UNAVAILABLE_INT16 in counts:
                raise OverflowError
            self._pack(counts, numbers)
        except (ValueError, OverflowError, PackError):  # one is no number, or more than its register carries
            counts = [scale.count(number) for scale, number in zip(self._scales, numbers, strict=True)]
            self._pack(counts, [carried_by_float32(number) for number in numbers])

    def _pack(self, counts: Sequence[int], numbers: Sequence[float]) -> None:
        data = self._image.data
        for run in self._runs:
            floats = numbers[run.first : run.end]
            run.words.pack_into(data, run.words_at, *counts[run.first : run.end])
            run.high_first.pack_into(data, run.high_first_at, *floats)
            low_first = words_swapped_from_little_endian(run.low_first.pack(*floats))
            data[run.low_first_at : run.low_first_at + len(low_first)] = low_first

    def show_owner(self, owner: str | None, commander: Peer) -> None:
        """Show who may command, and from where: its IPv4 address as a number, 0 for nobody. commander: the owner that commanded
        last; one by its certificate may come from another address than before."""
        shown = owner, commander.host
        if shown == self._shown_owner:
            return
        self._shown_owner = shown
        is_known = commander.identity == owner  # else the rig names it, and it has not commanded
        self._put("owner_ip", ip_number(commander.host if is_known else owner))

    def show_watchdogs(self, word: int) -> None:
        """Show which watchdogs watch the output (WatchdogBit); a map of one's own may leave the register out."""
        if self._watchdogs is not None:
            self._image.put(self._watchdogs, word)

    def show_refusal(self, refusal: Refusal) -> None:
        """Show the last refused write: its address, reason and value."""
        self._put("refusal_address", refusal.address)
        self._put("refusal_reason", refusal.reason)
        self._put("refusal_value", refusal.value)

    def _put(self, name: str, value: float) -> None:
        for register in self._own[name]:
            self._image.put(register, value)


def _scale(register: Register) -> _Scale:
    low, high = RAW_LIMITS[register.type]
    unavailable = UNAVAILABLE_INT16 if register.type == "int16" else 0
    return _Scale(_UNITS_PER_SI[register.unit], register.counts_per_unit, low, high, unavailable)


def _faces(register_map: RegisterMap, name: str) -> tuple[Register, ...]:
    """Return the register in the status block, and where a float face repeats it."""
    blocks = {"status", *(block.name for block in register_map.blocks if "status" in block.repeats)}
    return tuple(register for register in register_map.registers if register.name == name and register.block in blocks)


def _runs(register_map: RegisterMap, published: Sequence[Register]) -> list[_Run]:
    first = register_map.block("status").first
    bases = {b.word_order: b.repeats["status"] for b in register_map.blocks if "status" in b.repeats}
    if set(bases) != set(WordOrder):
        raise ValueError(f"map {register_map.name}: status is not repeated as float in both word orders")
    breaks = [0, *(k for k in range(1, len(published)) if published[k].address != published[k - 1].address + 1)]
    runs = []
    for start, stop in zip(breaks, [*breaks[1:], len(published)], strict=True):
        count, offset = stop - start, published[start].address - first
        high, low = (2 * (bases[order] + 2 * offset) for order in (WordOrder.ABCD, WordOrder.CDAB))
        letters = ("h" if register.type == "int16" else "H" for register in published[start:stop])
        words, floats, little = Struct(f">{''.join(letters)}"), Struct(f">{count}f"), Struct(f"<{count}f")
        runs.append(_Run(start, stop, words, 2 * published[start].address, floats, high, little, low))
    return runs
