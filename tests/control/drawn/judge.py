"""What must hold of force and voltage, whatever the machine is: by the contract of the registers and the true force, and not by
asking the code. Laws of a held force count from when nobody has changed anything for long enough (`calm_s`)."""

from collections import Counter, deque
from math import cos, inf, isfinite
from typing import TYPE_CHECKING

from gateway.codes.faults import FaultCode
from gateway.codes.warning_bits import WarningBit
from gateway.control.force_loop.trim import FREE_SWINGS
from gateway.registers.words import Mode, State, StatusBit
from tests.control.bench import Record, bsfm
from tests.control.drawn.machine import GRAVITY_M_PER_S2
from tests.control.drawn.output_laws import TICK_S, OutputLaws

if TYPE_CHECKING:
    from tests.control.drawn.rig import DrawnRig

TOLD = WarningBit.TARGET_UNREACHABLE | WarningBit.TRIM_SATURATED | WarningBit.FORCE_UNSTEADY
LONG_S = 3.0
MOST_OFTEN = FREE_SWINGS
"""That an alarm comes while nobody changes anything: a trim may reach its limit in each of them."""


class Judge(OutputLaws):
    """disturbed: what goes on just now that no held force need bear."""

    def __init__(self, rig: "DrawnRig") -> None:
        super().__init__(rig)
        self.disturbed: set[str] = set()
        self.is_spoilt = False  # something has happened since the enable that a fault may come of
        self.calm_since_s = self.last_s = self.in_band_s = 0.0
        self.over = 0
        self.high_since_s: float | None = None
        self.off_since_s = self.false_since_s = self.smooth_n = self.measured_n = self.read_n = 0.0
        self.recent: deque[tuple[float, float]] = deque()
        self.top_n: float | None = None
        self.top_why = ""
        self.hunted = False
        self.warnings, self.come = WarningBit(0), Counter[WarningBit]()
        self.state = State.OFF
        self.last_sample_s = self.told_s = -1.0
        self.counted_kg, self.direction = 0.0, 1.0
        self.is_payload_on_its_way, self.zero_n = False, 0.0

    # -- what a scene tells

    def changed(self) -> None:
        """Somebody has asked for something else, or something has befallen."""
        self.calm_since_s, self.top_n, self.hunted = self.rig.now_s, None, False
        self.come.clear()

    def bound(self, top_n: float, why: str) -> None:
        """The true force goes no higher until something else is asked for."""
        self.top_n, self.top_why = top_n, why

    # -- what is known of the machine

    @property
    def told_weight_n(self) -> float:
        """Of the payload that counts by now: another one that is told under a force follows along the ramp."""
        return self.counted_kg * GRAVITY_M_PER_S2 * cos(self.rig.command.tilt_angle_rad)

    @property
    def tolerance_n(self) -> float:
        return self.rig.command.in_band_tolerance_n or self.rig.settings.defaults.in_band_tolerance_n

    @property
    def in_band_time_s(self) -> float:
        return self.rig.command.in_band_time_s or self.rig.settings.defaults.in_band_time_s

    @property
    def noise_n(self) -> float:
        return 4.0 * self.rig.machine.noise_n + self.rig.machine.quantum_n

    @property
    def bias_n(self) -> float:
        """How much more than the true force is measured."""
        rig = self.rig
        return self.direction * (self.told_weight_n - rig.machine.weight_n - rig.controller.zero_n)

    @property
    def scale(self) -> float:
        """Of the calibration that counts: what is not measured while pulling is that of pushing by the piston's share."""
        valve = self.rig.settings.valve
        return self.rig.scale * (valve.pull_area_share if valve and self.direction < 0.0 else 1.0)

    @property
    def slip_n(self) -> float:
        """How far a held force may leap by itself, or with noise."""
        return self.noise_n + 0.2

    def volts(self, force_n: float) -> tuple[float, float]:
        """Least and most voltage that the calibration knows for a contact force."""
        branches, cell_n = bsfm(self.scale).branches, force_n - self.direction * self.told_weight_n
        return branches.falling.inverse(cell_n)[0], branches.rising.inverse(cell_n)[0]

    def is_reachable(self, force_n: float) -> bool:
        """Whether a trim that has most of its way left reaches it from either side."""
        rig, limits, trim = self.rig, self.rig.settings.limits, self.rig.settings.trim
        if (
            not trim.gain_v_per_n_s
            or force_n > 55.0 * self.scale + self.direction * self.told_weight_n
            or not rig.machine.touches
        ):
            return False
        least_v, most_v = self.volts(force_n)
        low_v, high_v = most_v - 0.6 * trim.limit_v, least_v + 0.6 * trim.limit_v
        true_n = force_n - self.bias_n
        inside = limits.voltage_min_v + 0.05 < low_v and high_v < limits.voltage_max_v - 0.05
        return inside and rig.machine.bounds_n(low_v)[1] < true_n < rig.machine.bounds_n(high_v)[0]

    def standing_n(self, force_n: float, trim_v: float) -> float:
        """What stands at most where this is asked for, with this trim."""
        limits = self.rig.settings.limits
        return self.rig.machine.bounds_n(min(limits.voltage_max_v, self.volts(force_n)[1] + trim_v))[1]

    @property
    def least_swing_n(self) -> float:
        """From peak to peak, of a held force, that is worth a word."""
        machine = self.rig.machine
        return 0.8 + 2.0 * machine.noise_n + 2.0 * machine.gain_n_per_v * (machine.count_v + machine.dead_band_v)

    def settling_s(self) -> float:
        """Ramp, response, and the trim's way."""
        rig = self.rig
        trim_s = 0.0
        if rig.settings.trim.gain_v_per_n_s and rig.response is None:
            slope = 0.5 * rig.machine.gain_n_per_v * rig.settings.trim.gain_v_per_n_s
            trim_s = min(6.0, 3.0 / slope)
        ramp_s = rig.settings.limits.force_max_n / self.ramp_n_per_s + (rig.command.contact_ramp_s or 0.5)
        return ramp_s + 0.5 + self.in_band_time_s + 8.0 * rig.whole_s + trim_s

    # -- what is seen

    def look(self, record: Record) -> None:
        output = record.output
        dt_s = record.time_s - self.last_s
        self._count_payload(record, dt_s)
        self.direction = -1.0 if output.status & StatusBit.PULLING else 1.0
        self.judge_voltage(record, dt_s)
        self.judge_registers(record, dt_s)
        self._judge_over_force(record)
        self._judge_measured(record)
        self._judge_alarms(output.warnings)
        if output.state is State.FAULT and self.state is not State.FAULT and not self.is_spoilt:
            self._judge_fault(record)
        self.state = output.state
        if output.status & StatusBit.ENABLED and record.command.mode is Mode.FORCE:
            self._judge_force(record, dt_s)
        else:
            self.high_since_s, self.read_n = None, self.measured_n
            self.in_band_s = record.time_s
            self.recent.clear()
        if self.top_n is not None and record.force_n > self.top_n:
            self.complain(f"{record.force_n:.2f} N press, {self.top_n:.2f} at most: {self.top_why}")
        self.last_s = record.time_s

    def _count_payload(self, record: Record, dt_s: float) -> None:
        told_kg = record.command.payload_kg or self.rig.settings.defaults.payload_kg
        most_kg = self.ramp_n_per_s * dt_s / GRAVITY_M_PER_S2 if record.output.force_applied_n > 0.0 else inf
        self.is_payload_on_its_way = abs(told_kg - self.counted_kg) > 1e-9
        self.counted_kg += max(-most_kg, min(most_kg, told_kg - self.counted_kg))

    def _judge_over_force(self, record: Record) -> None:
        limits, sample, output = self.rig.settings.limits, record.sample, record.output
        if sample is None or sample.time_s == self.last_sample_s:
            return
        self.last_sample_s = sample.time_s
        contact_n = sample.force_n - self.rig.controller.zero_n + self.told_weight_n
        measured_n = self.measured_n = self.direction * contact_n
        self.over = self.over + 1 if measured_n > limits.over_force_n + 1e-6 or abs(sample.force_n) > 98.0 else 0
        if self.over >= limits.over_force_samples and output.status & StatusBit.ENABLED:
            self.complain(f"{measured_n:.1f} N in {self.over} readings, {output.state.name}")
        is_high = measured_n > limits.force_max_n + self.noise_n + self.tolerance_n
        told = output.warnings or output.limited_by or output.status & StatusBit.TARGET_UNREACHABLE
        if not is_high or told or not output.status & StatusBit.ENABLED or record.command.mode is Mode.VOLTAGE:
            self.high_since_s = None
        elif self.high_since_s is None:
            self.high_since_s = record.time_s
        elif (
            record.time_s - self.high_since_s
            > 1.0 + 4.0 * self.rig.whole_s + self.rig.settings.supervision.unreachable_s
        ):
            self.complain(f"{measured_n:.1f} N measured of {limits.force_max_n} N at most, and nothing told")

    def _judge_measured(self, record: Record) -> None:
        """The register says what the cell reads, with the weight and without the zero; or nothing at all."""
        sample, shown_n, bounds = record.sample, record.output.force_measured_n, self.rig.settings.supervision
        late_s = inf if sample is None else record.time_s - sample.time_s - bounds.sample_timeout_s
        if abs(late_s) < 1e-6:
            return
        if sample is None or late_s > 0.0 or abs(sample.force_n) >= bounds.saturation_n:
            if isfinite(shown_n):
                self.complain(f"{shown_n} N are told of {sample}")
            return
        slack_n = self.ramp_n_per_s * TICK_S if self.is_payload_on_its_way else 1e-6
        zero_n, self.zero_n = self.zero_n, self.rig.controller.zero_n
        read_n = sample.force_n - zero_n + self.told_weight_n
        if not abs(shown_n - read_n) <= slack_n and zero_n == self.zero_n:  # a tare counts from the next reading on
            self.complain(f"{shown_n} N are told, {read_n} N are read")

    def _judge_alarms(self, warnings: WarningBit) -> None:
        """What has come at a force stays, or goes for good: it does not come and go."""
        if warnings == self.warnings:
            return
        self.come.update(TOLD & warnings & ~self.warnings)
        self.warnings = warnings
        if often := [bit.name for bit, times in self.come.items() if times > MOST_OFTEN]:
            self.complain(f"{often} come more than {MOST_OFTEN} times")

    def _judge_fault(self, record: Record) -> None:
        fault, machine, limits = record.output.fault, self.rig.machine, self.rig.settings.limits
        share = machine.along_n_per_v / (7.4 * self.scale)
        peak_n = max((force_n for _, force_n in self.recent), default=0.0) + self.bias_n
        if fault is FaultCode.MASTER_LOST or (
            fault is FaultCode.OVER_FORCE and peak_n > limits.over_force_n - self.noise_n
        ):
            return
        if fault is FaultCode.GAIN_WRONG and not 0.6 < share < 1.6:
            return
        self.complain(f"{fault.name} of nothing, {record.force_n:.1f} N, {record.output.events}")

    def _judge_force(self, record: Record, dt_s: float) -> None:
        output, rig, now_s = record.output, self.rig, record.time_s
        self.hunted = self.hunted or any(event.startswith(("W360", "W361")) for event in output.events)
        self.smooth_n += (record.force_n - self.smooth_n) * min(1.0, dt_s / 0.2)
        self.recent.append((now_s, record.force_n))
        while self.recent[0][0] < now_s - LONG_S:
            self.recent.popleft()
        setpoint_n, calm_s = record.command.force_setpoint_n, now_s - self.calm_since_s
        if output.status & StatusBit.IN_BAND:
            self.in_band_s = now_s
        self._judge_band(record, dt_s)
        if self.disturbed or setpoint_n < max(1.0, rig.settings.limits.smallest_force_n):
            self.calm_since_s = now_s
            return
        if calm_s < self.settling_s() or output.warnings & WarningBit.MASTER_LOST:
            return
        self._judge_held(record, setpoint_n, calm_s)

    def _judge_band(self, record: Record, dt_s: float) -> None:
        """By what is read, smoothed: long off the setpoint it is not in band, and that is told."""
        output, rig, command, now_s = record.output, self.rig, record.command, record.time_s
        self.read_n += (self.measured_n - self.read_n) * min(1.0, dt_s / 0.15)
        off_n = (
            abs(self.read_n - command.force_setpoint_n) - self.tolerance_n - rig.machine.noise_n - rig.machine.quantum_n
        )
        is_there = output.force_applied_n == output.force_accepted_n == command.force_setpoint_n > 0.0
        if off_n <= 0.0 or self.disturbed & {"false", "frozen", "silent"} or not is_there:
            self.off_since_s = now_s
        off_s = now_s - max(self.off_since_s, self.calm_since_s)
        is_inside = abs(self.measured_n - command.force_setpoint_n) <= self.tolerance_n
        if off_s <= 0.0 or is_inside or not output.status & StatusBit.IN_BAND:
            self.false_since_s = now_s
        if now_s - self.false_since_s > 0.5 + 1e-3 * rig.cell_ms:
            self.complain(f"in band of {command.force_setpoint_n} N, {self.read_n:.2f} N are read")
        longest_s = max(rig.settings.supervision.unreachable_s, 7.0 * rig.whole_s) + 1.5 + self.in_band_time_s
        if off_s > longest_s and not output.status & StatusBit.TARGET_UNREACHABLE and not self.disturbed:
            self.complain(
                f"{command.force_setpoint_n} N, {self.read_n:.2f} N are read for {off_s:.1f} s, and nothing is told"
            )

    def _judge_held(self, record: Record, setpoint_n: float, calm_s: float) -> None:
        output, rig, now_s = record.output, self.rig, record.time_s
        is_lost = now_s - self.in_band_s > 1.5 + self.in_band_time_s
        is_told = bool(output.warnings & TOLD or output.status & StatusBit.TARGET_UNREACHABLE or self.hunted)
        if is_lost and self.is_reachable(setpoint_n) and not self.hunted:
            self.complain(
                f"{setpoint_n} N is not in band {calm_s:.1f} s behind the change: {self.smooth_n:.2f} N, "
                f"trim {output.trim_v:.2f}, {output.limited_by.name}"
            )
        self.told_s = now_s if is_told else self.told_s  # at the band's edge it is told now and then
        longest_s = self.settling_s() + 8.0 + 3.0 * rig.settings.supervision.unreachable_s
        if is_lost and now_s - self.told_s > 10.0 and calm_s > longest_s:
            self.complain(f"{setpoint_n} N is not in band for {now_s - self.in_band_s:.1f} s, and nothing told")
        if is_told or self.least_swing_n == inf or calm_s <= self.settling_s() + LONG_S:
            return
        forces = [force_n for _, force_n in self.recent]
        swing_n = max(forces) - min(forces)
        if swing_n > self.least_swing_n:
            self.complain(f"the force swings by {swing_n:.2f} N at {setpoint_n} N, and nothing is told")
