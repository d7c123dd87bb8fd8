"""One line of state: live where there is a terminal, one a second and one for each change where there is none, or JSON."""

import json
import shutil
import sys
from math import isnan
from typing import Any, Final

from gateway.cli.force_hold.sequence import SeenStatus
from gateway.codes.warning_bits import WarningBit
from gateway.registers.words import LimitedBy, State, StatusBit

_PLAIN_S: Final = 1.0
_ERASE: Final = "\r\x1b[K"


def describe_state(seen: SeenStatus) -> str:
    """Return `holding    11.98 N of 12.00 N   1.512 V   in band`, and what limits or warns."""
    parts = [f"{seen.state.name.lower():<11}", f"{_number(seen.force_n, 2)} N of {_number(seen.setpoint_n, 2)} N"]
    parts += [f"  {_number(seen.voltage_v, 3)} V", "  in band" if seen.bits & StatusBit.IN_BAND else "  not in band"]
    if seen.limited_by is not LimitedBy.NONE:
        parts.append(f"  limited by {seen.limited_by.name.lower().replace('_', ' ')}")
    if seen.state is State.FAULT:
        parts.append(f"  {seen.fault.code or seen.fault.name}")
    parts += [f"  {code}" for code in _warnings(seen)]
    return " ".join(parts)


def document(seen: SeenStatus, time_s: float) -> dict[str, Any]:
    """Return the same as JSON; None where the gateway has no value."""
    numbers = {
        "force_n": seen.force_n,
        "setpoint_n": seen.setpoint_n,
        "applied_n": seen.applied_n,
        "voltage_v": seen.voltage_v,
    }
    return {
        "time_s": round(time_s, 3),
        "state": seen.state.name.lower(),
        **{name: None if isnan(value) else round(value, 4) for name, value in numbers.items()},
        "in_band": bool(seen.bits & StatusBit.IN_BAND),
        "limited_by": seen.limited_by.name.lower(),
        "fault": seen.fault.code or None,
        "warnings": _warnings(seen),
    }


def _number(value: float, decimals: int) -> str:
    return "-" if isnan(value) else f"{value:.{decimals}f}"


def _warnings(seen: SeenStatus) -> list[str]:
    return [bit.code for bit in WarningBit if seen.warnings & bit]


class StateLine:
    """Writes to stdout. A reader that has gone ends it with BrokenPipeError, which the caller takes for a stop."""

    def __init__(self, *, as_json: bool) -> None:
        self._as_json = as_json
        self._is_live = sys.stdout.isatty() and not as_json
        self._last_s, self._last_kind = -_PLAIN_S, ()

    def show(self, seen: SeenStatus, time_s: float) -> None:
        """time_s: since the start."""
        if self._as_json:
            self._put(json.dumps(document(seen, time_s)) + "\n")
        elif self._is_live:
            self._put(_ERASE + describe_state(seen)[: shutil.get_terminal_size().columns - 1])
        elif time_s - self._last_s >= _PLAIN_S or _kind(seen) != self._last_kind:
            self._last_s, self._last_kind = time_s, _kind(seen)
            self._put(f"{time_s:7.1f} s  {describe_state(seen)}\n")

    def close(self) -> None:
        """The live line stays, and what follows begins below it."""
        if self._is_live:
            self._put("\n")

    def _put(self, text: str) -> None:
        sys.stdout.write(text)
        sys.stdout.flush()


def _kind(seen: SeenStatus) -> tuple[Any, ...]:
    return seen.state, bool(seen.bits & StatusBit.IN_BAND), seen.limited_by, seen.warnings
