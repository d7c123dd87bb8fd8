"""One step towards what is demanded, while enabled: force law plus trim through the lead, or the direct voltage,
through the voltage stage.

READY, RAMPING and HOLDING are decided here, as events of the state table. When the trim may learn: in contact, on a new
usable sample, in force mode, with no other limit acting, and with the target less than QUIET_N ahead of where the plant
can be (not ramping fast). With a measured response that is where the model of the lags is, and it must have been there for
the dead time and the trim's patience.
"""

from dataclasses import dataclass
from math import inf
from typing import Final

from gateway.bsfm import Bsfm
from gateway.control.compensation.compensation import TimingCompensation
from gateway.control.demand import Demand
from gateway.control.force_loop.feedforward import Approach, Feedforward
from gateway.control.force_loop.lag_inverse import LagInverse
from gateway.control.force_loop.lead_compensator import LeadCompensator
from gateway.control.force_loop.measured_trim import MeasuredTrim
from gateway.control.force_loop.trim import TrimIntegral
from gateway.control.force_loop.voltage_limits import VoltageLimiter, strongest
from gateway.control.inputs import LineStatus
from gateway.control.limits import TICK_S
from gateway.control.sample_conditioning import Reading
from gateway.control.settings import ControlSettings
from gateway.control.state_table import StateEvent
from gateway.control.supervision.in_band import InBandTimer
from gateway.registers.words import LimitedBy, Mode

QUIET_N: Final = 3.0
STILL_N: Final = 0.3  # the same where the response is measured
_ANSWER_N: Final = 2.0  # expected force from which a silent cell in voltage mode is worth a warning


@dataclass(frozen=True, slots=True)
class LoopInputs:
    """What one step knows. expected_n: the model's contact force at the lagged voltage; held_back: the first rise looks
    wrong; outside_n: contact force that neither slide nor payload gives (compensation)."""

    now_s: float
    dt_s: float
    reading: Reading
    touching: bool
    expected_n: float
    held_back: bool = False
    outside_n: float = 0.0


