"""What must hold of a directional valve, by the page on pulling: no move under pressure, its dwells, faults, and its rest."""

from math import inf
from typing import TYPE_CHECKING

from gateway.control.settings import SafeDirection
from gateway.devices.valve_profile import ValveDirection
from gateway.registers.words import ControlBit, State, StatusBit
from tests.control.bench import Record

if TYPE_CHECKING:
    from tests.control.drawn.wide_rig import WideRig
    from tests.control.drawn.wide_scene import WideJudge

LEFT_N = 3.0  # of thrust, for a rig whose lags are known to a quarter
TICK_S = 0.06
STOPS_S = 4.0  # a ramp to 0 takes at most this long
RESTS = {SafeDirection.PUSH: ValveDirection.PUSH, SafeDirection.PULL: ValveDirection.PULL}


class ValveLaws:
    """Tells the judge what does not hold."""

    def __init__(self, rig: "WideRig", judge: "WideJudge") -> None:
        self.rig, self.judge = rig, judge
        self.pressed_s = self.well_since_s = self.switching_since_s = self.on_s = -10.0
        self.differs_since_s = inf

    def moved(self) -> None:
        """The relay has just done what it was told."""
        rig, machine = self.rig, self.rig.machine
        most_n = LEFT_N * max(1.0, machine.gain_n_per_v / 7.4)
        if machine.thrust_n > most_n:
            self.judge.complain(f"the valve moves under {machine.thrust_n:.2f} N of thrust, {rig.voltage_v:.3f} V")

    def look(self, record: Record) -> None:
        rig, valve, now_s, output = self.rig, self.rig.settings.valve, record.time_s, record.output
        if valve is None:
            return
        is_on = bool(output.status & StatusBit.ENABLED)
        if output.voltage_v > 0.0:
            self.pressed_s = now_s
            if 0.0 <= now_s - rig.moved_s < valve.dwell_s - 1e-9:
                self.judge.complain(f"{output.voltage_v:.2f} V {now_s - rig.moved_s:.3f} s behind the valve's readback")
        if rig.told_s == now_s and now_s - self.pressed_s < valve.dwell_s - 1e-9:  # told in this step
            self.judge.complain(f"the valve is told {now_s - self.pressed_s:.3f} s behind a voltage")
        is_switching = bool(output.status & StatusBit.SWITCHING)
        if output.force_applied_n < 0.0 or output.force_accepted_n < 0.0 or output.force_requested_n < 0.0:
            self.judge.complain("a setpoint below 0")
        self.differs_since_s = min(self.differs_since_s, now_s) if rig.told is not rig.stands else inf
        self._judge_faults(record, is_on)
        if not rig.is_well or not is_switching:
            self.switching_since_s = now_s
        elif now_s - self.switching_since_s > self.longest_s():
            self.judge.complain(f"the valve switches for {now_s - self.switching_since_s:.1f} s")
        if is_on and not is_switching and self.differs_since_s == inf:
            asks_pull = bool(record.command.control_word & ControlBit.VALVE_PULL)
            if bool(output.status & StatusBit.PULLING) is not (rig.stands is ValveDirection.PULL) or asks_pull is not (
                rig.stands is ValveDirection.PULL
            ):
                self.judge.complain(f"{output.status!r}, {rig.stands} stands, {record.command.control_word!r}")
        self._judge_rest(record, is_on)

    def longest_s(self) -> float:
        valve, rig = self.rig.settings.valve, self.rig
        assert valve
        return STOPS_S + 10.0 * rig.whole_s + 2.0 * valve.dwell_s + rig.moves_s + 1.0

    def _judge_faults(self, record: Record, is_on: bool) -> None:
        rig, valve, now_s = self.rig, self.rig.settings.valve, record.time_s
        assert valve
        self.on_s = self.on_s if is_on else now_s
        bound_s = valve.timeout_s + TICK_S
        if is_on and now_s - max(self.differs_since_s, self.on_s) > bound_s:
            self.judge.complain(f"told {rig.told}, {rig.stands} stands for {now_s - self.differs_since_s:.2f} s")
        if is_on and rig.silent_since_s is not None and now_s - max(rig.silent_since_s, self.on_s) > bound_s:
            self.judge.complain(f"the relay is silent for {now_s - rig.silent_since_s:.2f} s")

    def _judge_rest(self, record: Record, is_on: bool) -> None:
        """Off, or in a fault: where the rig says."""
        rig, now_s = self.rig, record.time_s
        rest = RESTS.get(rig.settings.valve.safe) if rig.settings.valve else None
        is_well = rig.is_well and rig.line.unanswered_since_s is None
        if is_on or not is_well or rest is None or record.output.state not in (State.OFF, State.FAULT):
            self.well_since_s = now_s
        elif now_s - self.well_since_s > self.longest_s() and rig.stands is not rest:
            self.judge.complain(f"{rig.stands} stands in {record.output.state.name}, the rig's rest is {rest}")
