"""The descent in its box: to the minimum of cost and ridge, from wherever it starts; what polishing takes, and when it ends."""

from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

from gateway.bsfm.fit import levenberg_marquardt
from gateway.bsfm.fit.levenberg_marquardt import QUIET_N2, RIDGE_SHARE, Effort, descend, lowest, minima, polish
from gateway.bsfm.fit.projected_problem import FitLanes, Floats, ProjectedProblem, merge_samples


def problem(order: int) -> ProjectedProblem:
    """A bent curve that no such order meets, with one minimum for each ridge and box below."""
    t = np.linspace(0.0, 1.0, 21)
    force_n = 30.0 * t**2 / (0.3 + t) + 3.0 * np.sin(5.0 * t) + np.random.default_rng(1).normal(0.0, 0.3, 21)
    return ProjectedProblem((merge_samples(t, force_n, np.ones(21)),), order, tied=False)


def total(of: ProjectedProblem, theta: Floats, ridge: float) -> Floats:
    return of.evaluate(theta).cost + ridge * np.sum(theta**2, axis=1)


@pytest.mark.sampled
@pytest.mark.parametrize("order", [2, 3])
@pytest.mark.parametrize(("ridge", "bound"), [(1e-6, 6.0), (1e-6, 0.5), (0.03, 6.0), (0.03, 0.5), (1.0, 0.5)])
def test_the_descent_ends_where_an_independent_optimiser_does(order: int, ridge: float, bound: float) -> None:
    """Some of these minima lie at the box: what pushes against it stands still, and the others go on."""
    of, starts = problem(order), np.random.default_rng(0).normal(size=(4, order))
    found = descend(of, starts, ridge, Effort(log_weight_max=bound))
    independent = minimize(
        lambda theta: total(of, theta[None], ridge)[0],
        np.zeros(order),
        bounds=[(-bound, bound)] * order,
        options={"ftol": 1e-15, "gtol": 1e-12},
    )
    assert total(of, found.theta, ridge) == pytest.approx(np.full(4, independent.fun), rel=1e-6)
    assert np.max(np.abs(found.theta)) <= bound


def test_a_ridge_that_rules_is_walked_down_at_once() -> None:
    """It is part of the curvature: a step by the data's alone would be thousands of times too long."""
    start = np.full((1, 2), 1.5)
    assert descend(problem(2), start, 1e4, Effort(), 3).theta == pytest.approx(np.zeros((1, 2)), abs=1e-3)


def test_a_start_outside_of_the_box_is_brought_into_it() -> None:
    """The lowest minimum may lie outside: from there every step into the box is worse."""
    of = problem(2)
    outside = descend(of, np.zeros((1, 2)), 1e-6, Effort()).theta
    assert np.max(np.abs(outside)) > 1.5
    for steps in (0, 100):
        inside = descend(of, outside, 1e-6, Effort(log_weight_max=0.5), steps)
        assert np.max(np.abs(inside.theta)) <= 0.5


def test_what_is_lower_than_its_neighbours_stays_where_it_is() -> None:
    of = problem(3)
    end = descend(of, np.zeros((1, 3)), 0.03, Effort())
    assert descend(of, end.theta, 0.03, Effort()).theta == pytest.approx(end.theta, abs=1e-4)


class Played:
    """A descent that comes back with these costs in turn, and keeps the ridges it was asked with."""

    def __init__(self, *costs: tuple[float, ...]) -> None:
        self.costs, self.ridges, self.starts = list(costs), list[float](), list[Any]()

    def descend(self, _problem: ProjectedProblem, starts: Floats, ridge: float, _effort: Effort) -> Any:
        self.ridges.append(ridge)
        self.starts.append(starts)
        cost = np.array(self.costs.pop(0))
        lanes: Any = SimpleNamespace(cost=cost, theta=cost[:, None])
        lanes.pick = lambda chosen: SimpleNamespace(cost=cost[chosen], theta=cost[chosen, None])
        return lanes


@pytest.mark.parametrize(
    ("costs", "asked_with", "taken"),
    [
        ([(0.5, 0.08), (0.05,), (0.03,), (0.02,)], [1e-6, 8e-7, 5e-7, 3e-7], 0.02),  # three times at most
        ([(0.08,), (0.05,), (0.06,)], [1e-6, 8e-7, 5e-7], 0.05),  # what got worse is not taken
        ([(0.08,), (0.075,)], [1e-6, 8e-7], 0.075),  # taken, but no more is to be had
        ([(0.1,)], [1e-6], 0.1),  # the ridge is small enough beside so much
        ([(0.09,), (QUIET_N2 / 2,)], [1e-6, 9e-7], QUIET_N2 / 2),  # nothing but rounding is left
    ],
)
def test_a_fit_is_polished_with_a_smaller_ridge_while_it_gains(
    costs: list[tuple[float, ...]], asked_with: list[float], taken: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    played = Played(*costs)
    monkeypatch.setattr(levenberg_marquardt, "descend", played.descend)
    of: Any = None
    best = polish(of, np.zeros((2, 1)), Effort(ridge_n2=1e-6))
    assert float(best.cost[0]) == taken
    assert played.ridges == pytest.approx(asked_with) and pytest.approx(1e-5) == RIDGE_SHARE
    assert [float(start[0, 0]) for start in played.starts[1:]] == [min(each) for each in costs[: len(asked_with) - 1]]


def costs_of(of: ProjectedProblem, theta: Floats) -> list[float]:
    return list(of.evaluate(theta).cost)


def test_minima_are_different_ones_and_the_lowest_comes_first() -> None:
    """From order 4 on there are several."""
    of = problem(5)
    found = minima(of, np.zeros((0, 5)), Effort(), count=3)
    costs = costs_of(of, found)
    assert len(costs) == 3
    assert all(later > 1.0005 * earlier for earlier, later in pairwise(costs))


def test_minima_begin_at_equal_weights_and_at_what_is_known_besides() -> None:
    """With no start of chance: then these two are all that there are."""
    of, alone = problem(5), Effort(screened=4, descending=0)
    equal = minima(of, np.zeros((0, 5)), alone)
    assert len(equal) == 1
    best = minima(of, np.zeros((0, 5)), Effort(), count=1)
    assert costs_of(of, best)[0] < 0.97 * costs_of(of, equal)[0]
    both = minima(of, np.concatenate([best, best]), alone)
    assert costs_of(of, both) == pytest.approx([*costs_of(of, best), *costs_of(of, equal)], rel=1e-3)


def test_the_lowest_lanes_are_picked_in_their_order() -> None:
    of = problem(2)
    lanes: FitLanes = of.evaluate(np.array([[3.0, 0.0], [0.0, -1.5], [0.0, 0.0]]))
    assert lowest(lanes, 2).theta.tolist() == lanes.theta[np.argsort(lanes.cost)[:2]].tolist()