class ForceLoop:
    """Owns the applied target, the trim, the band and the voltage on the output."""

    def __init__(self, settings: ControlSettings, model: Bsfm, timing: TimingCompensation | None = None) -> None:
        self._timing = timing
        self._tune(settings)
        self.law = Feedforward(model, settings.limits, *self._course(settings))
        self.stage = VoltageLimiter(settings.limits)
        self.feedforward_v = 0.0
        self.limited_by = LimitedBy.NONE
        self._approach = Approach()
        self._band = InBandTimer(settings.supervision.unreachable_s)
        self._answer = InBandTimer(settings.supervision.unreachable_s)
        self._was_touching = False
        self._wanted_v = 0.0

    def retime(self, settings: ControlSettings) -> None:
        """The timing of another calibration. The lags' model goes on from where it is, the trim keeps what it has learned."""
        if settings.timing == self._measured and settings.lead == self._lead_settings:
            return
        lead, value_v, law = self.lead, self.trim.value_v, self.law
        self._tune(settings)
        self.lead.first_v, self.lead.second_v = lead.first_v, lead.second_v
        self.trim.resume(value_v)
        law.retime(*self._course(settings))

    def _tune(self, settings: ControlSettings) -> None:
        """LeadCompensator and trim by the measured response where there is one, else by the rig file."""
        self._measured, self._lead_settings, self._still_s = settings.timing, settings.lead, 0.0
        self.lead: LeadCompensator | LagInverse
        self.trim: TrimIntegral | MeasuredTrim
        if self._measured:
            self.lead, self.trim = (
                LagInverse(settings.lead, settings.limits),
                MeasuredTrim(settings.trim, self._measured),
            )
        else:
            self.lead, self.trim = LeadCompensator(settings.lead, settings.limits), TrimIntegral(settings.trim)

    def _course(self, settings: ControlSettings) -> tuple[float, float, float]:
        """How the force follows the target: lag, dead time before it, and how far the aim runs ahead on a ramp."""
        measured, timing = settings.timing, self._timing
        if measured:
            return max(TICK_S, measured.landing_s), measured.dead_time_s, measured.landing_s
        delay_s, lags_s = (timing.delay_s, timing.lags_s) if timing else (0.0, settings.supervision.response_lag_s)
        # the trim compares with a force that comes as much sooner as the lead makes it: it must not learn the push
        gained_s = self.lead.gained_s if isinstance(self.lead, LeadCompensator) else 0.0
        return max(TICK_S, lags_s - gained_s), delay_s, 0.0

    @property
    def in_band(self) -> bool:
        return self._band.in_band

    @property
    def unreachable(self) -> bool:
        return self._band.unreachable or self._answer.unreachable

    def elapse(self, dt_s: float, line: LineStatus) -> None:
        """dt_s has passed with the present voltage on the output, whoever drives it. The model of the lags hears what the wire
        has really taken, where that is known: it carries one setting at a time."""
        self.stage.earn(dt_s)
        self.lead.advance(self.stage.voltage_v if line.sent_v is None else line.sent_v, dt_s)
        if isinstance(self.lead, LagInverse):
            self.lead.know_wire(line.wire_s)

    def rest(self) -> None:
        """Disabled: the safe voltage at once, everything learned forgotten."""
        self.stage.make_safe()
        self.law.reset()
        self.trim.reset()
        self._approach = Approach()
        self._band.restart()
        self._answer.restart()
        self.feedforward_v, self.limited_by = 0.0, LimitedBy.NONE

    def step(self, demand: Demand, moment: LoopInputs) -> StateEvent:
        """Moves the output. NotFiniteError and ModelError are the caller's to turn into faults."""
        event = self._force(demand, moment) if demand.mode is Mode.FORCE else self._voltage(demand, moment)
        self._was_touching = moment.touching
        return event

    def follow(self, voltage_v: float, expected_n: float, branch_share: float) -> None:
        """A stair of the calibration ladder: this voltage within the limits, nothing learned, nothing judged."""
        self.trim.reset()
        self._band.restart()
        self._answer.restart()
        self.law.take_over(expected_n, branch_share)
        self.feedforward_v = voltage_v
        self.limited_by = self.stage.drive(voltage_v)

    def _force(self, demand: Demand, moment: LoopInputs) -> StateEvent:
        law = self.law
        goal_n, rate_n_per_s = self._approach.goal(moment.now_s, demand, moment.touching, law)
        if moment.held_back:
            goal_n = min(goal_n, law.approaching_n(demand.precontact_n))
        if self._was_touching and not moment.touching:
            law.fall_back(goal_n)
        given_n = demand.gravity_n + moment.outside_n
        moved_n = law.advance(goal_n, rate_n_per_s, moment.dt_s, given_n)
        self._learn(moment, moved_n, given_n)
        model_v, by_model = law.feedforward(given_n)
        has_model = law.applied_n > 0.0 and by_model is not LimitedBy.SMALLEST_FORCE
        wanted_v = model_v + self.trim.value_v
        push_v = self._led_v(wanted_v) - wanted_v if has_model else 0.0
        self.feedforward_v = model_v + push_v  # but for limits, the output is feedforward and trim, and nothing else
        by_stage = self.stage.drive(wanted_v + push_v if has_model else 0.0)
        self.limited_by = strongest(by_stage, self.trim.limited_by, by_model, demand.force_limited_by)
        self._answer.restart()
        return self._judge_force(demand, moment, goal_n)

    def _led_v(self, wanted_v: float) -> float:
        self._wanted_v = wanted_v
        if isinstance(self.lead, LagInverse):
            return self.lead.led_v(wanted_v, self.stage.voltage_v)
        return self.lead.led_v(wanted_v)

    def _learn(self, moment: LoopInputs, moved_n: float, given_n: float) -> None:
        law, trim = self.law, self.trim
        trim.travel(moved_n)
        if law.applied_n <= 0.0:
            trim.reset()
        elif isinstance(trim, MeasuredTrim):
            self._learn_measured(trim, moment, given_n)
        elif self._may_learn(moment) and abs(law.applied_n - law.reference_n) < QUIET_N:
            trim.integrate(law.reference_n - moment.reading.contact_n, moment.reading.interval_s)

    def _learn_measured(self, trim: MeasuredTrim, moment: LoopInputs, given_n: float) -> None:
        law, measured = self.law, self._measured
        assert measured
        slope_n_per_v = law.slope_n_per_v(given_n) if moment.reading.is_new else 1.0
        if moment.reading.is_new:
            away_n = abs(self._wanted_v - self.lead.second_v) * slope_n_per_v
            still = away_n < STILL_N and abs(law.applied_n - law.reference_n) < STILL_N
            self._still_s = self._still_s + moment.reading.interval_s if still else 0.0
        if self._still_s < measured.dead_time_s + measured.patience_s:
            trim.rest()
        elif self._may_learn(moment):
            trim.integrate(law.reference_n - moment.reading.contact_n, slope_n_per_v, moment.reading.interval_s)

    def _may_learn(self, moment: LoopInputs) -> bool:
        free = self.limited_by is LimitedBy.NONE or self.limited_by is LimitedBy.TRIM_RANGE  # of the step before
        return moment.touching and moment.reading.is_new and moment.reading.is_usable and free

    def _judge_force(self, demand: Demand, moment: LoopInputs, goal_n: float) -> StateEvent:
        applied_n, tolerance_n = self.law.applied_n, demand.tolerance_n
        if demand.force_n <= 0.0:
            self._band.restart()
            return StateEvent.WAIT if applied_n <= 0.0 else StateEvent.MOVE
        if abs(goal_n - applied_n) > tolerance_n:
            self._band.restart()
            return StateEvent.MOVE
        inside = moment.touching and abs(demand.force_n - applied_n) <= tolerance_n
        inside = inside and abs(moment.reading.contact_n - demand.force_n) <= tolerance_n
        self._band.update(moment.now_s, inside, demand.in_band_time_s)
        if self._band.in_band:
            return StateEvent.SETTLE
        return StateEvent.MOVE if moment.touching or applied_n != goal_n else StateEvent.WAIT

    def _voltage(self, demand: Demand, moment: LoopInputs) -> StateEvent:
        self.trim.reset()
        self.law.take_over(moment.expected_n)
        self.feedforward_v = demand.voltage_v
        self.limited_by = self.stage.drive(demand.voltage_v)
        moving = self.limited_by is LimitedBy.VOLTAGE_SLEW
        answered = moving or moment.touching or moment.expected_n < _ANSWER_N
        self._answer.update(moment.now_s, answered, inf)
        if moving or demand.voltage_v <= 0.0:
            self._band.restart()
            return StateEvent.MOVE if moving else StateEvent.WAIT
        self._band.update(moment.now_s, True, demand.in_band_time_s)
        return StateEvent.SETTLE if self._band.in_band else StateEvent.MOVE
