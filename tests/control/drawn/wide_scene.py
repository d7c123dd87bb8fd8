"""Scenes of wide machines: pull and push by a valve, contact that is lost and made hard, setpoints held for long."""

from math import inf

from gateway.control import Output
from gateway.registers.words import ControlBit, Mode, State, StatusBit
from tests.control.bench import Record, bsfm
from tests.control.drawn.judge import TOLD, Judge
from tests.control.drawn.scene import BUMP_V, Scene, WatchedRig
from tests.control.drawn.valve_laws import ValveLaws
from tests.control.drawn.wide_rig import WideRig

LEAST_SWING_N = 1.2
SWINGS = 8


class WideJudge(Judge):
    """By the laws of any machine; of one that sticks, creeps or hunts no more than that it is told."""

    rig: WideRig

    def __init__(self, rig: WideRig) -> None:
        super().__init__(rig)
        self.valve = ValveLaws(rig, self)
        self.swings, self.side, self.lost_s, self.is_hunting = 0, 0, 0.0, False

    def changed(self) -> None:
        super().changed()
        self.swings = self.side = 0

    @property
    def least_swing_n(self) -> float:
        return inf  # told by how often it crosses the setpoint

    @property
    def slip_n(self) -> float:
        machine = self.rig.machine
        return super().slip_n + machine.friction_n * machine.stick_share

    def is_reachable(self, force_n: float) -> bool:
        """A weight that is against the tool may keep it from where it would be felt, and a trim begins with contact."""
        least_n, _ = self.rig.machine.bounds_n(self.volts(force_n)[0])
        is_felt = least_n > self.rig.settings.defaults.contact_threshold_n + self.noise_n
        return self.rig.is_tame and is_felt and super().is_reachable(force_n)

    def look(self, record: Record) -> None:
        output, machine = record.output, self.rig.machine
        if output.status & StatusBit.SWITCHING:
            super().changed()
        if not output.status & StatusBit.ENABLED:
            self.is_hunting = False
        self.is_spoilt = self.is_spoilt or bool(machine.gap_s > 0.0 and machine.strike_n)
        super().look(record)
        self.valve.look(record)
        self._judge_contact(record)
        self._judge_swings(record)

    def _judge_contact(self, record: Record) -> None:
        """A tool that presses nothing waits with little force, and that is told."""
        output, rig, now_s, command = record.output, self.rig, record.time_s, record.command
        is_asked = output.status & StatusBit.ENABLED and command.mode is Mode.FORCE and command.force_setpoint_n >= 2.0
        is_free = rig.machine.gap_s > 0.0 and not output.status & (StatusBit.SWITCHING | StatusBit.CONTACT)
        if not is_asked or not is_free or self.disturbed:
            self.lost_s = now_s
            return
        lost_s = now_s - self.lost_s
        longest_s = max(rig.settings.supervision.unreachable_s, 7.0 * rig.whole_s) + 1.5 + self.in_band_time_s
        if (
            lost_s > longest_s
            and not output.status & StatusBit.TARGET_UNREACHABLE
            and now_s - self.calm_since_s > longest_s
        ):
            self.complain(f"no contact for {lost_s:.1f} s, and nothing told")
        waits_n = max(command.precontact_force_n or rig.settings.defaults.precontact_force_n, 2.0)
        if lost_s > 0.5 and output.force_applied_n > max(waits_n, rig.settings.limits.smallest_force_n) + 0.01:
            self.complain(f"{output.force_applied_n:.2f} N applied {lost_s:.1f} s behind the contact")

    def _judge_swings(self, record: Record) -> None:
        """A force that goes on swinging about its setpoint is told."""
        output, command = record.output, record.command
        self.is_hunting = self.is_hunting or self.hunted
        is_told = output.warnings & TOLD or output.status & StatusBit.TARGET_UNREACHABLE or self.is_hunting
        calm_s = record.time_s - self.calm_since_s
        if self.disturbed or is_told or command.mode is not Mode.FORCE or calm_s < self.settling_s():
            self.swings = self.side = 0
            return
        off_n = record.force_n + self.bias_n - command.force_setpoint_n
        if abs(off_n) < max(LEAST_SWING_N, self.tolerance_n) + self.noise_n:
            return
        side = 1 if off_n > 0.0 else -1
        self.swings, self.side = self.swings + (side != self.side), side
        if self.swings > SWINGS:
            self.complain(f"{self.swings} swings about {command.force_setpoint_n} N, and nothing told")


