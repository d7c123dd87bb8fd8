"""Feed the accepted force forward to a voltage: approach, ramp, reversal, inverse model.

Approach: without contact the tool waits at the pre-contact force; from contact the target rises over contact_ramp_s, or
by the force ramp where that is slower. Lost contact takes the target back at once: a free tool must not shoot out with
the full force. The reversal's memory follows changes of what the slide has to give, by target and weight
(gateway.bsfm.slip.reversal), never the measured force, whose noise would chatter; a vented tool starts where the calibration
ladder starts, and a tool that has lost contact on the rising branch, because it slides outwards.
"""

from math import isfinite
from typing import Final

from gateway.bsfm import FALLING, RISING, Bsfm, InverseStatus
from gateway.bsfm.slip.reversal import Memory
from gateway.control.demand import Demand
from gateway.control.force_loop.setpoint_trend import SetpointTrend
from gateway.control.force_loop.transport_delay import TransportDelay
from gateway.control.limits import TICK_S, RateBudget, is_below_usable, narrow_limits, ramp_limited, trim_limited
from gateway.control.settings import Limits
from gateway.registers.words import LimitedBy

_CARRY_OVER_S: Final = 0.5  # time in which a swapped calibration's voltage difference fades
AHEAD_N: Final = 4.0  # how far the aim may run ahead of the target, or what the lags' inverse needs on a fast ramp
APPROACH_N: Final = 1.0  # above what friction keeps: a vented tool moves
YIELDS_OVER_N: Final = 0.3  # a usual correction
LEAST_SLOPE_N_PER_V: Final = 1.0  # a flatter model is a model's end, not a plant's
_OK: Final = InverseStatus.OK
_NONE: Final = LimitedBy.NONE


class ModelError(Exception):
    """The model gave no usable voltage for a finite force."""


class Approach:
    """Goal and rate of the target by contact, and when the present contact began."""

    def __init__(self) -> None:
        self._touched_s: float | None = None

    def goal(self, now_s: float, demand: Demand, touching: bool, law: "Feedforward") -> tuple[float, float]:
        """Return (goal N, rate N/s) for this step."""
        applied_n, manner = law.applied_n, demand.manner
        if not touching:
            self._touched_s = None
            return min(demand.force_n, law.approaching_n(manner.precontact_n)), manner.ramp_n_per_s
        if self._touched_s is None:
            self._touched_s = now_s
        left_s = manner.contact_ramp_s - (now_s - self._touched_s)
        rise_n = demand.force_n - applied_n
        if left_s <= 0.0 or rise_n <= 0.0:
            return demand.force_n, manner.ramp_n_per_s
        return demand.force_n, min(manner.ramp_n_per_s, rise_n / max(left_s, TICK_S))


