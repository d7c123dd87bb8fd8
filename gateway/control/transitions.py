"""Change the state, with all that a change does: to the output, to what was learned, to the command, and in the log.

Where each event leads says gateway.control.state_table; whether a command may ask for it, gateway.control.edge_checks.
"""

from dataclasses import dataclass, field
from math import inf

from gateway.codes.faults import FaultCode
from gateway.control.command_edges import CommandTracker
from gateway.control.demand import Demand
from gateway.control.force_loop.force_loop import ForceLoop
from gateway.control.inputs import LineStatus
from gateway.control.messages import fault_sentence
from gateway.control.runs.active_run import ActiveRun, AnyPlan
from gateway.control.settings import LeaseAction
from gateway.control.state_table import ENABLED_STATES, StateEvent, next_state
from gateway.control.supervision.fault_detection import FaultDetector, StopCause, stop_cause
from gateway.control.supervision.one_shot_events import OneShotEvents
from gateway.control.supervision.safe_voltage import SafeVoltageCheck
from gateway.registers.words import Mode, State


@dataclass(frozen=True, slots=True)
class ControllerParts:
    """Parts that a change of state acts on."""

    commands: CommandTracker
    faults: FaultDetector
    one_shot: OneShotEvents
    loop: ForceLoop
    run: ActiveRun


@dataclass(slots=True)
class StepOutcome:
    """Answer of a step beside the voltage."""

    events: list[str] = field(default_factory=list)
    clear_command: bool = False
    release_owner: bool = False
    resets_device: bool = False

    @property
    def is_empty(self) -> bool:
        """Decide whether there is nothing to say and nothing to do."""
        return not (self.events or self.clear_command or self.release_owner or self.resets_device)


