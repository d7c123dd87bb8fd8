"""What must hold of the output and its registers, whatever the machine is and the master does."""

from math import isfinite
from typing import TYPE_CHECKING

from gateway.codes.faults import FaultCode
from gateway.codes.warning_bits import WarningBit
from gateway.registers.words import LimitedBy, Mode, State, StatusBit
from tests.control.bench import Record

if TYPE_CHECKING:
    from tests.control.drawn.rig import DrawnRig

TICK_S = 0.01


class OutputLaws:
    """broken: the first law that did not hold."""

    def __init__(self, rig: "DrawnRig") -> None:
        self.rig, self.broken = rig, ""
        self.most_v = rig.settings.limits.safe_voltage_v
        self.most_applied_n = self.ramped_n_per_s = 0.0

    def complain(self, what: str) -> None:
        self.broken = self.broken or f"{self.rig.now_s:.3f} {what}"

    @property
    def ramp_n_per_s(self) -> float:
        return self.rig.command.force_ramp_n_per_s or self.rig.settings.defaults.force_ramp_n_per_s

    def judge_voltage(self, record: Record, dt_s: float) -> None:
        output, limits, trim = record.output, self.rig.settings.limits, self.rig.settings.trim
        voltage_v, safe_v = output.voltage_v, limits.safe_voltage_v
        if not (isfinite(voltage_v) and min(safe_v, limits.voltage_min_v) <= voltage_v <= limits.voltage_max_v):
            self.complain(f"{voltage_v} V out")
        self.most_v += limits.voltage_slew_v_per_s * dt_s
        if voltage_v > self.most_v + limits.voltage_slew_v_per_s * TICK_S + 1e-9 and voltage_v != safe_v:
            self.complain(f"{voltage_v:.3f} V, {self.most_v:.3f} V by the slew")
        self.most_v = min(self.most_v, voltage_v) if voltage_v != safe_v else safe_v
        is_on = bool(output.status & StatusBit.ENABLED)
        if is_on is not (output.state in (State.READY, State.RAMPING, State.HOLDING)):
            self.complain(f"{output.state.name} with {output.status!r}")
        if not is_on and (voltage_v, output.trim_v, output.force_applied_n, output.force_accepted_n) != (
            safe_v,
            0.0,
            0.0,
            0.0,
        ):
            self.complain(
                f"{voltage_v} V, trim {output.trim_v}, {output.force_applied_n} N applied in {output.state.name}"
            )
        if abs(output.trim_v) > trim.limit_v + 1e-9:
            self.complain(f"trim {output.trim_v}")
        if is_on:
            self._judge_limits(record)

    def _judge_limits(self, record: Record) -> None:
        """Of an enabled output: but for limits, it is feedforward and trim, and the limit is told."""
        output, limits, voltage_v = record.output, self.rig.settings.limits, record.output.voltage_v
        asked_v = output.feedforward_v + output.trim_v
        match output.limited_by:
            case LimitedBy.VOLTAGE_SLEW:
                is_so = voltage_v < asked_v
            case LimitedBy.VOLTAGE_RANGE:
                is_so = voltage_v in (limits.voltage_min_v, limits.voltage_max_v) and voltage_v != asked_v
            case LimitedBy.SMALLEST_FORCE:
                is_so = voltage_v == limits.voltage_min_v
            case _:
                is_so = abs(voltage_v - asked_v) < 1e-9
        if abs(output.trim_v) == self.rig.settings.trim.limit_v > 0.0 and output.limited_by is LimitedBy.NONE:
            self.complain(f"trim {output.trim_v} at its limit, and nothing told")
        if output.limited_by is LimitedBy.TRIM_RANGE:
            is_so = is_so and output.trim_v != 0.0
        if not is_so:
            self.complain(
                f"{voltage_v} V of {output.feedforward_v} and {output.trim_v}, limited by {output.limited_by.name}"
            )
        if bool(output.status & StatusBit.LIMITED) is not (output.limited_by is not LimitedBy.NONE):
            self.complain(f"limited by {output.limited_by.name}, {output.status!r}")

    def judge_registers(self, record: Record, dt_s: float) -> None:
        output, command = record.output, record.command
        is_on = bool(output.status & StatusBit.ENABLED)
        if output.force_requested_n != command.force_setpoint_n:
            self.complain(f"{output.force_requested_n} N requested of {command.force_setpoint_n}")
        is_led = is_on and command.mode is Mode.FORCE and not output.warnings & WarningBit.MASTER_LOST
        if is_led and output.force_accepted_n != command.force_setpoint_n:
            self.complain(f"{output.force_accepted_n} N accepted of {command.force_setpoint_n}")
        if bool(output.status & StatusBit.FAULT) is not (output.state is State.FAULT):
            self.complain(f"{output.state.name}, {output.status!r}")
        if (output.state is State.FAULT) is not (output.fault != FaultCode.NONE):
            self.complain(f"{output.state.name}, fault {output.fault.name}")
        if not is_on or command.mode is not Mode.FORCE:
            self.most_applied_n = 99.0 if is_on else 0.0
            return
        if self.ramp_n_per_s != self.ramped_n_per_s:  # a tick of the one before may have been claimed
            self.ramped_n_per_s, self.most_applied_n = self.ramp_n_per_s, output.force_applied_n
        self.most_applied_n += self.ramp_n_per_s * dt_s
        if output.force_applied_n > self.most_applied_n + self.ramp_n_per_s * TICK_S + 1e-6:
            self.complain(f"{output.force_applied_n:.2f} N applied, {self.most_applied_n:.2f} by the ramp")
        self.most_applied_n = min(self.most_applied_n, output.force_applied_n)
