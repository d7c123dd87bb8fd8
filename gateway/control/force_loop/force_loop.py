"""The force loop of an enabled output: feedforward plus trim through the lead, or the direct voltage, through the limiter.

A step answers with an event of the state table (READY, RAMPING and HOLDING are decided here), or with the cause of a fault.
A run of calibration drives the same limiter (`drive_run`), and the force that the model expects is kept here for all.

When the trim may learn: in contact, on a new usable sample, in force mode, with no other limit acting (but back from an end of
the range), and with the target less than QUIET_N ahead of where the plant can be (not ramping fast). With a measured
response: with less than NEAR_N of thrust on its way, whose force is counted as come.
"""

from typing import Final, TypeAlias

from gateway.bsfm import Bsfm
from gateway.codes.faults import FaultCode
from gateway.control.compensation.compensation import TimingCompensation
from gateway.control.demand import Demand
from gateway.control.force_loop.coming_thrust import ComingThrust
from gateway.control.force_loop.feedforward import Approach, Feedforward, ModelError
from gateway.control.force_loop.lag_inverse import LinearizedLagInverse
from gateway.control.force_loop.lead_compensator import LeadCompensator
from gateway.control.force_loop.measured_trim import MeasuredTrim
from gateway.control.force_loop.transient_estimate import TransientEstimate
from gateway.control.force_loop.trim import LEARNING, NEAR_LIMIT, TrimIntegral, blocked_way
from gateway.control.inputs import LineStatus, LoopInputs
from gateway.control.limits import TICK_S, NotFiniteError, VoltageLimiter, strongest
from gateway.control.settings import ControlSettings, LoopTiming, Trim
from gateway.control.state_table import StateEvent
from gateway.control.supervision.fault_detection import StopCause, stop_cause
from gateway.control.supervision.in_band import SettlingCheck
from gateway.control.supervision.leaping_readings import LeapCheck
from gateway.control.supervision.plausibility import ExpectedForce, LeftForce
from gateway.registers.words import LimitedBy, Mode

Moved: TypeAlias = StateEvent | StopCause

QUIET_N: Final = 3.0
STILL_N: Final = 0.3  # the same where the response is measured
LANDING_SHARE: Final = 0.2  # of a step's landing time: so late is the lags' inverse on a ramp, on the drawn machines
_FORCE, _NONE, _SMALLEST_FORCE = Mode.FORCE, LimitedBy.NONE, LimitedBy.SMALLEST_FORCE
NEAR_N: Final = 1.0  # thrust on its way to the tool, that the model of the lags is trusted with


