"""Slip stops or blend: chosen on what neither has seen."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from gateway.bsfm import Branches, Bsfm, RationalBezier, SlipStops
from gateway.bsfm.curve import elevate_order
from gateway.bsfm.ladder.measured_ladder import Ladder, ladder_plan
from gateway.bsfm.slip import reversal_choice
from gateway.bsfm.slip.problem import Walk
from gateway.bsfm.slip.reversal_choice import choose_reversal

BRANCHES = Branches(
    RationalBezier(0.0, 8.0, (0.0, 20.0, 64.0), (1.0, 1.0, 1.0)),
    RationalBezier(0.0, 8.0, (0.0, 44.0, 64.0), (1.0, 1.0, 1.0)),
)
TRUE = Bsfm(BRANCHES, SlipStops((0.8, 2.0), (0.4, 0.6)))
TURNS_N = (1.0, 50.0, 15.0, 40.0, 22.0, 34.0, 8.0, 45.0, 20.0, 38.0, 5.0, 30.0, 12.0, 24.0)


def walk(turns_n: tuple[float, ...], per_way: int = 8) -> tuple[np.ndarray, np.ndarray]:
    """Volts and forces of the true model through these turns."""
    forces = [turns_n[0]]
    for a, b in pairwise(turns_n):
        forces += np.linspace(a, b, per_way + 1)[1:].tolist()
    memory, at_n, volts = TRUE.reversal.start(), 0.0, []
    for force_n in forces:
        memory, at_n = TRUE.memory_after(memory, at_n, force_n), force_n
        volts.append(TRUE.voltage_v(force_n, TRUE.branch_share(memory))[0])
    return np.array(volts), np.array(forces)


def ladder() -> Ladder:
    plan = ladder_plan(8.0, 0.4, 2)
    up = np.array(plan.direction) > 0
    volts = np.array(plan.voltage_v)
    force_n = np.where(up, BRANCHES.rising.value(volts), BRANCHES.falling.value(volts))
    return Ladder(volts, force_n, np.array(plan.direction), np.array(plan.group))


def test_a_walk_of_slip_stops_is_recognised_as_one() -> None:
    choice = choose_reversal(BRANCHES, ladder(), *walk(TURNS_N))
    assert choice is not None
    assert choice.slip is not None
    assert choice.slip_heldout_n < 0.9 * choice.blend_heldout_n
    assert choice.span_n > 0.0  # for upload and C code


def test_a_short_walk_identifies_the_blend_alone_and_none_nothing() -> None:
    volts, forces = walk(TURNS_N, 1)
    volts, forces = volts[:10], forces[:10]
    choice = choose_reversal(BRANCHES, ladder(), volts, forces)
    assert choice is not None
    assert choice.slip is None
    assert np.isnan(choice.slip_heldout_n)
    assert choose_reversal(BRANCHES, ladder(), volts[:3], forces[:3]) is None


def test_one_curve_for_both_ways_has_nothing_to_select() -> None:
    one = Branches(BRANCHES.rising, BRANCHES.rising)
    choice = choose_reversal(one, ladder(), *walk(TURNS_N))
    assert choice is not None
    assert choice.slip is None
    assert choice.model.branches == one


@pytest.mark.parametrize("points", [0, 2])
def test_nothing_is_chosen_from_nothing(points: int) -> None:
    assert choose_reversal(BRANCHES, ladder(), np.zeros(points), np.zeros(points)) is None


@pytest.mark.parametrize(("stops_n", "is_taken"), [(0.95, False), (0.85, True)])
def test_stops_are_taken_only_where_they_are_clearly_better(
    monkeypatch: pytest.MonkeyPatch, stops_n: float, is_taken: bool
) -> None:
    """And what a master that cannot carry them is left with is blended on the branches that they have moved."""
    moved = Branches(BRANCHES.rising, elevate_order(BRANCHES.falling))
    fitted = SimpleNamespace(branches=moved, model=TRUE)
    monkeypatch.setattr(reversal_choice, "_held_out_errors", lambda *_: (1.0, stops_n))
    monkeypatch.setattr(reversal_choice, "fit_joint", lambda *_: fitted)
    monkeypatch.setattr(reversal_choice, "choose_span_n", lambda branches, *_: 5.0 if branches is moved else 3.0)
    choice = choose_reversal(BRANCHES, ladder(), *walk(TURNS_N))
    assert choice is not None
    assert (choice.slip is not None, choice.span_n) == (is_taken, 5.0 if is_taken else 3.0)


def test_each_point_of_a_walk_is_judged_by_the_fit_that_has_not_seen_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """By the other half stops would win always: they have more numbers."""
    fits: list[np.ndarray] = []

    def fit(branches: Branches, walks: list[Walk], waves: int) -> SimpleNamespace:
        fits.append(np.asarray(walks[1].trust))
        return SimpleNamespace(model=fits[-1])

    def error_n(model: object, volts: np.ndarray, newtons: np.ndarray) -> np.ndarray:
        return np.asarray(model)[1:] if isinstance(model, np.ndarray) else np.ones(volts.size - 1)

    monkeypatch.setattr(reversal_choice, "fit_joint", fit)
    monkeypatch.setattr(reversal_choice, "command_error_n", error_n)
    errors_n = reversal_choice._held_out_errors(BRANCHES, ladder(), *walk(TURNS_N))
    assert errors_n == (1.0, 0.0), "1 where a fit has seen the point"
    assert (sum(fits) == 1.0).all() and len(fits) == 2
