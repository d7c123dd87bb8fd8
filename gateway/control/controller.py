"""One decision: what the command, the sample and the lines say now, into the voltage that must be written now, with its
reasons.

Order of a step: read the sample, obey the edges of the command, look for a first cause, then pursue. So a command that
arrives with its own step acts in that step, and no voltage is decided after a fault was seen. Enable, reset and tare
act on their rise; everything else is level. A refused edge changes nothing, says why, and asks for the command to be
cleared, so that the registers do not show an enable that is not there.
"""

from math import inf

from gateway.bsfm import Bsfm
from gateway.control.calibrating import RAMPING_DOWN, AnyPlan, Calibrating
from gateway.control.compensation import NO_COMPENSATION, Compensation
from gateway.control.contact import ContactSense
from gateway.control.decision import Outcome, Standing, output_of, safe_output, warning_bits
from gateway.control.demand import Demand, ramped_down
from gateway.control.follower import CommandFollower
from gateway.control.force_law import ModelError
from gateway.control.inputs import Line, Output
from gateway.control.ladder_stairs import RunPlan
from gateway.control.limits import NotFiniteError
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
        self._pursuit = Pursuit(settings, model, compensation.timing)
        self._supervisor = Supervisor(settings)
        self._reader = Reader(settings.supervision, compensation.cell)
        self._contact = ContactSense(settings.defaults.contact_threshold_n)
        self._response = ModelResponse(model, settings.supervision.response_lag_s, settings.limits.safe_voltage_v)
        self.calibrating = Calibrating(settings, model)
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
        self._pursuit.law.use(model, self._given_n)
        self._follower.use(model)
        self._response.use(model)
        self.calibrating.use(model)
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
            self._pursuit.rest()
            self.calibrating.end()
            if self.state is not State.FAULT:
                self.state, self._fault, self._faulted_s = State.FAULT, FaultCode.INTERNAL, now_s
            raise

    # -- the order of a step

    def _step(self, now_s: float, command: Command, sample: ForceSample | None, line: Line) -> Output:
        dt_s = 0.0 if self._last_s is None else max(0.0, now_s - self._last_s)
        self._last_s = now_s
        self._outcome = Outcome()
        self._pursuit.elapse(dt_s)
        self._response.advance(self._pursuit.stage.voltage_v, dt_s)
        rises, falls = self._follower.take(now_s, command)
        self._outside_n = self._compensation.outside_n(command.tilt_angle_rad, line.feed_mm_s)
        self._sense(now_s, sample, line)
        self._obey(now_s, rises, falls, line)
        if self.state in ENABLED_STATES:
            self._supervise(now_s, line)
        if self.state in ENABLED_STATES:
            self._pursue(now_s, dt_s)
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
        self._supervisor.observe(reading, self._response, self._pursuit.law.blend, touching)
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
        self._pursuit.rest()
        self.calibrating.end()
        self._ramping_down = self._master_lost = self._telling.said_unreachable = False
        self._outcome.release_owner = True
        self._refuse(sentence)

    def _refuse(self, sentence: str) -> None:
        self._outcome.events.append(sentence)
        self._outcome.clear_command = True
        self._follower.expect_clearing()

    def _reset(self, now_s: float) -> None:
        command = self._follower.command
        if command.control_word & ControlBit.ENABLE or command.force_setpoint_n != 0.0:
            self._refuse("W302 reset refused: write setpoint 0 and enable 0 with the reset bit")
        elif not self._follower.lease.is_fresh_since(self._faulted_s, now_s):
            self._refuse("W302 reset refused: the heartbeat has not changed since the fault")
        else:
            self._outcome.events.append(f"info fault {self._fault.name} reset by {self._follower.who}")
            self.state, self._fault = next_state(self.state, Event.RESET), FaultCode.NONE
            self._restarted = False

    def _tare(self) -> None:
        gravity_n = self._follower.demand.gravity_n
        before_n = self._reader.zero.zero_n
        pressing = self.state in ENABLED_STATES and self._pursuit.stage.voltage_v > 0.0
        if self.state is State.FAULT or pressing:
            reason = "disable the output or set the force to 0 first"
        elif not self._reading.is_fresh:
            reason = "no fresh load-cell sample"
        else:
            reason = self._reader.zero.tare(gravity_n)
        zero_n = self._reader.zero.zero_n
        self._supervisor.rise.shift(zero_n - before_n)
        self._outcome.events.append(f"W303 tare refused: {reason}" if reason else f"info tare: zero at {zero_n:.2f} N")

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
        expected_n = self._response.rise_n(self._pursuit.law.blend)
        found = found or self._supervisor.first_cause(now_s, self._reading, line, expected_n)
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

    # -- pursuit

    def _target(self) -> Demand:
        """What to pursue now: the command's demand, or on a ramp down 0 N, within the time whatever the force is."""
        demand = self._follower.demand
        if not self._ramping_down:
            return demand
        return ramped_down(demand, self._settings)

    def _climb(self, now_s: float) -> None:
        """One step of the calibration run, in place of the force law."""
        if self._ramping_down or self._master_lost:
            ended: Finding | None = RAMPING_DOWN
        else:
            ended = self.calibrating.climb(now_s, self._reading, self._pursuit, self._response)
        if ended is None:
            self.state = next_state(self.state, Event.MOVE)
        elif ended.fault:
            self._fail(now_s, ended)
        else:
            self._disable(ended.sentence)

    def _pursue(self, now_s: float, dt_s: float) -> None:
        if self.calibrating.running:
            self._climb(now_s)
            return
        expected_n = self._response.force_n(self._pursuit.law.blend) + self._given_n
        held_back = self._supervisor.rise.is_too_high
        moment = Moment(
            now_s, dt_s, self._reading, self._contact.touching, expected_n, held_back, outside_n=self._outside_n
        )
        try:
            event = self._pursuit.step(self._target(), moment)
        except ModelError as error:
            self._fail(now_s, finding(FaultCode.MODEL_INVALID, str(error)))
            return
        except NotFiniteError as error:
            self._fail(now_s, finding(FaultCode.NOT_FINITE, str(error)))
            return
        self.state = next_state(self.state, event)
        if self._ramping_down and self._pursuit.law.applied_n <= 0.0:
            self._disable("info force ramped to 0, output disabled")
        self._telling.unreachable(self._pursuit, self._measured_n(), expected_n, self._outcome.events)

    # -- what people see

    def _measured_n(self) -> float:
        return self._supervisor.rise.smooth_n + self._follower.demand.gravity_n

    def _standing(self, now_s: float, line: Line) -> Standing:
        enabled = self.state in ENABLED_STATES
        return Standing(
            state=self.state,
            fault=self._fault,
            block=self._block(now_s, line),
            warnings=warning_bits(int(line.warnings), self._pursuit, self._restarted, self._master_lost),
            touching=self._contact.touching,
            accepted_n=self._target().force_n if enabled else 0.0,
            expected_cell_n=self._response.force_n(self._pursuit.law.blend) + self._outside_n,
            calibration_phase=self.calibrating.phase,
            calibration_progress=self.calibrating.progress,
        )
