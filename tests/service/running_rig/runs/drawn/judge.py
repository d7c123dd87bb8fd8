"""The laws of whatever presses without an enable, asked at each tick: of voltages, times, states, registers and the log.

Shares nothing with control: what is stated (limits, a run's largest force), what has been asked for, and what has befallen the
rig are all that it knows.
"""

from math import inf, isfinite

from gateway.codes.faults import FaultCode
from gateway.control import LeaseAction
from gateway.registers.words import State
from tests.service.running_rig.runs.drawn.run_laws import SEEN_S, RunLaws, model
from tests.service.running_rig.runs.drawn.run_rig import RunRig

ON = State.READY, State.RAMPING, State.HOLDING, State.CALIBRATING
CAUSES = {
    FaultCode.SAMPLE_STALE: ("cell silent", "cell garbled", "cell away", "machine"),
    FaultCode.SAMPLE_FROZEN: ("cell frozen",),
    FaultCode.MASTER_LOST: ("hangs",),
    FaultCode.OUTPUT_SILENT: ("output unanswered", "output deaf"),
    FaultCode.OUTPUT_REFUSED: ("output refuses",),
    FaultCode.OUTPUT_LOST: ("output away",),
    FaultCode.WATCHDOG_TRIPPED: ("output tripped",),
    FaultCode.LOOP_STALLED: ("machine",),
    FaultCode.VALVE_SILENT: ("valve silent", "valve away"),
    FaultCode.VALVE_ALTERED: ("valve stuck",),
}
"""Of each fault what alone it may be told of; of the others, whatever has disturbed the rig."""
TOLD_S = 0.5
"""So long behind its end what has befallen the rig may be told of."""
FROZEN_S, FROZEN_N = 2.0, 3.0
"""A cell that repeats itself for so long, while the force must have changed by so much."""
TOUCHING_N = 1.0
"""In free air a quiet cell repeats itself rightly; how far a ladder climbs beside one that does, its stairs say."""
PAYLOAD_N = 3.5
"""The most that a payload of a scene may add to what the cell says."""


