"""Decide: what the command, the sample and the lines say now, into the voltage that must be written now, with its reasons.

Order of a step: read the sample, obey the edges of the command, look for a first cause, then move the output. So a command
that arrives with its own step acts in that step, and no voltage is decided after a fault was seen. Whether a command can be
taken is asked before (`refusal_of`), by the bank inside the write; a step refuses nothing of it. An edge that cannot be
taken and comes all the same is an internal error: the safe voltage and a latched INTERNAL. The controller asks its own parts
and none of theirs: commands, conditioner, faults, contact, loop, run, machine.
"""

from gateway.codes.faults import FaultCode
from gateway.control.command_edges import CommandTracker, Edges
from gateway.control.compensation.compensation import NO_COMPENSATION, Compensation
from gateway.control.decision import OutputComposer, safe_output
from gateway.control.demand import Demand, ramp_down_demand
from gateway.control.edge_checks import EdgeCheck
from gateway.control.force_loop.force_loop import ForceLoop, Moved
from gateway.control.force_loop.response_timing import timing_of
from gateway.control.inputs import CalibrationInUse, LineStatus, LoopInputs, Output
from gateway.control.messages import tare_sentence
from gateway.control.readiness import Readiness, Situation
from gateway.control.runs.active_run import ActiveRun, AnyPlan
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.control.sample_conditioning import NO_READING, SampleConditioner, at_time, turned
from gateway.control.self_test.items import SelfTestPlan
from gateway.control.settings import ControlSettings
from gateway.control.supervision.contact_detection import ContactDetector
from gateway.control.supervision.fault_detection import FaultDetector, StopCause, stop_cause
from gateway.control.supervision.one_shot_events import OneShotEvents
from gateway.control.transitions import ControllerParts, Transitions
from gateway.control.valve.turning import Turning
from gateway.control.valve.valve_switch import ValveSwitch
from gateway.devices.messages import ForceSample
from gateway.registers.command import Command
from gateway.registers.words import RUN_BITS, ControlBit, State
from gateway.registers.writes.proposed_write import EdgeRefusal, ProposedWrite

_ENABLE, _RESET, _TARE = int(ControlBit.ENABLE), int(ControlBit.RESET_FAULT), int(ControlBit.TARE)
_CALIBRATE, _SELF_TEST = int(ControlBit.START_CALIBRATION), int(ControlBit.START_SELF_TEST)
_PULL, _RUNNING = int(ControlBit.VALVE_PULL), State.CALIBRATING