class ForceLoop:
    """Owns the applied target, the trim, the band, the voltage on the output and the force that the model expects of it."""

    def __init__(self, settings: ControlSettings, model: Bsfm, timing: TimingCompensation | None = None) -> None:
        self._timing, self._is_retimed = timing, False
        self._coming, self._transient = ComingThrust(), TransientEstimate()
        self._lead: LeadCompensator | LinearizedLagInverse
        self._trim: TrimIntegral | MeasuredTrim = TrimIntegral(settings.trim)
        self._tune(settings, model)
        self.feedforward = Feedforward(model, settings.limits, *self._course(settings))
        self.expected = ExpectedForce(model, settings.supervision.response_lag_s, settings.limits.safe_voltage_v)
        self.left = LeftForce(model, settings.supervision.response_lag_s, settings.limits.safe_voltage_v)
        self._limiter = VoltageLimiter(settings.limits)
        self._approach, self.feedforward_v, self.limited_by = Approach(), 0.0, LimitedBy.NONE
        self.settling = SettlingCheck(settings.supervision.unreachable_s)
        self.leaps = LeapCheck(settings.supervision.sample_quantum_n)
        self._was_touching = self._has_leapt = self._was_full = False
        self._wanted_v = 0.0

    def take_timing(self, timing: TimingCompensation | None) -> None:
        """Take another timing of the rig; the next `use` puts it into effect."""
        self._timing, self._is_retimed = timing, True

    def use(self, model: Bsfm, given_n: float, settings: ControlSettings) -> None:
        """Swap the calibration and its timing; the lags' model goes on from where it is, the trim keeps what it
        has learned. given_n: contact force that the slide need not give."""
        law = self.feedforward
        is_same = model == law.model and settings.timing == self._measured and settings.lead == self._lead_settings
        law.use(model, given_n, self._correction_limit_v)
        self.expected.retime(settings.supervision.response_lag_s)
        self.settling.retime(settings.supervision.unreachable_s)
        self.expected.use(model)
        self.left.use(model, settings.supervision.response_lag_s)
        if not is_same or self._is_retimed:
            self._is_retimed = False
            self._retime(model, settings, given_n)

    def _retime(self, model: Bsfm, settings: ControlSettings, given_n: float) -> None:
        lead, trim, law = self._lead, self._trim, self.feedforward
        self._tune(settings, model)
        self._lead.go_on_from(lead.first_v, lead.second_v)
        if isinstance(self._trim, TrimIntegral):
            self._trim.resume(trim.value_v)
        elif self._trim is not trim:
            self._trim.resume(trim.value_v * law.slope_n_per_v(given_n))
            law.replace_volts(trim.value_v, self._trim.value_n, self._trim.limit_v, given_n)
        law.retime(*self._course(settings))

    def _tune(self, settings: ControlSettings, model: Bsfm) -> None:
        """LeadCompensator and trim by the measured response where there is one, else by the rig file."""
        self._measured, self._lead_settings, self._limit_v = settings.timing, settings.lead, settings.trim.limit_v
        if settings.timing:
            self._lead = LinearizedLagInverse(settings.timing.lags, settings.limits, model)
            self._tune_measured_trim(settings.trim, settings.timing)
        else:
            self._lead, self._trim = LeadCompensator(settings.lead, settings.limits), TrimIntegral(settings.trim)

    def _tune_measured_trim(self, settings: Trim, timing: LoopTiming) -> None:
        """A trim goes on with its correction, and with the cell's noise: a new one would follow it for a second."""
        self._coming.retime(timing.dead_time_s)
        self._transient.lag_s = timing.lags.decay_s
        if isinstance(self._trim, MeasuredTrim):
            self._trim.retime(settings, timing)
        else:
            self._trim = MeasuredTrim(settings, timing)

    def _course(self, settings: ControlSettings) -> tuple[float, float, float]:
        """How the force follows the target: lag, dead time before it, and how far the aim runs ahead on a ramp."""
        measured, timing = settings.timing, self._timing
        if measured:
            ahead_s = measured.dead_time_s + LANDING_SHARE * measured.landing_s
            return max(TICK_S, measured.landing_s), measured.dead_time_s, ahead_s
        delay_s, lags_s = (timing.delay_s, timing.lags_s) if timing else (0.0, settings.supervision.response_lag_s)
        # the trim compares with a force that comes as much sooner as the lead makes it: it must not learn the push
        gained_s = self._lead.gained_s if isinstance(self._lead, LeadCompensator) else 0.0
        return max(TICK_S, lags_s - gained_s), delay_s, 0.0

    @property
    def voltage_v(self) -> float:
        """Voltage on the output since the last step, V."""
        return self._limiter.voltage_v

    @property
    def is_lowest(self) -> bool:
        """Decide whether no less voltage can be out."""
        return self._limiter.is_lowest

    @property
    def applied_n(self) -> float:
        """The ramped target of this instant, contact force."""
        return self.feedforward.applied_n

    @property
    def branch_share(self) -> float:
        """Place of the plant between the branches, -1 .. 1."""
        return self.feedforward.branch_share

    @property
    def expected_n(self) -> float:
        """Cell force that the model expects now."""
        return self.expected.force_n(self.branch_share)

    def compute_expected_rise(self) -> float:
        """Return the same above the force at rest, N."""
        return self.expected.rise_n(self.branch_share)

    @property
    def trim_v(self) -> float:
        """Voltage that the trim adds, V."""
        return self._trim.value_v

    @property
    def _correction_limit_v(self) -> float:
        return self._trim.limit_v if isinstance(self._trim, MeasuredTrim) else 0.0

    @property
    def is_trim_off(self) -> bool:
        """Decide whether the trim has no gain."""
        return self._trim.is_off

    @property
    def is_trim_at_limit(self) -> bool:
        """Decide whether the trim stands at its limit, or has and is near: noise and a moving target take it off by a hair."""
        return self._trim.limited_by is not _NONE or (self._was_full and abs(self.trim_v) > NEAR_LIMIT * self._limit_v)

    @property
    def is_hunting(self) -> bool:
        """The trim stands still, or goes slower, because force or corrections kept changing sign."""
        return self._trim.has_hunted

    @property
    def is_gain_own(self) -> bool:
        """The trim's gain is the rig file's, for no response was measured."""
        return isinstance(self._trim, TrimIntegral)

    @property
    def in_band(self) -> bool:
        """Decide whether the force has been within the tolerance of the setpoint for the in-band time."""
        return self.settling.in_band

    @property
    def unreachable(self) -> bool:
        """Decide whether the setpoint cannot be reached."""
        return self.settling.unreachable

    def elapse(self, dt_s: float, line: LineStatus) -> None:
        """Advance the models: dt_s has passed with the present voltage on the output. The model of the lags hears what the wire
        has really taken, where that is known."""
        self._limiter.earn(dt_s)
        self._lead.advance(self._limiter.voltage_v if line.sent_v is None else line.sent_v, dt_s)
        if isinstance(self._lead, LinearizedLagInverse):
            self._lead.set_wire_time(line.wire_s)
            self._coming.elapse(self._lead, dt_s)
        self.expected.advance(self._limiter.voltage_v, dt_s)
        self.left.advance(self._limiter.voltage_v, line, dt_s)

    def rest(self) -> None:
        """Go to the safe voltage at once and forget everything learned: disabled."""
        self._limiter.make_safe()
        self.feedforward.reset()
        self._trim.reset()
        self.leaps.forget()
        self.settling.restart()
        self._approach, self.feedforward_v, self.limited_by = Approach(), 0.0, LimitedBy.NONE
        self._was_touching = False  # or the next contact, which is still to come, would count as lost

    def step(self, demand: Demand, inputs: LoopInputs) -> Moved:
        """Make one step towards the demand."""
        try:
            event = self._step_force(demand, inputs) if demand.mode is _FORCE else self._step_voltage(demand, inputs)
        except (ModelError, NotFiniteError) as error:
            return _fault_of(error)
        self._was_touching, self._was_full = inputs.touching, self.is_trim_at_limit
        return event

    def descend(self, demand: Demand, dt_s: float, given_n: float) -> Moved:
        """Make one step from where a run has left the force to 0, by the model alone: neither trim nor lead, which a plant that
        is being calibrated may not fit, and never up."""
        law = self.feedforward
        try:
            law.advance(0.0, demand.manner.ramp_n_per_s, dt_s, given_n)
            voltage_v, _ = law.compute_voltage(given_n)
            self._drive_by_model(min(voltage_v, self.voltage_v), law.applied_n, law.branch_share, given_n)
        except (ModelError, NotFiniteError) as error:
            return _fault_of(error)
        return StateEvent.MOVE

    def drive_run(self, voltage_v: float, branch_share: float) -> None:
        """Put out the voltage of a calibration run, within the limits: nothing learned, nothing judged."""
        self._drive_by_model(voltage_v, self.expected.force_n(branch_share), branch_share)

    def leave_run(self, towards_n: float, branch_share: float, given_n: float) -> None:
        """Go on from the force of a run that has ended, and no higher than where its voltage would lead (towards_n). given_n:
        as in `use`."""
        reached_n = min(towards_n, self.expected.force_n(branch_share))
        self.feedforward.take_over(reached_n + given_n, branch_share, given_n)

    def _drive_by_model(self, voltage_v: float, expected_n: float, branch_share: float, given_n: float = 0.0) -> None:
        self._trim.reset()
        self.feedforward.take_over(expected_n, branch_share, given_n)
        self.feedforward_v = voltage_v
        self.limited_by = self._limiter.drive(voltage_v)

    def _step_force(self, demand: Demand, inputs: LoopInputs) -> StateEvent:
        law = self.feedforward
        goal_n, rate_n_per_s = self._approach.goal(inputs.now_s, demand, inputs.touching, law)
        if inputs.held_back:
            goal_n = min(goal_n, law.approaching_n(demand.manner.precontact_n))
        given_n = demand.manner.gravity_n + inputs.outside_n
        if self._was_touching and not inputs.touching:
            law.fall_back(goal_n, given_n)
            self._trim.forget()
        if not inputs.touching:
            law.carry_freely(given_n)
        was_at_rest = law.applied_n <= 0.0
        moved_n = law.advance(goal_n, rate_n_per_s, inputs.dt_s, given_n)
        if was_at_rest:
            law.begin_at(inputs.reading.contact_n if inputs.touching else 0.0)
        self._learn(inputs, moved_n, given_n)
        model_v, by_model = law.compute_voltage(given_n)
        if isinstance(self._trim, MeasuredTrim) and not self._trim.is_off:
            law.correct(self._trim.value_n, given_n)
            self._trim.take_volts(law.correction_v(given_n))
        has_model = law.applied_n > 0.0 and by_model is not _SMALLEST_FORCE
        wanted_v = model_v + self._trim.value_v
        push_v = self._compensated_v(wanted_v) - wanted_v if has_model else 0.0
        if demand.force_n <= 0.0:
            push_v = 0.0  # a release goes along its ramp in volts, too: pushing it would vent the tool at once
        if not has_model:
            model_v = wanted_v = self._limiter.lowest_v
        self.feedforward_v = model_v + push_v  # but for limits, the output is feedforward and trim, and nothing else
        by_stage = self._limiter.drive(wanted_v + push_v)
        self.limited_by = strongest(by_stage, self._trim.limited_by, by_model, demand.force_limited_by)
        return self.settling.judge_force(demand, inputs, goal_n, law.applied_n)

    def _compensated_v(self, wanted_v: float) -> float:
        self._wanted_v = wanted_v
        if isinstance(self._lead, LinearizedLagInverse):
            return self._lead.compensated_v(wanted_v, self._limiter.voltage_v)
        return self._lead.compensated_v(wanted_v)

    def _learn(self, inputs: LoopInputs, moved_n: float, given_n: float) -> None:
        law, trim = self.feedforward, self._trim
        trim.blocked_way = blocked_way(self.limited_by, trim.value_v, is_lowest=self.is_lowest, is_low=law.is_low)
        trim.travel(moved_n)
        if inputs.reading.is_new and inputs.reading.is_usable:
            self._has_leapt = self.leaps.passes_over(inputs.reading.contact_n, inputs.reading.raw_n)
        if law.applied_n <= 0.0:
            trim.reset()
        elif isinstance(trim, MeasuredTrim):
            self._learn_measured(trim, inputs, given_n)
        elif self._may_learn(inputs) and abs(law.applied_n - law.reference_n) < QUIET_N:
            error_n = law.reference_n - inputs.reading.contact_n
            trim.integrate(error_n, inputs.reading.interval_s)

    def _learn_measured(self, trim: MeasuredTrim, inputs: LoopInputs, given_n: float) -> None:
        """The force that will come is the measured one and what the thrust on its way makes of it, the trim's own included. So
        the trim learns as soon as that is little, without waiting for it to arrive; but not from what goes away by itself."""
        law, reading, lead = self.feedforward, inputs.reading, self._lead
        assert isinstance(lead, LinearizedLagInverse)
        coming_n = self._coming.coming_n(lead, self._wanted_v)
        if not reading.is_new:
            return
        if abs(coming_n) >= NEAR_N or abs(law.applied_n - law.aimed_n) >= STILL_N:
            self._transient.push(coming_n)
            trim.rest()
        elif self._may_learn(inputs):
            error_n = law.applied_n - reading.contact_n - coming_n * law.yielded_share(coming_n)
            self._transient.observe(error_n, trim.noise_n, reading.interval_s)
            before_n, left_n = trim.value_n, error_n - self._transient.transient_n
            trim.integrate(left_n, law.slope_n_per_v(given_n), reading.interval_s)
            self._transient.correct(trim.value_n - before_n)

    def _may_learn(self, inputs: LoopInputs) -> bool:
        is_free = self.limited_by in LEARNING and not self._has_leapt  # of the step before
        return inputs.touching and inputs.reading.is_new and inputs.reading.is_usable and is_free

    def _step_voltage(self, demand: Demand, inputs: LoopInputs) -> StateEvent:
        self._trim.reset()
        self.feedforward.take_over(inputs.expected_n, gravity_n=demand.manner.gravity_n + inputs.outside_n)
        self.feedforward_v = demand.voltage_v
        self.limited_by = self._limiter.drive(demand.voltage_v)
        return self.settling.judge_voltage(demand, inputs, is_slewing=self.limited_by is LimitedBy.VOLTAGE_SLEW)


def _fault_of(error: ModelError | NotFiniteError) -> StopCause:
    """The fault that a movement could not be computed."""
    return stop_cause(FaultCode.MODEL_INVALID if isinstance(error, ModelError) else FaultCode.NOT_FINITE, str(error))
