"""One decision: what the command, the sample and the lines say now, into the voltage that must be written now, with its
reasons.

Order of a step: read the sample, obey the edges of the command, look for a first cause, then pursue. So a command that
arrives with its own step acts in that step, and no voltage is decided after a fault was seen. Whether a command can be
taken is asked before (`refusal_of`), by the bank inside the write; a step refuses nothing of it. An edge that cannot be
taken and comes all the same is a defect of ours, with what belongs to one: the safe voltage and a latched INTERNAL.
"""

from math import inf

from gateway.bsfm import Bsfm
from gateway.bsfm.model import Response
from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.control.command_edges import CommandTracker, Edges
from gateway.control.compensation.compensation import NO_COMPENSATION, Compensation
from gateway.control.decision import ControllerStatus, Outcome, output_of, safe_output, warning_bits
from gateway.control.demand import Demand, ramp_down_demand
from gateway.control.edge_checks import EdgeCheck, Situation
from gateway.control.force_loop.force_loop import ForceLoop, LoopInputs
from gateway.control.force_loop.response_timing import timing_of
from gateway.control.inputs import LineStatus, Output
from gateway.control.messages import fault_sentence
from gateway.control.motion import Motion, Moved
from gateway.control.runs.active_run import ActiveRun, AnyPlan
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.control.sample_conditioning import NO_READING, Reading, SampleConditioner, at_time
from gateway.control.settings import ControlSettings, LeaseAction
from gateway.control.state_table import ENABLED_STATES, StateEvent, next_state
from gateway.control.supervision.contact_detection import ContactDetector
from gateway.control.supervision.fault_detection import FaultDetector, StopCause, stop_cause
from gateway.control.supervision.one_shot_events import OneShotEvents
from gateway.control.supervision.plausibility import ExpectedForce
from gateway.devices.messages import ForceSample
from gateway.registers.command import Command
from gateway.registers.edge_questions import EdgeRefusal, ProposedWrite
from gateway.registers.words import ControlBit, State

_ENABLE, _RESET, _TARE = int(ControlBit.ENABLE), int(ControlBit.RESET_FAULT), int(ControlBit.TARE)
_CALIBRATE = int(ControlBit.START_CALIBRATION)


