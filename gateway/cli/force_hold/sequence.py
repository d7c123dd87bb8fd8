"""What a master writes to hold a force: enable, a heartbeat, and on the way out a ramp to 0 before it clears enable. Pure.

Fed with the status registers, it says the next write. Where a fault is latched it is reset only on request; that needs a
heartbeat that has changed since the fault, and the first value after one does not count, for the gateway itself zeroes the
command block then: so one beat goes before the reset.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from math import isnan, nan
from typing import Final

from gateway.codes.faults import FaultCode
from gateway.codes.warning_bits import WarningBit
from gateway.registers.words import ControlBit, LimitedBy, State, StatusBit

_STUCK_S: Final = 3.0  # a ramp down that makes no way for so long is not waited for
_ENABLE, _RESET = int(ControlBit.ENABLE), int(ControlBit.RESET_FAULT)


STATUS_NAMES: Final = (
    "state", "fault_code", "status_word", "limited_by", "warning_word", "force_measured", "force_requested",
    "force_applied", "output_voltage",
)  # fmt: skip
"""Registers that a hold reads between its beats, and no more: on a serial line the whole block takes as long as a lease."""


@dataclass(frozen=True, slots=True)
class StatusReading:
    """The status registers, in their units; nan where the gateway has no value."""

    state: State
    fault: FaultCode = FaultCode.NONE
    bits: StatusBit = StatusBit(0)  # noqa: RUF009 - a number
    limited_by: LimitedBy = LimitedBy.NONE
    warnings: WarningBit = WarningBit(0)  # noqa: RUF009 - a number
    force_n: float = nan
    setpoint_n: float = nan
    applied_n: float = nan
    voltage_v: float = nan


def status_reading_of(values: Mapping[str, float]) -> StatusReading:
    """Return the status from the values of STATUS_NAMES."""
    return StatusReading(
        state=State(int(values["state"])),
        fault=FaultCode(int(values["fault_code"])),
        bits=StatusBit(int(values["status_word"])),
        limited_by=LimitedBy(int(values["limited_by"])),
        warnings=WarningBit(int(values["warning_word"])),
        force_n=values["force_measured"],
        setpoint_n=values["force_requested"],
        applied_n=values["force_applied"],
        voltage_v=values["output_voltage"] / 1e3,
    )


@dataclass(frozen=True, slots=True)
class HoldWrite:
    """The next write. None for control_word and setpoint: the heartbeat alone."""

    heartbeat: int
    control_word: int | None = None
    setpoint_n: float = 0.0


class HoldEnd(Enum):
    """How it ended."""

    STOPPED = "stopped"  # as asked, at 0 N and disabled
    FAULT = "fault"
    DISABLED = "disabled"  # by somebody else


class _Phase(Enum):
    BEGINNING = 0
    RESETTING = 1
    ENABLING = 2
    HOLDING = 3
    LOWERING = 4


class HoldRun:
    """`next` is asked for each beat; `end` is set once there is nothing more to write. is_unheard: of the enable nobody knows
    whether it was heard."""

    def __init__(self, force_n: float, *, heartbeat: int, resets: bool) -> None:
        self.force_n = force_n
        self.end: HoldEnd | None = None
        self.is_unheard = False
        self._resets = resets
        self._heartbeat = heartbeat
        self._phase = _Phase.BEGINNING
        self._applied_n, self._moved_s = nan, 0.0

    @property
    def is_pressing(self) -> bool:
        """True once this run has enabled the output."""
        return self._phase in (_Phase.HOLDING, _Phase.LOWERING)

    def next(self, status: StatusReading, now_s: float, *, stops: bool) -> HoldWrite | None:
        """Return the next write, None where the heartbeat has nothing to write any more.

        status: read after the last write that was more than a beat. stops: whether to let go.
        """
        if status.state is State.FAULT and not (self._resets and self._phase.value <= _Phase.RESETTING.value):
            self.end = HoldEnd.FAULT
            return None
        match self._phase:
            case _Phase.HOLDING:
                return self._hold(status, now_s, stops=stops)
            case _Phase.LOWERING:
                return self._lower(status, now_s)
        if stops:
            self.end = HoldEnd.STOPPED
            return None
        return self._begin(status)

    def at_once(self) -> HoldWrite:
        """Clear enable without a ramp."""
        self.end = HoldEnd.STOPPED
        return self._write(0)

    def note_lost(self, write: HoldWrite) -> None:
        """Note that nobody may have heard the last write: nothing has ended by it, and to let go is said again."""
        self.end = None
        self.is_unheard = self._phase is _Phase.HOLDING and write.control_word == _ENABLE
        if self._phase is _Phase.LOWERING and write.control_word == _ENABLE:
            self._phase = _Phase.HOLDING

    def _begin(self, status: StatusReading) -> HoldWrite:
        if self._phase is _Phase.BEGINNING and status.state is State.FAULT:
            self._phase = _Phase.RESETTING
            return self._write(0)
        if self._phase is _Phase.RESETTING:
            self._phase = _Phase.ENABLING
            return self._write(_RESET)
        self._phase = _Phase.HOLDING
        return self._write(_ENABLE, self.force_n)

    def _hold(self, status: StatusReading, now_s: float, *, stops: bool) -> HoldWrite | None:
        if status.state is State.OFF:
            self.end = HoldEnd.STOPPED if stops else HoldEnd.DISABLED
            return None
        self.is_unheard = False
        if not stops:
            return self._beat()
        self._phase, self._moved_s = _Phase.LOWERING, now_s
        return self._write(_ENABLE, 0.0)

    def _lower(self, status: StatusReading, now_s: float) -> HoldWrite | None:
        if status.state is State.OFF:
            self.end = HoldEnd.STOPPED
            return None
        if status.applied_n != self._applied_n:
            self._applied_n, self._moved_s = status.applied_n, now_s
        if isnan(status.applied_n) or status.applied_n <= 0.0 or now_s - self._moved_s > _STUCK_S:
            return self.at_once()
        return self._beat()

    def _beat(self) -> HoldWrite:
        return HoldWrite(self._next_heartbeat())

    def _write(self, control_word: int, setpoint_n: float = 0.0) -> HoldWrite:
        return HoldWrite(self._next_heartbeat(), control_word, setpoint_n)

    def _next_heartbeat(self) -> int:
        self._heartbeat = (self._heartbeat + 1) & 0xFFFF
        return self._heartbeat
