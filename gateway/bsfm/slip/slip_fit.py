"""Which reversal describes a rig: slip stops fitted to its walks, judged beside linear blend and switched branches.

Two fits: `fit_stops` leaves the branches as they are, `fit_joint` moves them with the stops, minor-loop points in
the fit. The joint fit is the one that pays: branches that were fitted to a staircase already contain its two turns, and no
selection between them can take these out again. Radii stand on a grid, from a fraction of the loop's width to a share of
the range; the non-negative fit picks few of them. Shares below SMALLEST_SHARE, and the smallest of more than a set of
registers carries, are dropped and the rest fitted again.

Both are robust: one round of Huber weights after the first fit. The joint fit is a small least-squares problem with the
shares projected out, and a ridge on the log weights, which the data leave open. It is held to what may drive a plant
(slope floor, no crossing) by penalties on a grid: near the ends no walk reaches a branch, so nothing else would. A result
that fails the exact verdicts all the same, often by a millionth of a newton where the branches meet, is looked for again with
a margin, and then with a larger one. One order more is tried, too: the walk adds points between the stairs. Where nothing
usable is found, the stops alone are fitted.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.bsfm.branches import Branches
from gateway.bsfm.coefficients import SLOPE_FLOOR_N_PER_V
from gateway.bsfm.curve import elevate_order
from gateway.bsfm.fit.blend_span import choose_span_n, command_error_n, rms_n
from gateway.bsfm.fit.projected_problem import Floats
from gateway.bsfm.fit.result import verdicts_of
from gateway.bsfm.fit.usable_fit import is_moderate
from gateway.bsfm.ladder.measured_ladder import Ladder
from gateway.bsfm.model import Bsfm
from gateway.bsfm.slip.problem import SlipProblem, Walk
from gateway.bsfm.slip.reversal import LinearBlend
from gateway.bsfm.slip.search import SlipSearch
from gateway.bsfm.slip.slip_stops import STOPS_CARRIED, SlipStops, half_width_bound_v
from gateway.robust import HUBER_AT, SIGMA_PER_MAD

RADII: Final = 12
SMALLEST_HALF_WIDTHS, LARGEST_RANGE_SHARE = 0.5, 0.4
SMALLEST_SHARE: Final = 0.01
SMALLEST_SIGMA_N: Final = 1.0e-6
MARGINS: Final = (0.0, 0.2, 0.8)
HIGHEST_ORDER: Final = 4  # to which one more is tried
NUMBERS_OF_AN_ORDER: Final = 4  # a handle and a weight on each branch
LEAST_GAIN_N: Final = 0.05  # of RMS error: less is no reason for a model that costs more in C and in each step


@dataclass(frozen=True, slots=True, eq=False)
class SlipFit:
    """Branches with the stops that select between them. rms_n, max_n: of the points that were fitted. joint: the
    branches were moved."""

    branches: Branches
    stops: SlipStops
    rms_n: float
    max_n: float
    points: int
    joint: bool

    @property
    def model(self) -> Bsfm:
        """The model for control."""
        return Bsfm(self.branches, self.stops)


@dataclass(frozen=True, slots=True)
class PolicyError:
    """One policy on a walk: RMS and largest error of the command in N, and its model."""

    policy: str
    rms_n: float
    max_n: float
    model: Bsfm


def walk_of(ladder: Ladder) -> Walk:
    """Return the staircase as a walk: the mean of its groups, where all of them visit the same stairs, else all in order."""
    groups = [ladder.part(ladder.group == group) for group in ladder.groups]
    first = groups[0].voltage_v
    if all(len(group) == len(first) and np.allclose(group.voltage_v, first, atol=5.0e-3) for group in groups):
        return Walk(first, np.mean([group.force_n for group in groups], axis=0))
    return Walk(ladder.voltage_v, ladder.force_n)


def fit_stops(branches: Branches, walks: Sequence[Walk]) -> SlipFit:
    """Fit the stops alone. ValueError when there is no point, or no loop between the branches."""
    problem = SlipProblem(list(walks), _radii_v(branches))
    problem.weight = problem.weight * _huber(problem, problem.errors_n(branches))
    return _result(problem, branches, joint=False)


def fit_joint(branches: Branches, walks: Sequence[Walk], highest_order: int = HIGHEST_ORDER) -> SlipFit:
    """Fit branches and stops together, from these branches on; return the stops alone where that leads to no usable model.
    One order more is tried up to highest_order."""
    best = fit_stops(branches, walks)
    if branches.rising.order != branches.falling.order:
        return best
    starts = [branches, _raise_orders(branches)] if branches.rising.order < highest_order else [branches]
    for start in starts:
        joint = _usable_joint(start, walks)
        if joint and (_is_worth_an_order(joint, best) if best.joint else joint.rms_n < best.rms_n):
            best = joint
    return best


def _usable_joint(start: Branches, walks: Sequence[Walk]) -> SlipFit | None:
    """With the smallest margin that leads to what may drive a plant."""
    measured_n = max(float(np.abs(walk.force_n).max()) for walk in walks)
    for margin in MARGINS:
        problem = SlipProblem(list(walks), _radii_v(start))
        trust, branches = problem.weight, start
        for _ in range(2):
            branches = SlipSearch(problem, branches, margin).best()
            problem.weight = trust * _huber(problem, problem.errors_n(branches))
        if verdicts_of(branches, SLOPE_FLOOR_N_PER_V).usable and is_moderate(branches, measured_n):
            return _result(problem, branches, joint=True)
    return None


def _is_worth_an_order(higher: SlipFit, lower: SlipFit) -> bool:
    """Return whether one order more pays: by Schwarz's criterion (BIC), and by an error that anybody would notice."""
    share = higher.points ** (-NUMBERS_OF_AN_ORDER / (2.0 * higher.points))
    return bool(higher.rms_n < min(lower.rms_n * share, lower.rms_n - LEAST_GAIN_N))