class Transitions:
    """The present state, and the way to another one."""

    def __init__(self, parts: ControllerParts, *, is_restarted: bool) -> None:
        self.state, self.is_enabled = State.OFF, False
        self.fault = FaultCode.NONE
        self.faulted_s = -inf  # when the latched fault came, monotonic
        self.lost_s = -inf  # when the master was lost last, the same
        self.is_ramping_down = False  # the force is on its way to 0, and then off
        self.is_stopping = False  # and it stays off then
        self.is_master_lost = False
        self._unbeaten = 0  # number of the last command that came while no master beat
        self.held_n = 0.0  # for a lost master
        self.is_restarted = is_restarted  # and nobody has acknowledged that
        self._is_behind_restart = is_restarted  # as long as this process lives
        self.outcome = StepOutcome()  # what the present step wants besides the voltage
        self.parts = parts
        self._safe_voltage = SafeVoltageCheck(parts.faults)

    @property
    def takes_any_setpoint(self) -> bool:
        """Decide whether no setpoint has to be asked about: the output is no run's, on no way to 0, and held for nobody."""
        is_kept = self.is_ramping_down or self.is_stopping or self.is_master_lost
        return self.state is not State.CALIBRATING and not is_kept

    def begin_step(self) -> None:
        """Begin a step with an empty outcome."""
        if not self.outcome.is_empty:
            self.outcome = StepOutcome()

    def tell(self, *sentences: str) -> None:
        """Add sentences for the log; empty ones are none."""
        self.outcome.events.extend(filter(None, sentences))

    def fire(self, event: StateEvent) -> None:
        """Go where the table leads. TransitionError for a pair that is not in it."""
        self.state = next_state(self.state, event)
        self.is_enabled = self.state in ENABLED_STATES

    def enable(self, now_s: float) -> None:
        """Enable the output and tell who asked for it."""
        self.fire(StateEvent.ENABLE)
        self._start(now_s, f"enabled by {self.parts.commands.who}")

    def begin_run(self, now_s: float, plan: AnyPlan, asked_by: str, *, is_local: bool = False) -> None:
        """Begin a calibration or an experiment. ValueError for a plan that the rig does not allow."""
        self.fire(StateEvent.CALIBRATE)
        self.parts.run.begin(plan, is_local=is_local)
        self._start(now_s, f"{self.parts.run.kind} begun by {asked_by}")

    def _start(self, now_s: float, sentence: str) -> None:
        self.is_restarted = False
        self.parts.faults.start()
        self.parts.one_shot.start()
        self.parts.commands.start_lease(now_s)
        self.tell(sentence)

    def go_on_with_run(self) -> None:
        """Let the run go on. Until it rises the force of now is the rest that its rise is judged from: what was there at its
        begin may still leave, or come back."""
        self.fire(StateEvent.MOVE)
        if not self.parts.run.has_risen:
            self.parts.faults.start_rise()

    def end_run(self, sentence: str, given_n: float) -> None:
        """Ramp the force to 0 along the rig's ramp after a run, then switch the output off.
        However the run ended, but by a fault or a disable. given_n: contact force that the slide need not give."""
        self.parts.run.leave(self.parts.loop, given_n)
        self.is_ramping_down = True
        self.tell(sentence, *self.parts.run.take_report())

    def disable(self, sentence: str) -> None:
        """Switch the output off: the safe voltage at once, and the command with it."""
        self.fire(StateEvent.DISABLE)
        self._let_go(sentence)

    def end_ramp(self) -> None:
        """Switch the output off at the end of the way to 0 N. What was written on that way with enable at 1 asked for nothing:
        the same frame, on and on, must not be a rise behind it."""
        self.parts.commands.let_no_beat_count()
        self.disable("force ramped to 0, output disabled")

    def fail(self, now_s: float, cause: StopCause) -> None:
        """Latch a first cause: the safe voltage at once, and the command with it."""
        self._latch(now_s, cause.fault)
        self._let_go(cause.sentence)

    def check_rest(self, now_s: float, line: LineStatus) -> None:
        """Latch that the safe voltage does not stand which a way to OFF has asked for: OFF says that nothing presses."""
        if cause := self._safe_voltage.cause(now_s, self.state, line):
            self.fail(now_s, cause)

    def fail_internally(self, now_s: float) -> None:
        """Latch INTERNAL after an exception, with the safe voltage, unless another fault is latched already."""
        if self.state is not State.FAULT:
            self._latch(now_s, FaultCode.INTERNAL)
        self._rest()
        self.is_ramping_down = self.is_master_lost = False
        self.parts.commands.expect_clearing()

    def reset(self) -> None:
        """Leave FAULT, and have the output device's own latched faults cleared; in OFF only those."""
        self.outcome.resets_device = True
        if self.state is State.OFF:
            return
        self.fire(StateEvent.RESET)
        self.tell(f"fault {self.fault.name} reset by {self.parts.commands.who}")
        self.fault, self.is_restarted = FaultCode.NONE, False

    def miss_master(self, now_s: float, line: LineStatus, action: LeaseAction) -> None:
        """Act where no master's heartbeat keeps the output on. Of a force that is held meanwhile nobody is the owner: who
        writes without a beat, once or the same on and on, would keep out the master that comes back. On the way to the end of
        the gateway an owner that goes on writing forces is refused, and its beats with them: it is there as long as it does,
        and 0 N are near."""
        commands, before = self.parts.commands, self._unbeaten
        if self.is_stopping and line.owner_connected and commands.is_within_lease(line.owner_refused_s, now_s):
            return
        self._unbeaten = commands.command.number
        if not self.is_master_lost:
            self.held_n = self.parts.loop.applied_n
            self.lose_master(now_s, commands.lost_sentence(now_s, line), action)
            return
        demand = commands.demand
        lowered_n = demand.force_n if demand.mode is Mode.FORCE else inf  # at once, not along its ramp
        self.held_n = min(self.held_n, self.parts.loop.applied_n, lowered_n)
        if before != self._unbeaten and not self.is_ramping_down:
            self.outcome.release_owner = True

    def hold(self, demand: Demand) -> Demand:
        """Return the demand, for a lost master no more than has been applied since: what was waiting for contact, or has lost
        it, must not press on whoever comes to see why the machine stands."""
        return demand._replace(force_n=min(demand.force_n, self.held_n)) if self.is_master_lost else demand

    def lose_master(self, now_s: float, observation: str, action: LeaseAction) -> None:
        """Act as the rig says where the lease is over. observation: how it was noticed. Behind a restart, by a power cut say,
        nobody knows whose program had hung: the last frame of one, sent on and on, enables, too. Nothing is held for that one,
        or it would press until somebody comes."""
        self.outcome.release_owner = True
        self.lost_s = now_s
        if action is LeaseAction.HOLD and self._is_behind_restart and not self.parts.commands.has_moved:
            action, observation = LeaseAction.RAMP, f"{observation}, and none that moved since the restart"
        if action is LeaseAction.FAULT:
            self.fail(now_s, stop_cause(FaultCode.MASTER_LOST, f"{observation}, safe voltage"))
            return
        self.is_master_lost = True
        self.is_ramping_down = self.is_ramping_down or action is LeaseAction.RAMP or self.parts.run.running
        words = "ramping to 0 N" if self.is_ramping_down else "holding the force"
        self.tell(fault_sentence(FaultCode.MASTER_LOST, f"{observation}, {words}"))

    def _latch(self, now_s: float, fault: FaultCode) -> None:
        """Behind it a program that has hung meanwhile must not begin by the heartbeat of before, when somebody else resets."""
        self.parts.commands.let_no_beat_count()
        self.fire(StateEvent.FAILED)
        self.fault, self.faulted_s = fault, now_s

    def _let_go(self, sentence: str) -> None:
        self._rest()
        self.is_ramping_down = self.is_master_lost = False
        self.tell(sentence, *self.parts.run.take_report())
        self.outcome.clear_command = True
        self.parts.commands.expect_clearing()

    def _rest(self) -> None:
        """The safe voltage at once; a run ends with it."""
        self.parts.loop.rest()
        self.parts.run.rest(self.fault)
