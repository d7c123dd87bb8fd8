"""One register of the command block: words -> a value that may be used, or the refusal that says why not.

Checked before a value is looked at any further: finite, in range, whole where it counts something, and in the right word order.
12.0 N with its words swapped reads 2.34e-41 N, which is in range: hence no float between 0 and 1e-3 is accepted.
A float is taken as the decimal that it stands for: 40.2 as float32 is a little more than a limit of 40.2, and 2.3 a little
less than a least force of 2.3, and neither is what the master means.
0 is always in range; it means "the rig's default" or "nothing".
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import floor, inf, isfinite
from typing import Final

from gateway.codes.refusals import RefusalReason
from gateway.registers.map.register_map import Register, RegisterMap
from gateway.registers.refusal import Refusal, allowed_range, quantity
from gateway.registers.rig_rules import BankRules
from gateway.registers.values import WordOrder, decimal, float32, pack_number, unpack_number

SMALLEST_MEANT: Final = 1.0e-3
FORCES: Final = ("force_setpoint", "precontact_force")


@dataclass(frozen=True, slots=True)
class CommandField:
    """low, high: limits of map and rig in the register's unit; float_low, float_high: the same after rounding to float32."""

    name: str
    counts_per_unit: int
    is_signed: bool
    is_whole: bool
    low: float
    high: float
    float_low: float
    float_high: float
    unit: str
    decimals: int
    limit_source: str
    values: Mapping[int, str]
    cures: Mapping[WordOrder, str]

    def of_word(self, word: int, address: int) -> float:
        """Return the value of one int16 or uint16 register."""
        if self.is_signed and word >= 0x8000:
            word -= 0x10000
        value = word / self.counts_per_unit
        if self.low <= value <= self.high or not value:
            return value
        raise self._out_of_range(value, address)

    def of_float(self, value: float, address: int, order: WordOrder) -> float:
        """Return the value of one float register, decoded already."""
        if not value:
            return 0.0  # -0.0 too
        if self.float_low <= value <= self.float_high and (value >= SMALLEST_MEANT or value <= -SMALLEST_MEANT):
            if value == int(value):
                return value
            if not self.is_whole:
                return max(self.low, min(self.high, decimal(value)))
            raise Refusal(
                RefusalReason.OUT_OF_RANGE, address, f"{self.name} = {value:g} is not a whole number", value=value
            )
        raise self._not_a_value(value, address, order)

    def format(self, value: float) -> str:
        """Return `12.00 N`, or `1 (voltage)` for an enumeration."""
        name = self.values.get(int(value)) if self.values and isfinite(value) else None
        return quantity(value, self.decimals, self.unit) + (f" ({name})" if name else "")

    def _not_a_value(self, value: float, address: int, order: WordOrder) -> Refusal:
        if self._is_plausible(swapped := _swap_words_of_float(value)):
            value_text = f"{self.format(value)}; with the words swapped {self.format(swapped)}"
            text = f"{value_text}: your client sends {self.cures[order]} ({self.name} at {address})"
            return Refusal(RefusalReason.WORDS_SWAPPED, address, text, value=value)
        if not isfinite(value):
            return Refusal(
                RefusalReason.NOT_FINITE, address, f"{self.name} = {value} is not a number to command", value=value
            )
        if self.float_low <= value <= self.float_high:
            text = f"{self.name} = {self.format(value)} is too small to be meant: swapped words, or an integer sent as a float?"
            return Refusal(RefusalReason.TOO_SMALL, address, text, value=value)
        return self._out_of_range(value, address)

    def _is_plausible(self, value: float) -> bool:
        return self.float_low <= value <= self.float_high and abs(value) >= SMALLEST_MEANT

    def _out_of_range(self, value: float, address: int) -> Refusal:
        allowed = ("0 and " if self.low > 0.0 else "") + allowed_range(self.low, self.high, self.unit)
        shown = self.format(value)
        if self.low <= round(value, self.decimals) <= self.high:  # these digits would name a value that is allowed
            shown = f"{decimal(value)} {self.unit}".rstrip()
        text = f"{self.name} = {shown}, allowed {allowed} ({self.limit_source})"
        return Refusal(RefusalReason.OUT_OF_RANGE, address, text, value=value)


def _cures(register_map: RegisterMap) -> dict[WordOrder, str]:
    """Return {word order of a block: what a client that writes the other one there sends, and what helps}."""
    high, low = register_map.name_float_block(WordOrder.ABCD), register_map.name_float_block(WordOrder.CDAB)
    return {WordOrder.ABCD: f"CDAB, use {low} or mbpoll -B", WordOrder.CDAB: f"ABCD, use {high} or mbpoll without -B"}


def _swap_words_of_float(value: float) -> float:
    """Return the same four bytes read in the other word order."""
    return float(unpack_number("float32", WordOrder.CDAB, pack_number("float32", WordOrder.ABCD, value)))


def command_field(register: Register, rules: BankRules, register_map: RegisterMap) -> CommandField:
    """Return the register's limits narrowed by the rig's. Enumerations keep the type's range: what they lack is refused
    by name."""
    low, high = register.minimum or 0.0, register.maximum if register.maximum is not None else 65535.0
    source = f"map {register_map.name}"
    rig_low, rig_high = _rig_limits(register.name, rules) or (low, high)
    if rig_low > low or rig_high < high:
        low, high, source = max(low, rig_low), min(high, rig_high), _source(register.name, rules)
    if register.values:
        low, high = 0.0, 65535.0
    return CommandField(
        name=register.name,
        counts_per_unit=register.counts_per_unit,
        is_signed=register.type == "int16",
        is_whole=register.type == "uint16" and register.scale == 1.0,
        low=low,
        high=high,
        float_low=min(low, float32(low)),
        float_high=max(high, float32(high)),
        unit=register.unit,
        decimals=register.decimals,
        limit_source=source,
        values=register.values,
        cures=_cures(register_map),
    )


def _source(name: str, rules: BankRules) -> str:
    return rules.force_source if name in FORCES and rules.force_source else f"rig {rules.rig_name}"


def _rig_limits(name: str, rules: BankRules) -> tuple[float, float] | None:
    if name in FORCES:
        if name == FORCES[0] and rules.setpoint_min_n > 0.0:
            return rules.setpoint_min_n, rules.force_max_n
        return 0.0, rules.force_max_n
    if name == "payload":
        return 0.0, floor(1000.0 * rules.payload_max_kg) if isfinite(rules.payload_max_kg) else inf
    if name != "voltage_setpoint":
        return None
    return _millivolts(rules.voltage_min_v), _millivolts(rules.voltage_max_v)


def _millivolts(volts: float) -> float:
    """1000 times 8.03 is a little less than 8030, which is meant."""
    return round(1000.0 * volts, 6)