class Feedforward:
    """Holds the applied target, its expected course in the plant (reference_n) and what the reversal remembers. branch_share:
    place of the plant between the branches, -1 .. 1, by that memory; is_low: the model's range begins above the aim."""

    def __init__(
        self, model: Bsfm, limits: Limits, response_lag_s: float, delay_s: float = 0.0, ahead_s: float = 0.0
    ) -> None:
        """delay_s: before the force begins to follow at all, not part of response_lag_s; ahead_s: how far the aim runs ahead of
        the applied target on a ramp, because the plant arrives so much later."""
        self.model = model
        self._rig_limits = limits
        self._limits = narrow_limits(limits, model.limits_n)
        self._lag_s = response_lag_s
        self._delayed = TransportDelay(delay_s)
        self._ahead_s = ahead_s
        self._trend = SetpointTrend()
        self.reset()

    def retime(self, response_lag_s: float, delay_s: float, ahead_s: float) -> None:
        """Replace the response: lag, dead time and how far ahead the setpoint is known, s."""
        self._lag_s, self._ahead_s = response_lag_s, ahead_s
        self._delayed = TransportDelay(delay_s)
        self._delayed.restart(self.applied_n)

    def reset(self) -> None:
        """Forget everything: vented, nothing applied."""
        self.applied_n = self.aimed_n = self.reference_n = self._given_n = 0.0
        self._delayed.restart(0.0)
        self._trend.restart()
        self._remember(self.model.reversal.start())
        self._slide = self._memory
        self._slid_n = 0.0
        self._pace = RateBudget()
        self._carry_over_v = 0.0
        self.is_low = False

    def _remember(self, memory: Memory) -> None:
        self._memory, self.branch_share = memory, self.model.reversal.branch_share(memory)

    def approaching_n(self, precontact_n: float) -> float:
        """Return the pre-contact force, but never one that cannot move a vented tool, as 0 V below the smallest usable one.
        Friction alone keeps pressed what the ladder's lowest stair shows, and where the ladder begins to press it has been
        overcome twice. What a model presses that begins above 0 V is no friction: its falling branch is led on to 0 V."""
        least_n, (least_v, _) = self.model.force_range_n[0], self.model.voltage_range_v
        if least_v > 0.0:
            falling = self.model.branches.falling
            least_n = max(0.0, least_n - falling.slope(falling.x0) * falling.x0)
        return max(precontact_n, 2.0 * least_n + APPROACH_N, self._limits.smallest_force_n)

    def use(self, model: Bsfm, gravity_n: float, correction_limit_v: float = 0.0) -> None:
        """Swap the model without a bump: the voltage difference is carried over and fades, with what a correction may add, 0
        without one. An equal one changes nothing, for no share says as much as the memory that it would replace."""
        if model == self.model:
            return
        before_v = self._total_v(gravity_n, correction_limit_v)
        slide = model.reversal.at(self.model.reversal.branch_share(self._slide))
        self.model, self._slide = model, slide
        self._remember(model.reversal.at(self.branch_share))
        self._limits = narrow_limits(self._rig_limits, model.limits_n)
        self._carry_over_v += before_v - self._total_v(gravity_n, correction_limit_v)

    def _total_v(self, gravity_n: float, correction_limit_v: float) -> float:
        return self.compute_voltage(gravity_n)[0] + trim_limited(self.correction_v(gravity_n), correction_limit_v)[0]

    def replace_volts(self, trim_v: float, correction_n: float, correction_limit_v: float, gravity_n: float) -> None:
        """Replace what a trim has corrected by volts by a correction in newtons, without a bump: as in `use`."""
        self.correct(correction_n, gravity_n)
        self._carry_over_v += trim_v - trim_limited(self.correction_v(gravity_n), correction_limit_v)[0]

    def advance(self, goal_n: float, rate_n_per_s: float, dt_s: float, gravity_n: float = 0.0) -> float:
        """Move the applied target towards the goal; returns by how much that moves the slide, N. gravity_n: of the target, what
        does not come from the slide: the payload's weight, forces from outside; it is there at once, and the slide makes room
        for it no sooner than it follows. The aim is where the target will be ahead_s later: on its ramp, and where the goal
        itself moves steadily, on the goal's way; on a fast ramp it stays nearer, so that it remains one."""
        self._trend.advance(goal_n, dt_s)
        self._pace.earn(dt_s)
        last_n, given_n = self.applied_n, self._given_n if self.applied_n > 0.0 else gravity_n
        self.applied_n = ramp_limited(goal_n, last_n, rate_n_per_s, self._pace.available_s)
        self._lower_carry_over(last_n)
        moved_n, self._given_n = self.applied_n - last_n, gravity_n
        if moved_n:
            self._pace.spend(moved_n, rate_n_per_s)
        aimed_n, self.aimed_n = self.aimed_n, self._aim_n(goal_n, rate_n_per_s)
        self._turn(aimed_n - given_n, self.aimed_n - gravity_n)
        delayed_n = self._delayed.advance(self.applied_n, dt_s)
        self.reference_n += gravity_n - given_n
        self.reference_n += (delayed_n - self.reference_n) * dt_s / (self._lag_s + dt_s)
        self._carry_over_v -= self._carry_over_v * dt_s / (_CARRY_OVER_S + dt_s)
        return moved_n - (gravity_n - given_n)

    def _lower_carry_over(self, last_n: float) -> None:
        """Of a swap's difference no more stays than of the force that it was for; last_n: the target before."""
        if self.applied_n < last_n:
            self._carry_over_v *= self.applied_n / last_n

    def _aim_n(self, goal_n: float, rate_n_per_s: float) -> float:
        """Where the target will be ahead_s later."""
        if self._ahead_s <= 0.0 or goal_n <= 0.0 or rate_n_per_s <= 0.0:
            return self.applied_n
        ahead_s = min(self._ahead_s, max(AHEAD_N / rate_n_per_s, self._lag_s))
        return ramp_limited(self._coming_n(goal_n), self.applied_n, rate_n_per_s, ahead_s)

    def _coming_n(self, goal_n: float) -> float:
        """Where a goal above 0 will be ahead_s later; never outside what may be commanded."""
        moved_n = self._trend.ahead_n(self._ahead_s)
        if moved_n == 0.0 or is_below_usable(goal_n + moved_n, self._limits):
            return goal_n
        return min(max(goal_n, self._limits.force_max_n), goal_n + moved_n)

    def _turn(self, from_n: float, to_n: float) -> None:
        """What the slide, whose thrust the model knows, remembers of this movement."""
        if self.applied_n <= 0.0:
            self._remember(self.model.reversal.start())
        elif from_n != to_n:
            self._remember(self.model.memory_after(self._memory, from_n, to_n))

    def correct(self, correction_n: float, gravity_n: float) -> None:
        """Slide to where the aim and a trim's correction of it lead, in one movement.
        Friction turns round with their sum, and with nothing else."""
        slid_n, self._slid_n = self._slid_n, self.aimed_n + correction_n - gravity_n
        if self.applied_n <= 0.0:
            self._slide = self._memory
        elif slid_n != self._slid_n:
            self._slide = self.model.memory_after(self._slide, slid_n, self._slid_n)

    def correction_v(self, gravity_n: float) -> float:
        """Return what the correction adds to the feedforward: by the slide's own friction, not by the target's."""
        if self.applied_n <= 0.0 or is_below_usable(self.applied_n, self._limits):
            return 0.0
        corrected_v, _ = self.model.voltage_v(self._slid_n, self.model.reversal.branch_share(self._slide))
        return corrected_v - self.model.voltage_v(self.aimed_n - gravity_n, self.branch_share)[0]

    def yielded_share(self, coming_n: float) -> float:
        """Return how much force a further newton of thrust makes, 0 .. 1, of this sign, where the slide is now: along a
        branch all of it; behind a turn friction takes most of it first."""
        if self.applied_n <= 0.0 or coming_n == 0.0:
            return 1.0
        to_n = self._slid_n + (YIELDS_OVER_N if coming_n > 0.0 else -YIELDS_OVER_N)
        model, share = self.model, self.model.reversal.branch_share
        before, after = share(self._slide), share(model.memory_after(self._slide, self._slid_n, to_n))
        from_v, along_v = model.voltage_v(self._slid_n, before)[0], model.voltage_v(to_n, before)[0]
        turned_v = model.voltage_v(to_n, after)[0]
        return (along_v - from_v) / (turned_v - from_v) if turned_v != from_v else 1.0

    def carry_freely(self, gravity_n: float) -> None:
        """Take over a weight that changes without contact, as in `advance`: nothing presses that friction could turn with."""
        self._given_n = gravity_n

    def fall_back(self, goal_n: float, gravity_n: float = 0.0) -> None:
        """Drop to the goal at once when contact is lost, and stay on the rising branch for the next contact. Nothing corrects
        it any more; gravity_n as in `advance`."""
        last_n = self.applied_n
        self.applied_n = self.aimed_n = min(last_n, goal_n)
        self._lower_carry_over(last_n)
        self._remember(self.model.reversal.at(RISING))
        self._place_slide(gravity_n)

    def _place_slide(self, gravity_n: float) -> None:
        """The slide is where the aim is. It has not been moved there, or friction would turn round with it."""
        self._slide, self._slid_n = self._memory, self.aimed_n - gravity_n

    def slope_n_per_v(self, gravity_n: float) -> float:
        """Return how much force a volt as sent makes at the working point, N/V, by the branches as they are shared there."""
        model, force_n, share = self.model, self.aimed_n - gravity_n, 0.5 + 0.5 * self.branch_share
        rising, _ = model.branch_slopes_n_per_v(model.voltage_v(force_n, RISING)[0])
        _, falling = model.branch_slopes_n_per_v(model.voltage_v(force_n, FALLING)[0])
        return 1.0 / (share / max(LEAST_SLOPE_N_PER_V, rising) + (1.0 - share) / max(LEAST_SLOPE_N_PER_V, falling))

    def begin_at(self, contact_n: float) -> None:
        """Begin the expected course at the force that is left of before, N: right behind a disable or a restart it still goes,
        and a trim that took it for an error would pull the new one down with it."""
        self.reference_n = max(0.0, contact_n)

    def take_over(self, force_n: float, branch_share: float = RISING, gravity_n: float = 0.0) -> None:
        """Follow a force that another mode drives, so that coming back to force mode makes no bump: what a swapped calibration
        carries over was for a voltage of ours. gravity_n as in `advance`."""
        self._carry_over_v, self._given_n = 0.0, gravity_n
        self._trend.restart()
        self.applied_n = self.aimed_n = self.reference_n = max(0.0, min(self._limits.force_max_n, force_n))
        self._delayed.restart(self.applied_n)
        self._remember(self.model.reversal.at(branch_share))
        self._place_slide(gravity_n)

    def compute_voltage(self, gravity_n: float) -> tuple[float, LimitedBy]:
        """Return the voltage for the applied contact force by the inverse model and what limited it. ModelError without one."""
        if self.applied_n <= 0.0:
            return 0.0, _NONE
        if is_below_usable(self.applied_n, self._limits):
            return 0.0, LimitedBy.SMALLEST_FORCE
        try:
            voltage_v, status = self.model.voltage_v(self.aimed_n - gravity_n, self.branch_share)
        except ValueError as error:
            raise ModelError(f"model: {error}") from error
        self.is_low = status is InverseStatus.LOW
        if not isfinite(voltage_v):
            raise ModelError(f"model: {voltage_v} V for {self.aimed_n:.2f} N")
        return voltage_v + self._carry_over_v, _NONE if status is _OK else LimitedBy.CALIBRATION_RANGE