class Judge:
    """broken: the laws that did not hold, in words. is_disturbed: something has befallen rig or machine since all was well;
    begins: the present write asks for something to begin; taken_by: who has taken over."""

    def __init__(self, rig: RunRig) -> None:
        self.rig, self.laws = rig, RunLaws(rig)
        self.is_disturbed = self.begins = False
        self.taken_by: str | None = None
        self.befallen: dict[str, float] = {}  # what, and until when
        self._frozen_v: float | None = None
        self._moved_s = 0.0
        self._state, self._volts = State.OFF, rig.wire.voltage_v
        self._overs, self._heard, self._lines = 0, len(rig.heard), len(rig.log)
        self._changed_s = rig.now()

    @property
    def broken(self) -> list[str]:
        return self.laws.broken

    def complain(self, words: str) -> None:
        """Note a law that did not hold."""
        self.laws.complain(words)

    @property
    def state(self) -> State:
        decision = self.rig.loop.decision
        return decision.state if decision else State.OFF

    @property
    def is_over(self) -> bool:
        """Whether nothing has befallen the rig for so long that it may not be told of any more."""
        ends_s = (until_s for until_s in self.befallen.values() if until_s < inf)
        return self.rig.now() > max(self._changed_s, *ends_s, 0.0) + TOLD_S

    @property
    def is_on(self) -> bool:
        return self.state in ON

    def look(self, *, in_a_write: bool = False) -> None:
        """Judge this moment."""
        state, before = self.state, self._state
        self._judge_voltage(state)
        if state is not before:
            self._judge_change(before, state, in_a_write)
        if not in_a_write:
            self._judge_losses(state)
        self.laws.look(state)
        self._state = state

    def note_event(self, kind: str, *, lasts: bool = False) -> None:
        """Something befalls the rig now; lasts: until `note_end`."""
        self.befallen[kind] = inf if lasts else self.rig.now()
        self.disturb()

    def note_end(self, kind: str) -> None:
        """What befell this part of the rig is over: `cell`, say."""
        for each, until_s in self.befallen.items():
            if each.startswith(kind):
                self.befallen[each] = min(until_s, self.rig.now())

    def disturb(self) -> None:
        """All is not well, and what a run presses is not to be judged."""
        self.is_disturbed, self._changed_s = True, self.rig.now()
        if run := self.laws.run:
            run.is_odd, run.flaws = True, ()

    def restarted(self) -> None:
        """The process is another one, which knows nothing of what was begun."""
        self.taken_by, self._lines = None, len(self.rig.log)
        self._state, self._volts = State.OFF, self.rig.wire.voltage_v
        self.laws.run, self.laws.number = None, 0
        if self.state in ON:
            self.complain(f"{self.state.name} behind a restart")

    # -- the output

    def _judge_voltage(self, state: State) -> None:
        limits, volts = self.rig.settings.limits, self.rig.wire.voltage_v
        if not isfinite(volts) or not -1e-9 <= volts <= limits.voltage_max_v + 1e-9:
            self.complain(f"{volts} V are out")
        if volts > self._volts + limits.voltage_slew_v_per_s * 0.02 + 1e-6 and volts != limits.safe_voltage_v:
            self.complain(f"{self._volts:.3f} V rise to {volts:.3f} V")
        if state not in ON and volts != limits.safe_voltage_v:
            self.complain(f"{volts:.3f} V are out in {state.name}")
        self._volts = volts

    # -- states, and what is said of them

    def _judge_change(self, before: State, state: State, in_a_write: bool) -> None:
        rig, said = self.rig, self.rig.log[self._lines :]
        code = FaultCode(rig.word("fault_code"))
        self._lines = len(rig.log)
        if state in ON and before not in ON and not (in_a_write and self.begins):
            self.complain(f"{state.name} has begun by itself")
        if before is State.FAULT and not in_a_write:
            self.complain("a fault has gone by itself")
        if before is State.CALIBRATING and state not in (State.OFF, State.FAULT):
            self.complain(f"a run ends in {state.name}")
        if (state is State.FAULT) is not bool(code):
            self.complain(f"fault_code is {code.name} in {state.name}")
        if code is FaultCode.INTERNAL or any("A499" in line for line in said):
            self.complain(f"an internal error: {said}")
        if state is State.FAULT and not any(code.code in line for line in said):
            self.complain(f"{code.code} is not in the log: {said}")
        if state is State.FAULT and not self.is_disturbed:
            self.complain(f"{said} though nothing has happened")
        lately = {kind for kind, until_s in self.befallen.items() if rig.now() <= until_s + TOLD_S}
        if state is State.FAULT and code in CAUSES and not lately.intersection(CAUSES[code]):
            self.complain(f"{said} though only {sorted(lately)} has happened lately")
        if state not in ON and before in ON:
            if (rig.word("control_word"), rig.word("force_setpoint")) != (0, 0):
                self.complain(f"control_word {rig.word('control_word')} stands behind the end")
            if rig.bank.owner not in (None, self.taken_by):
                self.complain(f"{rig.bank.owner} owns it behind the end")

    # -- what is lost

    def _judge_losses(self, state: State) -> None:
        rig, bounds, limits, now_s = self.rig, self.rig.settings.supervision, self.rig.settings.limits, self.rig.now()
        heard, self._heard = rig.heard[self._heard :], len(rig.heard)
        for _, said_n in heard:
            self._overs = (
                self._overs + 1 if abs(said_n - rig.controller.zero_n) >= limits.over_force_n + PAYLOAD_N else 0
            )
        if state not in ON:
            return
        silent_s, wire = now_s - rig.silent_since_s(), rig.wire
        if silent_s > bounds.sample_timeout_s + SEEN_S:
            self.complain(f"{state.name} without a reading for {silent_s:.2f} s")
        unanswered_s = now_s - (now_s if wire.unanswered_since_s is None else wire.unanswered_since_s)
        if unanswered_s > bounds.output_timeout_s + SEEN_S:
            self.complain(f"{state.name} without an answer for {unanswered_s:.2f} s")
        if wire.how in ("refuses", "tripped", "away") and now_s - self._changed_s > 2 * SEEN_S:
            self.complain(f"{state.name} while the output is {wire.how}")
        self._judge_frozen(state, now_s)
        needs_beats = bounds.lease_s and bounds.lease_action is LeaseAction.FAULT and not self.laws.run
        if needs_beats and now_s - self.laws.beaten_s > (bounds.lease_s or 0.0) + SEEN_S:
            self.complain(f"{state.name} {now_s - self.laws.beaten_s:.2f} s behind its master's last beat")
        if self._overs > limits.over_force_samples:
            self.complain(f"{state.name} at {rig.heard[-1][1]:.1f} N")

    def _judge_frozen(self, state: State, now_s: float) -> None:
        """Of a run's voltage alone: what a force that is held makes of a cell that repeats itself is asked elsewhere."""
        rig = self.rig
        if rig.cell != "frozen" or state is not State.CALIBRATING:
            self._frozen_v = None
            return
        if self._frozen_v is None:
            self._frozen_v, self._moved_s = rig.wire.voltage_v, now_s
        moved_n = abs(model().force_n(rig.wire.voltage_v, 1.0) - model().force_n(self._frozen_v, 1.0))
        if moved_n < FROZEN_N or not rig.plant.contact or abs(rig.heard[-1][1]) < TOUCHING_N:
            self._moved_s = now_s
        if now_s - self._moved_s > FROZEN_S:
            self.complain(f"a run goes on {now_s - self._moved_s:.1f} s behind a cell that repeats itself")
