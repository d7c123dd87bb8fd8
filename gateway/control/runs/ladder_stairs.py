"""The stairs of a calibration run: sign and scale check, repeated staircases, partial reversals.

The check is a coarse cycle: it settles the friction, so that every group starts from the same history, and its first stair
is small. Turns of the minor-loop walk are shares of the top, of all sizes and on both sides; none
comes near both ends, so that no fit takes them for a group.

Defaults: LADDER_STEP_V, LADDER_GROUPS, LADDER_MINOR_POINTS and LADDER_RESPONSE_STEPS in gateway/defaults.py.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Final

from gateway import defaults
from gateway.bsfm import Bsfm
from gateway.bsfm.ladder.plan import FALLING, RISING, ladder_plan
from gateway.control.settings import Limits
from gateway.defaults import STRICT
from gateway.registers.words import CalibrationPhase

TURNS: Final = (0.0, 0.875, 0.25, 0.625, 0.375, 0.5625, 0.125, 0.75, 0.4375, 0.6875, 0.0625, 0.3125, 0.1875, 0.375)
CHECK_SHARES: Final = (0.25, 0.5, 0.75, 1.0, 0.75, 0.5, 0.25, 0.0)
RESPONSE_SHARES: Final = (0.25, 0.5, 0.8, 0.25, 0.8, 0.5)  # every way between three levels, again and again
FIRST_STAIR_N: Final = 4.0  # of the check: enough to see the sign, little enough if the scale is ten times off
OVER_FORCE_SHARE: Final = 0.93  # the largest planned force, of the one that trips: friction and noise need the rest
FORCE_MAX_SHARE: Final = 0.985  # and of the largest that the rig allows: what is measured must not pass that one
MOST_STAIRS: Final = 20_000


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationPlan:
    """v_max_v None: as high as model and limits allow. first_group: a resumed run goes on from there; as large as groups where
    only the reversal part is missing. tare: take the rest force as zero first. minor_points: 0 leaves the reversal part out.
    response_steps: large steps behind it, for dead time and lags; 0 leaves them out."""

    __pydantic_config__ = STRICT
    v_max_v: float | None = None
    step_v: float = defaults.LADDER_STEP_V
    groups: int = defaults.LADDER_GROUPS
    minor_points: int = defaults.LADDER_MINOR_POINTS
    response_steps: int = defaults.LADDER_RESPONSE_STEPS
    first_group: int = 0
    tare: bool = False


QUICK: Final = CalibrationPlan(step_v=defaults.QUICK_LADDER_STEP_V, groups=1, minor_points=32)


@dataclass(frozen=True, slots=True)
class PlannedStair:
    """Where to go, from which side, and what for. group: -1 outside the ladder; is_step: gone to at once in any case, for the
    response."""

    voltage_v: float
    direction: int
    group: int
    phase: CalibrationPhase
    is_step: bool = False


@lru_cache(maxsize=4)
def stairs_of(plan: CalibrationPlan, limits: Limits, model: Bsfm) -> tuple[PlannedStair, ...]:
    """Return the stairs of a whole run. ValueError with a sentence for a plan that the rig does not allow.

    Kept: a master that asks again and again for what is refused has them made each time, half a thousand, within its write."""
    top_v = _top(plan.v_max_v, limits, model)
    _check(plan, top_v)
    ladder = ladder_plan(top_v, plan.step_v, plan.groups)
    groups = zip(ladder.voltage_v, ladder.direction, ladder.group, strict=True)
    return (
        *check_stairs(top_v, model, limits.safe_voltage_v),
        *(
            PlannedStair(volts, way, group, CalibrationPhase.LADDER)
            for volts, way, group in groups
            if group >= plan.first_group
        ),
        *_minor_stairs(top_v, plan.minor_points),
        *_response_stairs(top_v, plan),
    )


def highest_voltage_v(limits: Limits, model: Bsfm, given_n: float = 0.0) -> float:
    """Return how high limits and calibration let a run go, to a hundredth of a volt: not near the over-force trip or
    force_max_n. given_n: what presses besides the slide, the payload's weight."""
    allowed_v = min(limits.voltage_max_v, model.voltage_range_v[1])
    force_v, _ = model.voltage_v(highest_force_n(limits) - max(0.0, given_n), float(RISING))
    return int(100.0 * min(allowed_v, force_v) + 1.0e-6) / 100.0


