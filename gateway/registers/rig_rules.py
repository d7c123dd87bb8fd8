"""What a rig adds to the map: narrower limits, who may command, which bits have something behind them."""

from dataclasses import dataclass
from math import inf
from typing import Final

from gateway import defaults
from gateway.registers.words import ControlBit

BASIC_BITS: Final = ControlBit.ENABLE | ControlBit.RESET_FAULT | ControlBit.TARE | ControlBit.TAKE_OWNERSHIP


@dataclass(frozen=True, slots=True, kw_only=True)
class BankRules:
    """force_max_n bounds force_setpoint and precontact_force; voltage_setpoint is 0 or within the voltage limits.
    payload_max_kg bounds payload: what the load cell bears.

    setpoint_min_n: smallest force_setpoint beside 0. force_source: who says these two, empty for the rig. owner: the one host
    that may command, None for the first that does. has_lease: a master has to beat.
    """

    rig_name: str
    force_max_n: float
    setpoint_min_n: float = 0.0
    force_source: str = ""
    voltage_min_v: float = 0.0
    voltage_max_v: float = defaults.VOLTAGE_MAX_V
    payload_max_kg: float = inf
    supported_bits: ControlBit = BASIC_BITS
    require_byte_order_echo: bool = False
    owner: str | None = None
    has_lease: bool = False