def _raise_orders(branches: Branches) -> Branches:
    """The same curves with one order more."""
    return Branches(elevate_order(branches.rising), elevate_order(branches.falling))


def compare_policies(branches: Branches, fits: Sequence[SlipFit], training: Walk, held_out: Walk) -> list[PolicyError]:
    """Compare switched branches, the blend with its best span on `training`, and each slip fit, all on `held_out`.

    PolicyError as control would use them (blend_span.command_error_n): driven by the forces, told in newtons.
    """
    span_n = choose_span_n(branches, training.voltage_v, training.force_n)
    models = [("branches switched", Bsfm(branches, LinearBlend(0.0)))]
    if span_n is not None:
        models.append((f"linear blend over {span_n:g} N", Bsfm(branches, LinearBlend(span_n))))
    models += [(f"slip stops, {'joint fit' if fit.joint else 'branches kept'}", fit.model) for fit in fits]
    return [_judge(policy, model, held_out) for policy, model in models]


def _judge(policy: str, model: Bsfm, walk: Walk) -> PolicyError:
    error_n = command_error_n(model, walk.voltage_v, walk.force_n)
    return PolicyError(policy, rms_n(error_n), float(np.abs(error_n).max()), model)


def _radii_v(branches: Branches) -> Floats:
    half_v = half_width_bound_v(branches)
    range_v = branches.rising.x1 - branches.rising.x0
    if branches.rising == branches.falling:
        raise ValueError("the branches are one curve: there is no loop that slip stops could select in")
    radii: Floats = np.geomspace(SMALLEST_HALF_WIDTHS * half_v, max(LARGEST_RANGE_SHARE * range_v, 2 * half_v), RADII)
    return radii


def _huber(problem: SlipProblem, error_n: Floats) -> Floats:
    """Square roots of Huber's weights; points without trust count neither for the scale nor afterwards."""
    trusted = np.abs(error_n[problem.weight > 0.0])
    if trusted.size == 0:
        raise ValueError("no point to fit slip stops to")
    limit_n = HUBER_AT * max(SIGMA_PER_MAD * float(np.median(trusted)), SMALLEST_SIGMA_N)
    weights: Floats = np.sqrt(np.minimum(1.0, limit_n / np.maximum(np.abs(error_n), limit_n)))
    return weights


def _result(problem: SlipProblem, branches: Branches, *, joint: bool) -> SlipFit:
    """Few stops: the small shares dropped, the others fitted again."""
    first = problem.shares(branches)
    largest = np.isin(np.arange(len(first)), np.argsort(first)[-STOPS_CARRIED:])
    keep = largest & (first >= SMALLEST_SHARE)
    problem.radii_v, problem.places = problem.radii_v[keep], problem.places[:, keep]
    shares = problem.shares(branches)
    error_n = problem.errors_n(branches, shares)[problem.weight > 0.0]
    keep = shares > 0.0
    stops = SlipStops(_plain(problem.radii_v[keep]), _plain(shares[keep]))
    return SlipFit(branches, stops, rms_n(error_n), float(np.abs(error_n).max()), len(error_n), joint)


def _plain(values: Floats) -> tuple[float, ...]:
    return tuple(float(value) for value in values)