class Controller:
    """The force controller of one rig. Times are monotonic seconds; calls may come microseconds apart."""

    def __init__(
        self,
        settings: ControlSettings,
        model: Bsfm,
        *,
        calibration_id: int,
        unclean_restart: bool = False,
        compensation: Compensation = NO_COMPENSATION,
        response: Response | None = None,
    ) -> None:
        """model: as volts are sent (compensation_command.sent), here as in `use`; response: as the calibration measured it."""
        self._rig_settings = compensation.settings(settings)
        settings = timing_of(response, self._rig_settings)
        self._compensation, self._outside_n = compensation, 0.0
        self.calibration_id = calibration_id
        self.state = State.OFF
        self._settings = settings
        self._follower = CommandTracker(settings)
        self._follower.use(model)
        self.active_run = ActiveRun(settings, model)
        self._pursuit = ForceLoop(settings, model, compensation.timing)
        expected = ExpectedForce(model, settings.supervision.response_lag_s, settings.limits.safe_voltage_v)
        self._motion = Motion(self._pursuit, expected, self.active_run)
        self._supervisor = FaultDetector(settings)
        self._reader = SampleConditioner(settings.supervision, compensation.cell)
        self._judge = EdgeCheck(self._follower, self._reader.zero, self.active_run)
        self._contact = ContactDetector(settings.defaults.contact_threshold_n)
        self._reading = NO_READING
        self._last_s: float | None = None
        self._line = LineStatus()
        self._fault, self._faulted_s = FaultCode.NONE, -inf
        self._restarted = unclean_restart
        self._stopping = self._ramping_down = self._master_lost = False
        self._telling = OneShotEvents(settings.supervision.stuck_n)
        self._outcome = Outcome()

    # -- for the service

    @property
    def stopped(self) -> bool:
        """True once a `stop` has led to a disabled output."""
        return self._stopping and self.state not in ENABLED_STATES

    @property
    def zero_n(self) -> float:
        """What the last tare has taken as zero, N of the cell."""
        return self._reader.zero.zero_n

    def stop(self) -> None:
        """Ramp the force to 0 in the following steps, then OFF for good; no enable is accepted any more."""
        self._stopping = True

    def use(self, model: Bsfm, calibration_id: int, response: Response | None = None) -> None:
        """Swap the calibration; while enabled the voltage difference fades instead of jumping, and a force above the new
        set's limits is left by the ramp. What was measured with it sets the pace from now on."""
        self._motion.use(model, self._given_n, timing_of(response, self._rig_settings))
        self._follower.use(model)
        self.calibration_id = calibration_id

    def refusal_of(self, now_s: float, asked: ProposedWrite, line: LineStatus) -> EdgeRefusal | None:
        """Why a command cannot be taken at this moment; None: the next step takes it. Nothing changes by asking."""
        is_busy = self.state is State.CALIBRATING or self._ramping_down or self._stopping
        if not is_busy and not self._follower.edges_of(asked.command).rises:
            return None  # most writes: a setpoint, a heartbeat
        return self._judge.refusal(asked, self._situation(now_s, line))

    def refusal_of_run(self, now_s: float, plan: AnyPlan) -> str:
        """The same for a run that this machine wants to begin: a sentence, empty where it can; by the line as it last was."""
        refused = self._judge.of_run(plan, self._situation(now_s, self._line))
        return f"W305 {refused.text}" if refused else ""

    def safe_output(self, fault: FaultCode) -> Output:
        """What to write when `step` raised."""
        return safe_output(fault, self._settings.limits.safe_voltage_v)

    def step(self, now_s: float, command: Command, sample: ForceSample | None, line: LineStatus) -> Output:
        """The decision of this moment. An exception is a defect of ours: INTERNAL is latched before it goes on, and the
        caller writes `safe_output`."""
        try:
            return self._step(now_s, command, sample, line)
        except Exception:
            self._motion.rest()
            if self.state is not State.FAULT:
                self.state, self._fault, self._faulted_s = State.FAULT, FaultCode.INTERNAL, now_s
            self._follower.expect_clearing()
            raise

    # -- the order of a step

    def _step(self, now_s: float, command: Command, sample: ForceSample | None, line: LineStatus) -> Output:
        dt_s = 0.0 if self._last_s is None else max(0.0, now_s - self._last_s)
        self._last_s, self._line = now_s, line
        self._outcome = Outcome()
        self._motion.elapse(dt_s, line)
        edges = self._follower.take(now_s, command)
        self._outside_n = self._compensation.outside_n(command.tilt_angle_rad, line.feed_mm_s)
        self._sense(now_s, sample, line)
        self._obey(now_s, edges, line)
        if self.state in ENABLED_STATES:
            self._supervise(now_s, line)
        if self.state in ENABLED_STATES:
            self._move(now_s, dt_s)
        return output_of(command, self._standing(now_s, line), self._pursuit, self._reading, self._outcome)

    @property
    def _given_n(self) -> float:
        """Contact force that the slide need not give."""
        return self._follower.demand.gravity_n + self._outside_n

    def _sense(self, now_s: float, sample: ForceSample | None, line: LineStatus) -> None:
        around = (line.temperature_c, self._pursuit.stage.voltage_v)
        self._telling.hear(line)
        self._reading = reading = self._reader.read(now_s, sample, self._follower.demand.gravity_n, around)
        if not reading.is_new:
            return
        touching = self._contact.update(reading)
        self._supervisor.observe(reading, self._motion.response, self._pursuit.law.branch_share, touching)
        if self.state not in ENABLED_STATES:
            self._supervisor.observe_rest(reading)
            self._telling.stuck(self._supervisor.is_stuck, reading, self._outcome.events)

    def _situation(self, now_s: float, line: LineStatus) -> Situation:
        reading = at_time(
            self._reading, now_s - (now_s if self._last_s is None else self._last_s), self._settings.supervision
        )
        block = self._block_in_off(now_s, reading, line)
        return Situation(
            now_s=now_s,
            state=self.state,
            faulted_s=self._faulted_s,
            reading=reading,
            block=block,
            excuse=self._supervisor.excuse(block, now_s, reading, line),
            voltage_v=self._pursuit.stage.voltage_v,
            applied_n=self._pursuit.law.applied_n,
            expected_n=self._motion.expected_rise_n,
            ramps_down=self._ramping_down or self._stopping,
        )

    def _obey(self, now_s: float, edges: Edges, line: LineStatus) -> None:
        """What the bank has let through, in the order in which it was judged."""
        if edges.stops and self.state in ENABLED_STATES:
            self._disable(f"disabled by {self._follower.who}")
        elif edges.falls & _CALIBRATE and self.active_run.running:
            self._end_run(f"calibration stopped by {self._follower.who}")
        if edges.rises & _RESET:
            self._reset()
        if edges.rises & _TARE:
            self._tare()
        if edges.rises & _ENABLE and self.state not in ENABLED_STATES:
            self._enable(now_s)
        if edges.rises & _CALIBRATE:
            self._begin_run(now_s, CalibrationPlan(), f"calibration begun by {self._follower.who}")
        self._obey_this_machine(now_s)
        self._ramping_down = self._ramping_down or self._stopping

    def _obey_this_machine(self, now_s: float) -> None:
        """A run that was asked for at this machine; refused, it leaves everything as it is."""
        asked = self.active_run.take_asked()
        if asked is None:
            return
        self.active_run.refused = self.refusal_of_run(now_s, asked)
        if self.active_run.refused:
            self._outcome.events.append(self.active_run.refused)
            return
        if asked.tare:
            self._tare()
        self._begin_run(now_s, asked, "calibration begun by this machine", is_local=True)

    # -- edges of the command

    def _disable(self, sentence: str) -> None:
        self.state = next_state(self.state, StateEvent.DISABLE)
        self._let_go(sentence)

    def _let_go(self, sentence: str) -> None:
        """The output goes to the safe voltage, and the command with it."""
        self._motion.rest()
        self._ramping_down = self._master_lost = self._telling.said_unreachable = False
        self._outcome.events.append(sentence)
        self._outcome.clear_command = True
        self._follower.expect_clearing()

    def _reset(self) -> None:
        if self.state is State.OFF:
            return
        self.state = next_state(self.state, StateEvent.RESET)
        self._outcome.events.append(f"fault {self._fault.name} reset by {self._follower.who}")
        self._fault = FaultCode.NONE
        self._restarted = False

    def _tare(self) -> None:
        moved_n = self._reader.zero.take(self._follower.demand.gravity_n)
        self._supervisor.rise.shift(moved_n)
        self._outcome.events.append(f"tare: zero at {self._reader.zero.zero_n:.2f} N")

    def _enable(self, now_s: float) -> None:
        self.state = next_state(self.state, StateEvent.ENABLE)
        self._started(now_s, f"enabled by {self._follower.who}")

    def _started(self, now_s: float, sentence: str) -> None:
        self._restarted = False
        self._supervisor.start()
        self._telling.start()
        self._follower.lease.start(now_s)
        self._outcome.events.append(sentence)

    def _begin_run(self, now_s: float, plan: AnyPlan, sentence: str, *, is_local: bool = False) -> None:
        self.state = next_state(self.state, StateEvent.CALIBRATE)
        self.active_run.begin(plan, is_local=is_local)
        self._started(now_s, sentence)

    def _end_run(self, sentence: str) -> None:
        """However it ended, but by a fault or a disable: the force goes to 0 along the rig's ramp, then the output off."""
        self._motion.leave_run(self._given_n)
        self._ramping_down = True
        self._outcome.events.append(sentence)

    def _block(self, now_s: float, line: LineStatus) -> RefusalReason:
        """Why an enable would be refused now."""
        if self.state is State.FAULT:
            return RefusalReason.FAULT_LATCHED
        if self.state is State.CALIBRATING:
            return RefusalReason.CALIBRATING
        if self.state is not State.OFF:
            return RefusalReason.NONE
        return self._block_in_off(now_s, self._reading, line)

    def _block_in_off(self, now_s: float, reading: Reading, line: LineStatus) -> RefusalReason:
        return RefusalReason.NOT_READY if self._stopping else self._supervisor.enable_block(now_s, reading, line)

    # -- supervision

    def _supervise(self, now_s: float, line: LineStatus) -> None:
        name = self._follower.not_finite
        found = stop_cause(FaultCode.NOT_FINITE, f"{name} in an accepted command") if name else None
        found = found or self._supervisor.first_cause(now_s, self._reading, line, self._motion.expected_rise_n)
        if found:
            self._fail(now_s, found)
        elif self._goes_on_alone or not self._follower.lease.is_lost(now_s, line.owner_connected):
            self._master_lost = self._master_lost and self._ramping_down
        elif not self._master_lost:
            self._lose_master(now_s, line.owner_connected)

    @property
    def _goes_on_alone(self) -> bool:
        """No master is needed: a run of this machine, or the way to 0 after any run."""
        return self.active_run.is_local or (self.state is State.CALIBRATING and not self.active_run.running)

    def _fail(self, now_s: float, found: StopCause) -> None:
        self.state = next_state(self.state, StateEvent.FAILED)
        self._fault, self._faulted_s = found.fault, now_s
        self._let_go(found.sentence)

    def _lose_master(self, now_s: float, connected: bool) -> None:
        age_ms = self._follower.lease.age_s(now_s) * 1e3
        seen = f"master lost: {'' if connected else 'connection closed, '}heartbeat unchanged for {age_ms:.0f} ms"
        action = self._settings.supervision.lease_action
        self._outcome.release_owner = True
        if action is LeaseAction.FAULT:
            self._fail(now_s, stop_cause(FaultCode.MASTER_LOST, f"{seen}, safe voltage"))
            return
        self._master_lost = True
        self._ramping_down = self._ramping_down or action is LeaseAction.RAMP or self.active_run.running
        words = "ramping to 0 N" if self._ramping_down else "holding the last setpoint"
        self._outcome.events.append(fault_sentence(FaultCode.MASTER_LOST, f"{seen}, {words}"))

    # -- motion

    def _target(self) -> Demand:
        """What to pursue now: the command's demand, or on a ramp down 0 N, within the time whatever the force is."""
        demand = self._follower.demand
        return ramp_down_demand(demand, self._settings) if self._ramping_down else demand

    def _move(self, now_s: float, dt_s: float) -> None:
        if self.state is State.CALIBRATING:
            if not self.active_run.running or self._climb(now_s):
                self._follow(now_s, self._motion.descend(self._target(), dt_s, self._given_n))
            return
        moment = self._moment(now_s, dt_s)
        self._follow(now_s, self._motion.pursue(self._target(), moment, ramps_down=self._ramping_down))
        measured_n = self._supervisor.rise.smooth_n + self._follower.demand.gravity_n
        self._telling.unreachable(self._pursuit, measured_n, moment, self._outcome.events)
        self._telling.hunting(self._pursuit, self._outcome.events)

    def _climb(self, now_s: float) -> bool:
        """One step of the run; True when it has just ended, and the ramp down begins."""
        if self._ramping_down:
            self._end_run("calibration stopped: ramping down")
            return True
        moved = self._motion.climb(now_s, self._reading)
        if said := self.active_run.take_said():
            self._outcome.events.append(said)
        if isinstance(moved, StateEvent) or moved.fault:
            self._follow(now_s, moved)
            return False
        self._end_run(moved.sentence)
        if words := self._supervisor.slow_words:
            self._outcome.events.append(words)
        return True

    def _moment(self, now_s: float, dt_s: float) -> LoopInputs:
        expected_n = self._motion.expected_n + self._given_n
        held_back, touching = self._supervisor.rise.is_too_high, self._contact.touching
        return LoopInputs(now_s, dt_s, self._reading, touching, expected_n, held_back, self._outside_n)

    def _follow(self, now_s: float, moved: Moved) -> None:
        """The state goes along with what has moved, or could not."""
        if isinstance(moved, StateEvent):
            self.state = next_state(self.state, moved)
        elif moved.fault:
            self._fail(now_s, moved)
        else:
            self._disable(moved.sentence)

    # -- what people see

    def _standing(self, now_s: float, line: LineStatus) -> ControllerStatus:
        enabled = self.state in ENABLED_STATES
        return ControllerStatus(
            state=self.state,
            fault=self._fault,
            block=self._block(now_s, line),
            warnings=warning_bits(int(line.warnings), self._pursuit, self._restarted, self._master_lost),
            touching=self._contact.touching,
            accepted_n=self.active_run.target_n or self._target().force_n if enabled else 0.0,
            expected_cell_n=self._motion.expected_n + self._outside_n,
            calibration_phase=self.active_run.phase,
            calibration_progress=self.active_run.progress,
            calibration_time_left_s=self.active_run.eta_s,
        )
