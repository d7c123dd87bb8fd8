"""One decision: what the command, the sample and the lines say now, into the voltage that must be written now, with its
reasons.

Order of a step: read the sample, obey the edges of the command, look for a first cause, then pursue. So a command that
arrives with its own step acts in that step, and no voltage is decided after a fault was seen. Enable, reset and tare
act on their rise; everything else is level. A refused edge changes nothing, says why, and asks for the command to be
cleared, so that the registers do not show an enable that is not there.
"""

from math import inf

from gateway.bsfm import Bsfm
from gateway.control.calibrating import AnyPlan, Calibrating
from gateway.control.compensation import NO_COMPENSATION, Compensation
from gateway.control.contact import ContactSense
from gateway.control.decision import Outcome, Standing, output_of, safe_output, warning_bits
from gateway.control.demand import Demand, ramped_down
from gateway.control.follower import CommandFollower
from gateway.control.inputs import Line, Output
from gateway.control.ladder_stairs import RunPlan
from gateway.control.motion import Motion, Moved
from gateway.control.pursuit import Moment, Pursuit
from gateway.control.reading import NO_READING, Reader
from gateway.control.reasons import enable_refused, fault_sentence
from gateway.control.response import ModelResponse
from gateway.control.settings import ControlSettings, LeaseAction
from gateway.control.state_table import ENABLED_STATES, Event, next_state
from gateway.control.supervision import Finding, Supervisor, finding
from gateway.control.telling import Telling
from gateway.devices.messages import ForceSample
from gateway.registers.command import Command
from gateway.registers.words import ControlBit, FaultCode, RefusalReason, State

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
    ) -> None:
        """model: as volts are sent (compensation_command.sent), here as in `use`."""
        settings = compensation.settings(settings)
        self._compensation, self._outside_n = compensation, 0.0
        self.calibration_id = calibration_id
        self.state = State.OFF
        self._settings = settings
        self._follower = CommandFollower(settings)
        self._follower.use(model)
        self.calibrating = Calibrating(settings, model)
        self._pursuit = Pursuit(settings, model, compensation.timing)
        response = ModelResponse(model, settings.supervision.response_lag_s, settings.limits.safe_voltage_v)
        self._motion = Motion(self._pursuit, response, self.calibrating)
        self._supervisor = Supervisor(settings)
        self._reader = Reader(settings.supervision, compensation.cell)
        self._contact = ContactSense(settings.defaults.contact_threshold_n)
        self._reading = NO_READING
        self._last_s: float | None = None
        self._fault, self._faulted_s = FaultCode.NONE, -inf
        self._restarted = unclean_restart
        self._stopping = self._ramping_down = self._master_lost = False
        self._telling = Telling(settings.supervision.stuck_n)
        self._outcome = Outcome()

    # -- for the service

    @property
    def stopped(self) -> bool:
        """True once a `stop` has led to a disabled output."""
        return self._stopping and self.state not in ENABLED_STATES

    def stop(self) -> None:
        """Ramp the force to 0 in the following steps, then OFF for good; no enable is accepted any more."""
        self._stopping = True

    def use(self, model: Bsfm, calibration_id: int) -> None:
        """Swap the calibration; while enabled the voltage difference fades instead of jumping, and a force above the new
        set's limits is left by the ramp."""
        self._motion.use(model, self._given_n)
        self._follower.use(model)
        self.calibration_id = calibration_id

    def safe_output(self, fault: FaultCode) -> Output:
        """What to write when `step` raised."""
        return safe_output(fault, self._settings.limits.safe_voltage_v)

    def step(self, now_s: float, command: Command, sample: ForceSample | None, line: Line) -> Output:
        """The decision of this moment. An exception is a defect of ours: INTERNAL is latched before it goes on, and the
        caller writes `safe_output`."""
        try:
            return self._step(now_s, command, sample, line)
        except Exception:
            self._motion.rest()
            if self.state is not State.FAULT:
                self.state, self._fault, self._faulted_s = State.FAULT, FaultCode.INTERNAL, now_s
            raise

    # -- the order of a step

    def _step(self, now_s: float, command: Command, sample: ForceSample | None, line: Line) -> Output:
        dt_s = 0.0 if self._last_s is None else max(0.0, now_s - self._last_s)
        self._last_s = now_s
        self._outcome = Outcome()
        self._motion.elapse(dt_s)
        rises, falls = self._follower.take(now_s, command)
        self._outside_n = self._compensation.outside_n(command.tilt_angle_rad, line.feed_mm_s)
        self._sense(now_s, sample, line)
        self._obey(now_s, rises, falls, line)
        if self.state in ENABLED_STATES:
            self._supervise(now_s, line)
        if self.state in ENABLED_STATES:
            self._move(now_s, dt_s)
        return output_of(command, self._standing(now_s, line), self._pursuit, self._reading, self._outcome)

    @property
    def _given_n(self) -> float:
        """Contact force that the slide need not give."""
        return self._follower.demand.gravity_n + self._outside_n

    def _sense(self, now_s: float, sample: ForceSample | None, line: Line) -> None:
        around = (line.temperature_c, self._pursuit.stage.voltage_v)
        self._reading = reading = self._reader.read(now_s, sample, self._follower.demand.gravity_n, around)
        if not reading.is_new:
            return
        touching = self._contact.update(reading)
        self._supervisor.observe(reading, self._motion.response, self._pursuit.law.blend, touching)
        if self.state not in ENABLED_STATES:
            self._supervisor.observe_rest(reading)
            self._telling.stuck(self._supervisor.is_stuck, reading, self._outcome.events)

    def _obey(self, now_s: float, rises: int, falls: int, line: Line) -> None:
        stopped = falls & _ENABLE or (falls & _CALIBRATE and self.calibrating.running)
        if stopped and self.state in ENABLED_STATES:
            self._disable(f"info disabled by {self._follower.who}")
        if rises & _RESET and self.state is State.FAULT:
            self._reset(now_s)
        if rises & _TARE:
            self._tare()
        if rises & _ENABLE and self.state not in ENABLED_STATES:
            self._enable(now_s, line)
        asked = self.calibrating.take_asked()
        if rises & _CALIBRATE or asked:
            self._calibrate(now_s, line, asked)
        self._ramping_down = self._ramping_down or self._stopping

    # -- edges of the command

    def _disable(self, sentence: str) -> None:
        self.state = next_state(self.state, Event.DISABLE)
        self._let_go(sentence)

    def _let_go(self, sentence: str) -> None:
        """The output goes to the safe voltage, the command and its owner with it."""
        self._motion.rest()
        self._ramping_down = self._master_lost = self._telling.said_unreachable = False
        self._outcome.release_owner = True
        self._refuse(sentence)

    def _refuse(self, sentence: str) -> None:
        self._outcome.events.append(sentence)
        self._outcome.clear_command = True
        self._follower.expect_clearing()

    def _reset(self, now_s: float) -> None:
        refused = self._follower.reset_refused(now_s, self._faulted_s)
        if refused:
            self._refuse(refused)
            return
        self._outcome.events.append(f"info fault {self._fault.name} reset by {self._follower.who}")
        self.state, self._fault = next_state(self.state, Event.RESET), FaultCode.NONE
        self._restarted = False

    def _tare(self) -> None:
        pressing = self.state in ENABLED_STATES and self._pursuit.stage.voltage_v > 0.0
        refused = "" if self._reading.is_fresh else "no fresh load-cell sample"
        if self.state is State.FAULT or pressing:
            refused = "disable the output or set the force to 0 first"
        moved_n, sentence = self._reader.zero.tare(self._follower.demand.gravity_n, refused)
        self._supervisor.rise.shift(moved_n)
        self._outcome.events.append(sentence)

    def _enable(self, now_s: float, line: Line) -> None:
        block = self._block(now_s, line)
        if block:
            self._refuse(enable_refused(block))
            return
        self.state = next_state(self.state, Event.ENABLE)
        self._restarted = False
        self._supervisor.start()
        self._follower.lease.start(now_s)
        self._outcome.events.append(f"info enabled by {self._follower.who}")

    def _calibrate(self, now_s: float, line: Line, asked: AnyPlan | None) -> None:
        """Bit 5 has risen, or this machine asks."""
        if self.state is State.OFF:
            self._enable(now_s, line)
        if self.state is not State.READY or self.calibrating.is_busy or self._pursuit.law.applied_n > 0.0:
            self._refuse(f"W305 calibration refused: state {self.state.name}, allowed from OFF or READY with force 0")
            return
        if asked and asked.tare:
            self._tare()
        self.calibrating.begin(asked or RunPlan(), is_local=asked is not None)
        self._outcome.events.append(f"info calibration begun by {'this machine' if asked else self._follower.who}")

    def _block(self, now_s: float, line: Line) -> RefusalReason:
        """Why an enable would be refused now."""
        if self.state is State.FAULT:
            return RefusalReason.FAULT_LATCHED
        if self.state is not State.OFF:
            return RefusalReason.NONE
        if self._stopping:
            return RefusalReason.NOT_READY
        return self._supervisor.enable_block(now_s, self._reading, line)

    # -- supervision

    def _supervise(self, now_s: float, line: Line) -> None:
        name = self._follower.not_finite
        found = finding(FaultCode.NOT_FINITE, f"{name} in an accepted command") if name else None
        found = found or self._supervisor.first_cause(now_s, self._reading, line, self._motion.expected_rise_n)
        if found:
            self._fail(now_s, found)
        elif self.calibrating.is_local or not self._follower.lease.is_lost(now_s, line.owner_connected):
            self._master_lost = self._master_lost and self._ramping_down
        elif not self._master_lost:
            self._lose_master(now_s, line.owner_connected)

    def _fail(self, now_s: float, found: Finding) -> None:
        self.state = next_state(self.state, Event.FAILED)
        self._fault, self._faulted_s = found.fault, now_s
        self._let_go(found.sentence)

    def _lose_master(self, now_s: float, connected: bool) -> None:
        age_ms = self._follower.lease.age_s(now_s) * 1e3
        seen = f"master lost: {'' if connected else 'connection closed, '}heartbeat unchanged for {age_ms:.0f} ms"
        action = self._settings.supervision.lease_action
        if action is LeaseAction.FAULT:
            self._fail(now_s, finding(FaultCode.MASTER_LOST, f"{seen}, safe voltage"))
            return
        self._master_lost = self._outcome.release_owner = True
        self._ramping_down = action is LeaseAction.RAMP
        words = "ramping to 0 N" if self._ramping_down else "holding the last setpoint"
        self._outcome.events.append(fault_sentence(FaultCode.MASTER_LOST, f"{seen}, {words}"))

    # -- motion

    def _target(self) -> Demand:
        """What to pursue now: the command's demand, or on a ramp down 0 N, within the time whatever the force is."""
        demand = self._follower.demand
        return ramped_down(demand, self._settings) if self._ramping_down else demand

    def _move(self, now_s: float, dt_s: float) -> None:
        if self.calibrating.running:
            must_end = self._ramping_down or self._master_lost
            self._follow(now_s, self._motion.climb(now_s, self._reading, must_end=must_end))
            return
        moment = self._moment(now_s, dt_s)
        self._follow(now_s, self._motion.pursue(self._target(), moment, ramps_down=self._ramping_down))
        measured_n = self._supervisor.rise.smooth_n + self._follower.demand.gravity_n
        self._telling.unreachable(self._pursuit, measured_n, moment.expected_n, self._outcome.events)

    def _moment(self, now_s: float, dt_s: float) -> Moment:
        expected_n = self._motion.expected_n + self._given_n
        held_back, touching = self._supervisor.rise.is_too_high, self._contact.touching
        return Moment(now_s, dt_s, self._reading, touching, expected_n, held_back, self._outside_n)

    def _follow(self, now_s: float, moved: Moved) -> None:
        """The state goes along with what has moved, or could not."""
        if isinstance(moved, Event):
            self.state = next_state(self.state, moved)
        elif moved.fault:
            self._fail(now_s, moved)
        else:
            self._disable(moved.sentence)

    # -- what people see

    def _standing(self, now_s: float, line: Line) -> Standing:
        enabled = self.state in ENABLED_STATES
        return Standing(
            state=self.state,
            fault=self._fault,
            block=self._block(now_s, line),
            warnings=warning_bits(int(line.warnings), self._pursuit, self._restarted, self._master_lost),
            touching=self._contact.touching,
            accepted_n=self._target().force_n if enabled else 0.0,
            expected_cell_n=self._motion.expected_n + self._outside_n,
            calibration_phase=self.calibrating.phase,
            calibration_progress=self.calibrating.progress,
        )