class Controller:
    """The force controller of one rig. Times are monotonic seconds; calls may come microseconds apart."""

    def __init__(
        self,
        settings: ControlSettings,
        calibration: CalibrationInUse,
        *,
        unclean_restart: bool = False,
        compensation: Compensation = NO_COMPENSATION,
    ) -> None:
        self._calibration, self._compensation, model = calibration, compensation, calibration.model
        self._valve = ValveSwitch(settings.valve) if settings.valve else None
        self._rig_settings = compensation.settings(settings)
        self._settings = settings = timing_of(calibration.response, self._rig_settings)
        self._commands = CommandTracker(settings, lambda: self._loop.applied_n)
        self._commands.use(model)
        self.active_run = ActiveRun(settings, model, lambda: self._given_n)
        self._loop, self._faults = ForceLoop(settings, model, compensation.timing), FaultDetector(settings)
        self._take_measured(calibration)
        self._conditioner = SampleConditioner(settings.supervision, compensation.cell, is_behind_death=unclean_restart)
        self.forget_tare, self.zero_to_tell_n = self._conditioner.forget_tare, self._conditioner.zero_to_tell_n
        self._turning = Turning(self._valve, self._commands, self._conditioner, settings, model)
        self._checks = EdgeCheck(self._commands, self._conditioner, self.active_run, self._valve, self.most_pull_n)
        self._contact = ContactDetector(settings.defaults.contact_threshold_n)
        self._one_shot = OneShotEvents(settings.supervision.stuck_n)
        self._reading, self._line, self.beats_of = NO_READING, LineStatus(), self._commands.beats_of
        self.hear_refused = self._commands.hear_refused
        self._last_s: float | None = None
        self._moved_by: LoopInputs | None = None  # what the force loop has just moved by
        parts = ControllerParts(self._commands, self._faults, self._one_shot, self._loop, self.active_run)
        self._machine = Transitions(parts, is_restarted=unclean_restart)
        self._readiness = Readiness(parts, self._machine, self._valve)
        self._composer = OutputComposer(parts, self._machine, self._readiness, self._conditioner, self._valve)

    # -- for the service

    @property
    def state(self) -> State:
        """OFF, READY, RAMPING, HOLDING, CALIBRATING or FAULT."""
        return self._machine.state

    @property
    def has_stopped(self) -> bool:
        """Decide whether a `stop` has led to a disabled output, and the valve to where it rests."""
        is_off = self._machine.is_stopping and not self._machine.is_enabled
        return is_off and not (self._valve and self._valve.is_going_to_rest)

    @property
    def zero_n(self) -> float:
        """Force of the cell that the last tare has taken as zero, N."""
        return self._conditioner.zero_n

    def stop(self) -> None:
        """Ramp the force to 0 in the following steps, then stay OFF; no enable is accepted any more."""
        self._machine.is_stopping = True

    def use(self, calibration: CalibrationInUse) -> None:
        """Swap the calibration; while enabled the voltage difference fades instead of jumping, and a force above the new
        set's limits is left by the ramp. What was measured with it sets the pace from now on."""
        self._calibration = calibration
        self._use_model()
        self._take_measured(calibration)

    def _use_model(self) -> None:
        """Calculate with the calibration in use: its own model, or that of pulling."""
        model = self._turning.model_of(self._calibration)
        timed = timing_of(self._calibration.response, self._rig_settings)
        self._loop.use(model, self._given_n, timed)
        self._turning.use(model, timed)
        self._conditioner.retime(timed.supervision.response_lag_s)
        self._commands.use(model)

    def most_pull_n(self) -> float:
        """Return the largest setpoint of a pull, N."""
        return self._turning.most_pull_n(self._calibration)

    def _take_measured(self, calibration: CalibrationInUse) -> None:
        """What was measured with it beside its curves: noise and response."""
        self.calibration_id = calibration.number
        self._faults.expect_noise(calibration.noise_n)
        timed = timing_of(calibration.response, self._rig_settings)
        self.active_run.use(calibration.model, timed.timing, calibration.noise_n, timed.supervision.response_lag_s)

    @property
    def can_compensate_anew(self) -> bool:
        """Decide whether what is compensated may change now: nothing presses, and no run has the output."""
        return not self._machine.is_enabled

    def compensate(self, settings: ControlSettings, compensation: Compensation, calibration: CalibrationInUse) -> None:
        """Compensate something else from now on. settings: of the rig file; calibration: the one in use, as this compensation
        has it. ValueError while the output is enabled: a reading and a voltage that both jump are a step of the force."""
        if not self.can_compensate_anew:
            raise ValueError(f"compensation changes only while the output is disabled, not while {self.state.name}")
        self._rig_settings = compensation.settings(settings)
        self._compensation = compensation
        self._conditioner.use(compensation.cell)
        self._loop.take_timing(compensation.timing)
        self.use(calibration)

    def refusal_of(self, now_s: float, proposal: ProposedWrite, line: LineStatus) -> EdgeRefusal | None:
        """Return why a command cannot be taken now; None: the next step takes it. Nothing changes by asking."""
        return None if self.takes_at_once(proposal) else self._checks.refusal(proposal, self._situation(now_s, line))

    def takes_at_once(self, proposal: ProposedWrite) -> bool:
        """Decide whether nothing about a command has to be asked. Most writes are so: a setpoint, a heartbeat."""
        if not self._machine.takes_any_setpoint:
            return False
        asks_pull = self._valve is not None and int(proposal.command.control_word) & _PULL
        return not asks_pull and not self._commands.edges_of(proposal.command).rises

    def refusal_of_run(self, now_s: float, plan: AnyPlan) -> str:
        """Return why a run that this machine wants cannot begin: a sentence, empty where it can; by the line as it last was."""
        refused = self._checks.of_run(plan, self._situation(now_s, self._line))
        return f"W305 {refused.text}" if refused else ""

    def safe_output(self, fault: FaultCode) -> Output:
        """Return what is written while nothing has been decided."""
        return safe_output(fault, self._settings.limits.safe_voltage_v)

    def fail_internally(self, now_s: float) -> Output:
        """Return what to write when `decide` or `explain` raised, which is an internal error: INTERNAL is latched."""
        self._machine.fail_internally(now_s)
        return self.safe_output(FaultCode.INTERNAL)

    def step(self, now_s: float, command: Command, sample: ForceSample | None, line: LineStatus) -> Output:
        """Decide what to write now, and why. An exception is an internal error: INTERNAL is latched before it goes on."""
        try:
            self.decide(now_s, command, sample, line)
            return self.explain(now_s)
        except Exception:
            self.fail_internally(now_s)
            raise

    def explain(self, now_s: float) -> Output:
        """Return what has just been decided, with its reasons. An exception: as in `decide`."""
        if self._moved_by is not None:
            measured_n = self._faults.measured_n + self._commands.gravity_n
            self._machine.tell(*self._one_shot.movement_events(self._loop, measured_n, self._moved_by))
        return self._composer.compose(now_s, self._reading, self._line, self._contact.touching, self._outside_n)

    # -- the order of a step

    def decide(self, now_s: float, command: Command, sample: ForceSample | None, line: LineStatus) -> float:
        """Return the voltage to write now; `explain` follows. An exception is an internal error: ask `fail_internally`."""
        dt_s = 0.0 if self._last_s is None else max(0.0, now_s - self._last_s)
        self._last_s, self._line, self._moved_by = now_s, line, None
        self._machine.begin_step()
        self._loop.elapse(dt_s, line)
        self._faults.observe_lateness(now_s, line)
        edges = self._commands.take(now_s, command)
        self._sense(now_s, sample, line)
        self._obey(now_s, edges)
        if self._valve is not None and self._turning.follow(now_s, line, self._machine):
            self._reading = turned(self._reading)
            self._contact.restart()
            self._use_model()
        if self._machine.is_enabled:
            self._supervise(now_s, line)
        if self._machine.is_enabled:
            self._move(now_s, dt_s)
        self._machine.check_rest(now_s, line)
        return self._loop.voltage_v

    @property
    def _outside_n(self) -> float:
        """Contact force that neither slide nor payload gives, along the tool's direction: what presses is against a pull."""
        outside_n = self._compensation.outside_n(self._commands.command.tilt_angle_rad, self._line.feed_mm_s)
        return self._conditioner.direction * outside_n

    @property
    def _given_n(self) -> float:
        """Contact force that the slide need not give."""
        return self._commands.gravity_n + self._outside_n

    def _sense(self, now_s: float, sample: ForceSample | None, line: LineStatus) -> None:
        around = (line.temperature_c, self._loop.voltage_v)
        self._one_shot.observe_line(line)
        self._conditioner.note_output(is_known=line.acknowledged_v is not None)
        self._reading = reading = self._conditioner.read(now_s, sample, self._commands.gravity_n, around)
        if not reading.is_new:
            return
        self._loop.expected.note_around(self._outside_n, lacks_air=self._one_shot.lacks_air(self._loop.voltage_v))
        self._faults.observe(reading, self._loop.expected, self._loop.branch_share, self._contact.update(reading))
        if not self._machine.is_enabled:
            self._faults.observe_rest(reading)
            stuck = self._one_shot.stuck_event(self._faults.is_stuck, reading)
            self._machine.tell(stuck, self._conditioner.take_doubt())

    def _situation(self, now_s: float, line: LineStatus) -> Situation:
        later_s = now_s - (now_s if self._last_s is None else self._last_s)
        reading = at_time(self._reading, later_s, self._settings.supervision)
        return self._readiness.situation(now_s, reading, line)

    def _obey(self, now_s: float, edges: Edges) -> None:
        """What the bank has let through, in the order in which it was judged."""
        if edges.stops and self._machine.is_enabled:
            self._machine.disable(f"disabled by {self._commands.who}")
        elif edges.falls & RUN_BITS and self.active_run.running:
            self._machine.end_run(f"{self.active_run.kind} stopped by {self._commands.who}", self._given_n)
        if edges.rises & _RESET:
            self._machine.reset()
        if edges.rises & _TARE:
            self._tare()
        if edges.rises & _ENABLE and not self._machine.is_enabled:
            self._machine.enable(now_s)
        if edges.rises & _CALIBRATE:
            self._machine.begin_run(now_s, CalibrationPlan(), self._commands.who)
        if edges.rises & _SELF_TEST:
            self._machine.begin_run(now_s, SelfTestPlan(), self._commands.who)
        self._obey_this_machine(now_s)
        self._machine.is_ramping_down = self._machine.is_ramping_down or self._machine.is_stopping

    def _obey_this_machine(self, now_s: float) -> None:
        """A run that was asked for at this machine; refused, it leaves everything as it is."""
        if (plan := self.active_run.take_asked()) is None:
            return
        self.active_run.refused = self.refusal_of_run(now_s, plan)
        if self.active_run.refused:
            self._machine.tell(self.active_run.refused)
            return
        if plan.tare:
            self._tare()
        self._machine.begin_run(now_s, plan, "this machine", is_local=True)

    def _tare(self) -> None:
        self._faults.shift_zero(self._conditioner.take_zero(self._commands.gravity_n))
        self._contact.restart()
        self._machine.tell(tare_sentence(self.zero_n, self._loop.expected.kept_n))

    def _supervise(self, now_s: float, line: LineStatus) -> None:
        name = self._commands.not_finite
        cause = stop_cause(FaultCode.NOT_FINITE, f"{name} in an accepted command") if name else None
        cause = cause or self._faults.first_cause(now_s, self._reading, line, self._loop.compute_expected_rise)
        if self._valve and line.valve is not None:
            cause = self._valve.blame(now_s, cause)
        if cause:
            self._machine.fail(now_s, cause)
        elif self._goes_on_alone or not self._commands.is_lease_lost(now_s, line.owner_connected):
            self._machine.is_master_lost = self._machine.is_master_lost and self._machine.is_ramping_down
        else:
            self._machine.miss_master(now_s, line, self._settings.supervision.lease_action)

    @property
    def _goes_on_alone(self) -> bool:
        """No master is needed: a run of this machine, or the way to 0 after any run."""
        return self.active_run.is_local or (self._machine.state is _RUNNING and not self.active_run.running)

    def _target(self) -> Demand:
        """What to go for now: the command's demand, or on a ramp down 0 N, within the time whatever the force is."""
        is_to_zero = self._machine.is_ramping_down or (self._valve is not None and self._valve.is_switching)
        demand = self._machine.hold(self._commands.demand)
        return ramp_down_demand(demand, self._settings) if is_to_zero else demand

    def _move(self, now_s: float, dt_s: float) -> None:
        if self._machine.state is _RUNNING:
            if not self.active_run.running or self._step_run(now_s, self._line):
                self._follow(now_s, self._loop.descend(self._target(), dt_s, self._given_n))
            return
        expected_n, held_back = self._loop.expected_n + self._given_n, self._faults.is_first_rise_too_high
        sensed = self._reading, self._contact.touching
        inputs = self._moved_by = LoopInputs(now_s, dt_s, *sensed, expected_n, held_back, self._outside_n)
        self._follow(now_s, self._loop.step(self._target(), inputs))

    def _step_run(self, now_s: float, line: LineStatus) -> bool:
        """One step of the run; True when it has just ended, and the ramp down begins."""
        if self._machine.is_ramping_down:
            self._machine.end_run(f"{self.active_run.kind} stopped: ramping down", self._given_n)
            return True
        stop = self.active_run.step(now_s, self._reading, self._loop, line)
        self._machine.tell(self.active_run.take_message())
        if stop is None:
            self._machine.go_on_with_run()
        elif stop.fault:
            self._machine.fail(now_s, stop)
        else:
            self._machine.end_run(stop.sentence, self._given_n)
            self._machine.tell(self._faults.slow_words)
            return True
        return False

    def _follow(self, now_s: float, event: Moved) -> None:
        """The state goes along with what has moved, or could not; a ramp down ends at 0 N."""
        if isinstance(event, StopCause):
            self._machine.fail(now_s, event)
        elif self._machine.is_ramping_down and self._loop.applied_n <= 0.0:
            self._machine.end_ramp()
        else:
            self._machine.fire(event)