def highest_force_n(limits: Limits) -> float:
    """Return the largest force that a run may plan, N."""
    return min(FORCE_MAX_SHARE * limits.force_max_n, OVER_FORCE_SHARE * limits.over_force_n)


def _top(asked_v: float | None, limits: Limits, model: Bsfm) -> float:
    if asked_v is None:
        return highest_voltage_v(limits, model)
    if not 0.0 < asked_v <= limits.voltage_max_v:  # nor is nan
        raise ValueError(f"v_max = {asked_v:g} V, allowed up to {limits.voltage_max_v:g} V (rig limits)")
    beyond = max(1.0, asked_v / model.voltage_range_v[1])  # the model itself ends there
    expected_n = beyond * model.force_n(asked_v, float(RISING))  # the way down presses less than the top
    if expected_n > limits.over_force_n:
        raise ValueError(
            f"v_max = {asked_v:g} V makes {expected_n:.0f} N by the calibration in use, over-force trips at "
            f"{limits.over_force_n:g} N: at most {highest_voltage_v(limits, model):g} V"
        )
    if expected_n > limits.force_max_n:
        raise ValueError(
            f"v_max = {asked_v:g} V makes {expected_n:.1f} N by the calibration in use, the rig allows force_max_n = "
            f"{limits.force_max_n:g} N: at most {highest_voltage_v(limits, model):g} V"
        )
    return asked_v


def _check(plan: CalibrationPlan, top_v: float) -> None:
    if not 0.01 <= plan.step_v <= top_v / 3.0:
        raise ValueError(
            f"step = {plan.step_v:g} V, allowed 0.01 .. {top_v / 3.0:.2f} V (three stairs each way at least)"
        )
    last_start = plan.groups if plan.minor_points else plan.groups - 1
    if not (1 <= plan.groups <= 100 and 0 <= plan.first_group <= last_start):
        raise ValueError(f"groups = {plan.groups} from {plan.first_group}, allowed 1 .. 100")
    if not 0 <= plan.minor_points <= 2000:
        raise ValueError(f"minor_points = {plan.minor_points}, allowed 0 .. 2000")
    if not 0 <= plan.response_steps <= 200:
        raise ValueError(f"response_steps = {plan.response_steps}, allowed 0 .. 200")
    if 2.0 * top_v / plan.step_v * plan.groups > MOST_STAIRS:
        raise ValueError(f"{2.0 * top_v / plan.step_v * plan.groups:.0f} stairs: at most {MOST_STAIRS}")


def check_stairs(top_v: float, model: Bsfm, rest_v: float = 0.0) -> tuple[PlannedStair, ...]:
    """Return the coarse cycle at the beginning of a run, from the voltage at rest up to top_v and back."""
    first_v, _ = model.voltage_v(FIRST_STAIR_N + model.force_n(rest_v, float(RISING)), float(RISING))
    way_v = top_v - rest_v
    voltages = [min(first_v, rest_v + 0.2 * way_v), *(rest_v + share * way_v for share in CHECK_SHARES)]
    ways = [RISING if b > a else FALLING for a, b in zip([rest_v, *voltages], voltages, strict=False)]
    return tuple(
        PlannedStair(volts, way, -1, CalibrationPhase.CHECK) for volts, way in zip(voltages, ways, strict=True)
    )


def _minor_stairs(top_v: float, points: int) -> tuple[PlannedStair, ...]:
    if points == 0:
        return ()
    ways = list(pairwise(TURNS))
    travel = sum(abs(b - a) for a, b in ways)
    stairs = []
    for a, b in ways:
        count = max(1, round(points * abs(b - a) / travel))
        stairs += [(a + (b - a) * (k + 1) / count, RISING if b > a else FALLING) for k in range(count)]
    return tuple(PlannedStair(share * top_v, way, -1, CalibrationPhase.MINOR_LOOPS) for share, way in stairs)


def _response_stairs(top_v: float, plan: CalibrationPlan) -> tuple[PlannedStair, ...]:
    """Part of the walk of partial reversals, and only behind it: their settled ends are points of it like any other."""
    if plan.minor_points == 0:
        return ()
    shares = [TURNS[-1], *(RESPONSE_SHARES[k % len(RESPONSE_SHARES)] for k in range(plan.response_steps))]
    return tuple(
        PlannedStair(share * top_v, RISING if share > before else FALLING, -1, CalibrationPhase.MINOR_LOOPS, True)
        for before, share in pairwise(shares)
    )
