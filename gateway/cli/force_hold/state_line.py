"""One line of state: live where there is a terminal, one a second and one for each change where there is none, or JSON."""

import json
import shutil
import sys
from math import isnan
from typing import Any, Final

from gateway.cli.force_hold.sequence import StatusReading
from gateway.cli.terminal import can_write_over
from gateway.codes.warning_bits import WarningBit
from gateway.registers.words import LimitedBy, State, StatusBit

_PLAIN_S: Final = 1.0
_ERASE: Final = "\r\x1b[K"


def describe_state(status: StatusReading) -> str:
    """Return `holding    11.98 N of 12.00 N   1.512 V   in band`, and what limits or warns."""
    parts = [f"{status.state.name.lower():<11}", f"{_number(status.force_n, 2)} N of {_number(status.setpoint_n, 2)} N"]
    parts += [
        f"  {_number(status.voltage_v, 3)} V",
        "  in band" if status.bits & StatusBit.IN_BAND else "  not in band",
    ]
    if status.limited_by is not LimitedBy.NONE:
        parts.append(f"  limited by {status.limited_by.name.lower().replace('_', ' ')}")
    if status.state is State.FAULT:
        parts.append(f"  {status.fault.code or status.fault.name}")
    parts += [f"  {code}" for code in _warnings(status)]
    return " ".join(parts)


def document(status: StatusReading, time_s: float) -> dict[str, Any]:
    """Return the status as a JSON object; None where the gateway has no value."""
    numbers = {
        "force_n": status.force_n,
        "setpoint_n": status.setpoint_n,
        "applied_n": status.applied_n,
        "voltage_v": status.voltage_v,
    }
    return {
        "time_s": round(time_s, 3),
        "state": status.state.name.lower(),
        **{name: None if isnan(value) else round(value, 4) for name, value in numbers.items()},
        "in_band": bool(status.bits & StatusBit.IN_BAND),
        "limited_by": status.limited_by.name.lower(),
        "fault": status.fault.code or None,
        "warnings": _warnings(status),
    }


def _within(line: str, width: int) -> str:
    """Return a line that fits: on a narrow terminal with its columns close together. A line that goes on below itself could
    not be written over."""
    return (line if len(line) <= width else " ".join(line.split()))[:width]


def _number(value: float, decimals: int) -> str:
    return "-" if isnan(value) else f"{value:.{decimals}f}"


def _warnings(status: StatusReading) -> list[str]:
    return [bit.code for bit in WarningBit if status.warnings & bit]


class StateLine:
    """Writes to stdout. A reader that has gone ends it with BrokenPipeError, which the caller takes for a stop."""

    def __init__(self, *, as_json: bool) -> None:
        self._as_json = as_json
        self._is_live = can_write_over(sys.stdout) and not as_json
        self._last_s, self._last_kind = -_PLAIN_S, ()

    def show(self, status: StatusReading, time_s: float) -> None:
        """Print the status, over the last line on a terminal. time_s: since the start."""
        if self._as_json:
            self._put(json.dumps(document(status, time_s)) + "\n")
        elif self._is_live:
            self._put(_ERASE + _within(describe_state(status), shutil.get_terminal_size().columns - 1))
        elif time_s - self._last_s >= _PLAIN_S or _kind(status) != self._last_kind:
            self._last_s, self._last_kind = time_s, _kind(status)
            self._put(f"{time_s:7.1f} s  {describe_state(status)}\n")

    def close(self) -> None:
        """End the live line: it stays, and what follows begins below it."""
        if self._is_live:
            self._put("\n")

    def _put(self, text: str) -> None:
        sys.stdout.write(text)
        sys.stdout.flush()


def _kind(status: StatusReading) -> tuple[Any, ...]:
    return status.state, bool(status.bits & StatusBit.IN_BAND), status.limited_by, status.warnings