class WatchedWideRig(WatchedRig, WideRig):
    """Shows each step, and each move of its relay, to its judge."""

    judge: WideJudge | None = None

    def step(self) -> Output:
        if self.settings.valve and self.move_relay() and self.judge:
            self.judge.valve.moved()
        return super().step()


class WideScene(Scene):
    """A scene of a wide machine."""

    rig: WatchedWideRig
    judge: WideJudge
    lengths_s = 15.0, 20.0, 30.0

    def build(self, seed: int) -> None:
        self.rig = WatchedWideRig(seed)
        self.rig.judge = self.judge = WideJudge(self.rig)

    def acts(self) -> list:
        mine = [self._turn, self._turn, self._turn] if self.rig.settings.valve else []
        if not self.is_calm:
            mine += [self._lose_contact, self._lose_contact]
            mine += [self._spoil_valve] if self.rig.settings.valve else []
        return [*super().acts(), *mine, self._hold_long]

    @property
    def enabling(self) -> ControlBit:
        pulls = self.rig.settings.valve and self.draw.random() < 0.4
        return ControlBit.ENABLE | (ControlBit.VALVE_PULL if pulls else ControlBit(0))

    def _turn(self) -> None:
        """Pull instead of push, or the other way round, perhaps to and fro."""
        rig, draw = self.rig, self.draw
        for _ in range(draw.choice((1, 1, 1, 2, 3))):
            if not rig.last.status & StatusBit.ENABLED:
                return
            word = rig.command.control_word ^ ControlBit.VALVE_PULL
            self.judge.is_spoilt = True
            self._write("turn", control_word=word, force_setpoint_n=round(draw.uniform(2.0, 25.0), 2), mode=Mode.FORCE)
            self._run(draw.choice((0.1, 0.5, 3.0, self.judge.valve.longest_s() + self.judge.settling_s() + 1.0)))

    def _volts(self) -> None:
        """And back to the force that the calibration expects of them, which changes nothing yet."""
        rig, draw, judge = self.rig, self.draw, self.judge
        voltage_v = round(draw.uniform(0.5, 0.4 * rig.settings.limits.force_max_n / 7.4), 3)
        judge.is_spoilt = True
        if not self._write("volts", mode=Mode.VOLTAGE, voltage_setpoint_v=voltage_v):
            return
        self._run(draw.choice((0.3, 1.0, 1.0 + 10.0 * rig.whole_s)))
        if rig.last.voltage_v != voltage_v or rig.last.status & StatusBit.SWITCHING:
            return
        at_rest = rig.now_s - judge.calm_since_s > 10.0 * rig.whole_s
        force_n = bsfm(judge.scale).branches.rising.value(voltage_v) + judge.direction * judge.told_weight_n
        if not self._write("newtons", mode=Mode.FORCE, force_setpoint_n=max(1.0, force_n)):
            return
        is_on = rig.last.status & StatusBit.ENABLED and rig.last.state is not State.FAULT
        if at_rest and is_on and force_n > 1.5 and abs(rig.last.voltage_v - voltage_v) > BUMP_V:
            judge.complain(f"{voltage_v:.3f} V become {rig.last.voltage_v:.3f} V by newtons")

    def _hold_long(self) -> None:
        self._run(self.draw.choice((2.0, 2.0, 10.0, 25.0)))

    def _lose_contact(self) -> None:
        """The workpiece ends, the slide goes to its stop, and the next one comes."""
        self.note("contact is lost")
        self.judge.changed()
        self.judge.is_spoilt = True
        self.rig.machine.gap_s = inf
        self._run(self.draw.choice((0.2, 1.0, 4.0, 8.0)))
        self.judge.changed()
        self.rig.machine.gap_s = self.draw.choice((0.01, 0.2))
        self.note("the next workpiece comes")
        self._run(self.draw.choice((0.2, 1.0, 3.0)))

    def _spoil_valve(self) -> None:
        rig, draw, judge = self.rig, self.draw, self.judge
        judge.changed()
        judge.is_spoilt = True
        name = draw.choice(("relay stuck", "relay silent", "valve by hand"))
        self.note(name)
        judge.disturbed.add(name)
        if name == "relay stuck":
            rig.obeys = False
            if rig.last.status & StatusBit.ENABLED:
                self._write("turn", control_word=rig.command.control_word ^ ControlBit.VALVE_PULL, force_setpoint_n=5.0)
        elif name == "relay silent":
            rig.silent_since_s = rig.now_s
        else:
            rig.flip()
        self._run(draw.choice((0.1, 0.4, 2.0)))
        judge.changed()
        self._heal()

    def _heal(self) -> None:
        super()._heal()
        self.rig.obeys, self.rig.silent_since_s = True, None
