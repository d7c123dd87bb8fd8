"""Check whether a write can be taken now: asked by the bank inside the write, answered without any effect.

What is answered with None here the controller does: its step has no refusal of its own. Edges in one write are decided in
the order in which they act (stop, reset, tare, enable, start calibration), each for the state that the one before leaves.
A stop alone is never refused. While a run has the output, or the force is on its way to 0, nothing else is taken but the
heartbeat, a takeover, and the end of the run.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import inf
from typing import Final

from gateway.codes.refusals import RefusalReason
from gateway.control.command_edges import CommandTracker, Edges
from gateway.control.readiness import Situation
from gateway.control.runs.active_run import ActiveRun, AnyPlan
from gateway.control.runs.experiment_plan import ExperimentPlan
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.control.sample_conditioning import SampleConditioner
from gateway.control.self_test.items import SelfTestPlan
from gateway.control.state_table import ENABLED_STATES
from gateway.control.valve.valve_switch import ValveSwitch
from gateway.registers.command import Command
from gateway.registers.words import ControlBit, Mode, State
from gateway.registers.writes.proposed_write import EdgeRefusal, ProposedWrite

_ENABLE, _RESET, _TARE = int(ControlBit.ENABLE), int(ControlBit.RESET_FAULT), int(ControlBit.TARE)
_TAKE = int(ControlBit.TAKE_OWNERSHIP)
_PLANS: Final = ((int(ControlBit.START_CALIBRATION), CalibrationPlan), (int(ControlBit.START_SELF_TEST), SelfTestPlan))
_WHOLE: Final = ControlBit(0)
_ROUNDED_N: Final = 1e-3  # what is held, as a register says it, may be a bit more
_PUSHING: Final = (
    "and a run is made pushing (bit 4 0, enable, wait until status bits 8, 9 are 0: `force-gateway hold 0`)"
)
_UNKNOWN: Final = "whether air still presses is not known"


class EdgeCheck:
    """Answers for the controller; changes nothing of what it is given."""

    def __init__(
        self,
        commands: CommandTracker,
        conditioner: SampleConditioner,
        active_run: ActiveRun,
        valve: ValveSwitch | None = None,
        most_pull_n: Callable[[], float] = lambda: inf,
    ) -> None:
        self._commands = commands
        self._conditioner = conditioner
        self._active_run = active_run
        self._valve, self._most_pull_n = valve, most_pull_n

    def refusal(self, proposal: ProposedWrite, at: Situation) -> EdgeRefusal | None:
        """Return why this write cannot be taken now; None takes it."""
        command = proposal.command
        edges = self._commands.edges_of(command)
        if not edges.stops and (
            busy := self._busy(proposal, edges, at) or _old(command, edges) or self._rises_unbeaten(command, at)
        ):
            return busy
        refused = next(self._refusals(command, edges, at), None)  # what has to change first
        return refused or (None if edges.stops else _repeated(command, edges))

    def of_run(self, plan: AnyPlan, at: Situation) -> EdgeRefusal | None:
        """Return why a run cannot begin now, for whoever asks; None begins it."""
        if at.state is State.CALIBRATING:
            return _no_run(RefusalReason.CALIBRATING, self._running(), plan)
        if self._active_run.is_busy:
            why = "the last ladder is being fitted: wait until calibration_phase is stored or refused"
            return _no_run(RefusalReason.FITTING, why, plan)
        if why := self._forbids_run(plan, at):
            return _no_run(_reason_of(plan), why, plan)
        if at.state is State.OFF and (blocked := _refuse_blocked(at, _bit_of(plan), _name_of(plan))):
            return blocked
        return self._tare(self._commands.command, at.state, at) if plan.tare else None

    # -- the whole write

    def _busy(self, proposal: ProposedWrite, edges: Edges, at: Situation) -> EdgeRefusal | None:
        is_calibrating = at.state is State.CALIBRATING
        if not is_calibrating and not (at.ramps_down and at.state in ENABLED_STATES):
            return None
        acts, changes = edges.rises & ~_TAKE, proposal.changes()
        if not acts and not changes:
            return None
        asks = ", ".join((*changes, *(bit.name.lower() for bit in ControlBit if acts & bit and bit.name)))
        if is_calibrating:
            return EdgeRefusal(RefusalReason.CALIBRATING, _WHOLE, f"{asks} refused: {self._running()}")
        situation_text = f"{at.applied_n:.1f} N on the way to 0 N, then the output is off"
        return EdgeRefusal(RefusalReason.STOPPING, _WHOLE, f"{asks} refused: {situation_text}; enable again then")

    def _rises_unbeaten(self, command: Command, at: Situation) -> EdgeRefusal | None:
        """What is held for a lost master rises with a beat alone, as nothing is enabled without one: the frame of a program
        that stands still asks for its own force for ever, also behind somebody who has lowered it, or has taken over."""
        commands, before = self._commands, self._commands.command
        if (
            at.held_n is None
            or (commands.would_have_beaten_since(at.lost_s, at.now_s, command) and not command.repeats)
            or commands.would_start_lease(command)
        ):
            return None
        force_n, voltage_v = command.force_setpoint_n, command.voltage_setpoint_v
        asks_force = force_n != before.force_setpoint_n and force_n > at.held_n + _ROUNDED_N
        stood_v = before.voltage_setpoint_v if before.mode is Mode.VOLTAGE else 0.0
        if not asks_force and not (command.mode is Mode.VOLTAGE and voltage_v > stood_v):
            return None
        held = f"{at.held_n:.2f} N are held for a lost master and heartbeat = {command.heartbeat} is no new one"
        return EdgeRefusal(RefusalReason.HEARTBEAT_STALE, _WHOLE, f"refused: {held}: write another value with it")

    def _running(self) -> str:
        """What has the output, how long still, and how it is ended."""
        run = self._active_run
        if not run.running:
            return "a run has just ended and its force goes to 0: try again when state is off"
        what, left_s = run.what, run.eta_s
        cure = "control_word 0 alone, or Ctrl-C at its terminal, ends it" if run.is_local else "control_word 0 ends it"
        return f"{what} has the output, {left_s:.0f} s left; {cure}"

    # -- edge by edge

    def _refusals(self, command: Command, edges: Edges, at: Situation) -> Iterator[EdgeRefusal]:
        state = at.state  # behind a stop no enable and no run rises, and a tare asks what is out
        yield from _some(self._pull(command, edges, at))
        if edges.rises & _TAKE and self._commands.is_taken_again(command):
            text = f"takeover refused: heartbeat = {command.heartbeat} as at its last one: write another value with it"
            yield EdgeRefusal(RefusalReason.HEARTBEAT_STALE, ControlBit.TAKE_OWNERSHIP, text)
        if edges.rises & _RESET:
            yield from _some(self._reset(command, at))
            state = State.OFF
        if edges.rises & _TARE:
            yield from _some(self._tare(command, state, at))
        if edges.rises & _ENABLE and state not in ENABLED_STATES:
            yield from _some(_refuse_blocked(_in(state, at), ControlBit.ENABLE) or self._repeated(command, at))
        plans = [plan() for bit, plan in _PLANS if edges.rises & bit]
        for plan in plans:
            if self._valve is not None and command.control_word & ControlBit.VALVE_PULL:  # it would turn under the run
                yield _no_run(_reason_of(plan), f"valve_pull is 1, {_PUSHING}", plan)
            yield from _some(self.of_run(plan, _in(state, at)))
            if state not in ENABLED_STATES:
                yield from _some(self._repeated(command, at, _bit_of(plan), _name_of(plan)))
            if held := _setpoints(command):
                yield _no_run(_reason_of(plan), f"{' and '.join(held)}: a run begins with setpoint 0", plan)
        if len(plans) > 1:
            yield _no_run(
                _reason_of(plans[-1]), "a calibration is asked for in the same write: one at a time", plans[-1]
            )

    def _pull(self, command: Command, edges: Edges, at: Situation) -> EdgeRefusal | None:
        if self._valve is None or edges.stops or not command.control_word & ControlBit.VALVE_PULL:
            return None
        bit = ControlBit.VALVE_PULL
        if at.state is State.FAULT and edges.rises & bit and not edges.rises & _RESET:
            return EdgeRefusal(RefusalReason.VALVE_REFUSED, bit, "valve refused: a fault is latched, reset it first")
        # what stands from before a calibration that pulls less is lowered by control: a heartbeat beside it is no request
        asks = edges.rises & (bit | _ENABLE) or command.force_setpoint_n != self._commands.command.force_setpoint_n
        if asks and command.force_setpoint_n > (most_n := self._most_pull_n()):
            text = f"force_setpoint {command.force_setpoint_n:.2f} N with valve_pull: pulling reaches {most_n:.1f} N"
            return EdgeRefusal(RefusalReason.PULL_RANGE, bit, text)
        return None

    def _reset(self, command: Command, at: Situation) -> EdgeRefusal | None:
        if at.state in ENABLED_STATES:
            text = f"reset refused: no fault is latched, state {at.state.name}"
            return EdgeRefusal(RefusalReason.NOTHING_TO_RESET, ControlBit.RESET_FAULT, text)
        if held := _list_held(command):
            text = f"reset_fault needs enable 0 and setpoint 0: {' and '.join(held)}"
            return EdgeRefusal(RefusalReason.RESET_NEEDS_ZERO, ControlBit.RESET_FAULT, text)
        if at.state is State.OFF:
            return None  # as many programs begin: there is no fault latched, and that is what was asked for
        if not at.is_output_heard:
            text = f"reset refused: {at.line_fault or 'the output device does not answer'}: {_UNKNOWN}"
            return EdgeRefusal(RefusalReason.OUTPUT_FAULT, ControlBit.RESET_FAULT, text)
        if not self._commands.would_beat_since(at.faulted_s, at.now_s, command):
            text = f"reset refused: heartbeat = {command.heartbeat} as at the fault: write another value with the reset"
            return EdgeRefusal(RefusalReason.HEARTBEAT_STALE, ControlBit.RESET_FAULT, text)
        return None

    def _repeated(
        self, command: Command, at: Situation, bit: ControlBit = ControlBit.ENABLE, what: str = "enable"
    ) -> EdgeRefusal | None:
        """A program that stands still, whose last frame is sent on and on, would press anew each time it is lost or stopped."""
        if self._commands.would_have_beaten_since(at.lost_s, at.now_s, command):
            return None
        beat = f"heartbeat = {command.heartbeat} as when the master was lost, or another one switched it off"
        return EdgeRefusal(RefusalReason.HEARTBEAT_STALE, bit, f"{what} refused: {beat}: write another value with it")

    def _tare(self, command: Command, state: State, at: Situation) -> EdgeRefusal | None:
        why = self._forbids_tare(command, state, at)
        return EdgeRefusal(RefusalReason.TARE_REFUSED, ControlBit.TARE, f"tare refused: {why}") if why else None

    def _forbids_tare(self, command: Command, state: State, at: Situation) -> str:
        if state is State.FAULT:
            return "a fault is latched: fix its cause, then reset"
        if at.state in ENABLED_STATES and (at.applied_n > 0.0 or not at.is_lowest):
            applied = f"{at.applied_n:.1f} N are applied, " if at.applied_n > 0.0 else ""
            return f"{applied}{at.voltage_v:.2f} V are out: disable the output or set the force to 0 first"
        if at.stall_words:
            return at.stall_words
        if not at.is_output_known:
            return f"{at.line_fault or 'the output does not answer'}: {_UNKNOWN}"
        if not at.reading.is_fresh:
            return "no fresh load-cell sample"
        if at.repeats:
            return f"{at.reading.cell_n:.2f} N {at.repeats}: amplifier or cell is dead, its reading is no zero"
        if at.leaving_n > self._conditioner.zero_spread_n:
            return f"about {at.leaving_n:.1f} N are still on their way to 0: wait a moment"
        return self._conditioner.why_no_zero(self._commands.demand_by(command).manner.gravity_n)

    def _forbids_run(self, plan: AnyPlan, at: Situation) -> str:
        begins = "it begins from OFF, or from READY with force 0"
        if at.state not in (State.OFF, State.READY):
            return f"state {at.state.name}, {begins}"
        if at.state is State.READY and at.applied_n > 0.0:
            return f"state READY with {at.applied_n:.1f} N applied, {begins}"
        if at.block is RefusalReason.VALVE_UNKNOWN:
            return at.excuse
        if self._valve is not None and (self._valve.is_pulling or self._valve.is_switching):
            return f"the valve pulls or is switching, {_PUSHING}"
        try:
            self._active_run.build(plan)
        except ValueError as error:
            return str(error)
        return ""


def _in(state: State, at: Situation) -> Situation:
    """The same moment in the state that an edge before has left."""
    return at if state is at.state else replace(at, state=state)


def _refuse_blocked(at: Situation, bit: ControlBit, what: str = "enable") -> EdgeRefusal | None:
    reason = RefusalReason.FAULT_LATCHED if at.state is State.FAULT else at.block
    if not reason:
        return None
    late = at.excuse if reason is at.block else ""
    line_fault = at.line_fault if reason is RefusalReason.OUTPUT_FAULT else ""
    return EdgeRefusal(reason, bit, f"{what} refused: {late or line_fault or reason.explanation.sentence}")


def _old(command: Command, edges: Edges) -> EdgeRefusal | None:
    """Why nothing begins, and nobody takes over, by a command that has waited in a pile: its master may be gone, or expect no
    force any more, and somebody else may hold one."""
    if not command.has_waited:
        return None
    waits = f"{command.peer} asks more than is answered, so that this has waited: wait for each answer"
    return _refuse_any_rise(RefusalReason.NOT_READY, edges, waits)


def _repeated(command: Command, edges: Edges) -> EdgeRefusal | None:
    """Why nothing begins, and nobody takes over, by a frame that comes on and on, and has been refused, or was there before the
    restart: its program may stand still. A reset begins nothing."""
    if not command.repeats:
        return None
    beat = f"{command.peer} has written no other heartbeat than with what was refused, or before the restart: write one"
    return _refuse_any_rise(RefusalReason.HEARTBEAT_STALE, edges._replace(rises=edges.rises & ~_RESET), beat)


def _refuse_any_rise(reason: RefusalReason, edges: Edges, why: str) -> EdgeRefusal | None:
    if not (acts := edges.rises):
        return None
    bit = ControlBit(acts & -acts)
    return EdgeRefusal(reason, bit, f"{str(bit.name).lower()} refused: {why}")


def _no_run(reason: RefusalReason, why: str, plan: AnyPlan) -> EdgeRefusal:
    return EdgeRefusal(reason, _bit_of(plan), f"{_name_of(plan)} refused: {why}")


def _name_of(plan: AnyPlan) -> str:
    if isinstance(plan, SelfTestPlan):
        return "self-test"
    return "experiment" if isinstance(plan, ExperimentPlan) else "calibration"


def _bit_of(plan: AnyPlan) -> ControlBit:
    return ControlBit.START_SELF_TEST if isinstance(plan, SelfTestPlan) else ControlBit.START_CALIBRATION


def _reason_of(plan: AnyPlan) -> RefusalReason:
    is_self_test = isinstance(plan, SelfTestPlan)
    return RefusalReason.SELF_TEST_REFUSED if is_self_test else RefusalReason.CALIBRATION_REFUSED


def _list_held(command: Command) -> list[str]:
    """What a reset would let loose."""
    bits = (
        (ControlBit.ENABLE, "enable is 1"),
        (ControlBit.START_CALIBRATION, "start_calibration is 1"),
        (ControlBit.START_SELF_TEST, "start_self_test is 1"),
    )
    return [words for bit, words in bits if command.control_word & bit] + _setpoints(command)


def _setpoints(command: Command) -> list[str]:
    """Those that are not 0."""
    force_n, voltage_v = command.force_setpoint_n, command.voltage_setpoint_v
    force = [f"force_setpoint is {force_n:.2f} N"] if force_n else []
    return force + ([f"voltage_setpoint is {1e3 * voltage_v:.0f} mV"] if voltage_v else [])


def _some(refused: EdgeRefusal | None) -> Iterator[EdgeRefusal]:
    if refused:
        yield refused
