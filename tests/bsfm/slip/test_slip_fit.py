"""The slip fit: finds what made the data, bears outliers, and beats the blend on walks that it has not seen."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from gateway.bsfm import Branches, Bsfm, LinearBlend, RationalBezier, SlipStops
from gateway.bsfm.coefficients import SLOPE_FLOOR_N_PER_V
from gateway.bsfm.fit.branch_fit import fit
from gateway.bsfm.fit.projected_problem import Floats
from gateway.bsfm.fit.result import verdicts_of
from gateway.bsfm.ladder.measured_ladder import Ladder, ladder_plan
from gateway.bsfm.slip import slip_fit
from gateway.bsfm.slip.problem import SlipProblem, branches_of, free_numbers, inverses, places
from gateway.bsfm.slip.search import SlipSearch
from gateway.bsfm.slip.slip_fit import (
    Walk,
    compare_policies,
    fit_joint,
    fit_stops,
    walk_of,
)

RISING = RationalBezier(0.0, 5.0, (0.8, 17.0, 39.0), (1.0, 1.0, 1.1))
FALLING = RationalBezier(0.0, 5.0, (0.8, 25.0, 43.0), (1.0, 1.0, 1.0))
STOPS = SlipStops((0.45, 0.9, 1.4), (0.3, 0.4, 0.3))
TRUTH = Bsfm(Branches(RISING, FALLING), STOPS)
TURNS_V = (0.0, 4.4, 1.2, 3.1, 1.9, 2.8, 0.6, 3.75, 2.2, 3.4, 0.3, 1.6, 0.9, 1.9)
OTHER_TURNS_V = (0.0, 4.1, 2.2, 3.1, 0.9, 2.5, 1.6, 4.7, 3.4, 4.1)
NOISE_N = 0.05


def forces_n(voltage_v: Floats, seed: int, noise_n: float = NOISE_N) -> Floats:
    """What the truth gives along these voltages, from a full fall."""
    at = places(voltage_v, np.array(STOPS.radii_v)).tolist()
    shares = [STOPS.branch_share(tuple(place)) for place in at]
    clean = [TRUTH.settled_n(volts, share) for volts, share in zip(voltage_v.tolist(), shares, strict=True)]
    return np.array(clean) + noise_n * np.random.default_rng(seed).standard_normal(len(clean))


def walk(turns_v: tuple[float, ...], seed: int, noise_n: float = NOISE_N) -> Walk:
    ways = [np.linspace(a, b, max(2, round(abs(b - a) / 0.2)))[1:] for a, b in pairwise(turns_v)]
    voltage_v = np.concatenate([np.array(turns_v[:1]), *ways])
    return Walk(voltage_v, forces_n(voltage_v, seed, noise_n))


def residuals_n(model: Bsfm, other: Walk) -> Floats:
    """Model minus walk at each point, the stops moved by the voltages."""
    assert isinstance(model.reversal, SlipStops)
    problem = SlipProblem([other], np.array(model.reversal.radii_v))
    return problem.errors_n(model.branches, np.array(model.reversal.shares))


@cache
def ladder() -> Ladder:
    plan = ladder_plan(5.0, 0.1, 4)
    voltage_v = np.array(plan.voltage_v)
    return Ladder(voltage_v, forces_n(voltage_v, 3, 0.1), np.array(plan.direction), np.array(plan.group))


@cache
def tied() -> Branches:
    return fit(ladder(), "bsfm", 2, "tied").branches


def test_stops_of_known_branches_are_found_from_a_minor_loop_walk() -> None:
    result = fit_stops(TRUTH.branches, [walk(TURNS_V, 1)])
    other = walk(OTHER_TURNS_V, 2, noise_n=0.0)
    assert not result.joint and result.branches == TRUTH.branches
    assert result.rms_n < 1.2 * NOISE_N
    assert np.abs(residuals_n(result.model, other)).max() < 0.1
    assert sum(result.stops.shares) == pytest.approx(1.0)


def test_the_joint_fit_finds_branches_that_no_staircase_shows() -> None:
    result = fit_joint(tied(), [walk_of(ladder()), walk(TURNS_V, 1)])
    other = walk(OTHER_TURNS_V, 2, noise_n=0.0)
    assert result.joint
    assert np.sqrt(np.mean(residuals_n(result.model, other) ** 2)) < NOISE_N
    assert (
        np.abs(
            result.branches.falling.value(np.linspace(0.5, 4.0, 30)) - FALLING.value(np.linspace(0.5, 4.0, 30))
        ).max()
        < 0.4
    )
    assert verdicts_of(result.branches, SLOPE_FLOOR_N_PER_V).usable


@pytest.mark.sampled
@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("top", [1.0, 2.0])
def test_the_searchs_gradient_is_that_of_its_residuals(order, top) -> None:
    """Kaufman's Jacobian leaves out only what is orthogonal to the residuals. top: of the falling branch, beyond what its
    handles may be as well."""
    problem = SlipProblem([walk_of(ladder()), walk(TURNS_V, 1)], np.geomspace(0.3, 2.0, 6))
    search = SlipSearch(problem, fit(ladder(), "bsfm", order, "tied").branches)
    at = free_numbers(search._start) * 1.01
    at[2] *= top
    gradient = search.jacobian(at).T @ search.residuals(at)

    def half_square(numbers: Floats) -> float:
        return 0.5 * float(np.sum(search.residuals(numbers) ** 2))

    steps = 1.0e-5 * np.maximum(1.0, np.abs(at))
    slopes = [
        (half_square(at + step * unit) - half_square(at - step * unit)) / (2.0 * step)
        for step, unit in zip(steps, np.eye(len(at)), strict=True)
    ]
    assert gradient == pytest.approx(slopes, abs=0.01 * np.abs(slopes).max())


def test_on_another_walk_slip_beats_the_blend_and_the_blend_beats_switching() -> None:
    training, other = walk(TURNS_V, 1), walk(OTHER_TURNS_V, 2)
    slip = fit_joint(tied(), [walk_of(ladder()), training])
    switched, blend, stops = compare_policies(tied(), [slip], training, other)
    assert "switched" in switched.policy and "blend" in blend.policy and "joint" in stops.policy
    assert 3.0 * stops.rms_n < blend.rms_n < 0.5 * switched.rms_n
    assert isinstance(blend.model.reversal, LinearBlend) and stops.model == slip.model


def test_a_fit_never_gives_more_stops_than_registers_carry(monkeypatch) -> None:
    """As on data that ask for more: the bound is lowered instead, for no known data ask for more than seven."""
    whole = fit_stops(TRUTH.branches, [walk(TURNS_V, 1)])
    assert 4 <= len(whole.stops.radii_v) <= slip_fit.STOPS_CARRIED == 10
    monkeypatch.setattr(slip_fit, "STOPS_CARRIED", 3)
    cut = fit_stops(TRUTH.branches, [walk(TURNS_V, 1)])
    assert len(cut.stops.radii_v) == 3 and set(cut.stops.radii_v) <= set(whole.stops.radii_v)
    assert sum(cut.stops.shares) == pytest.approx(1.0)
    assert cut.rms_n < 1.5 * whole.rms_n


def test_wild_points_hardly_move_the_stops() -> None:
    clean = walk(TURNS_V, 1)
    wild = replace(clean, force_n=clean.force_n + np.where(np.arange(len(clean.force_n)) % 17 == 5, 4.0, 0.0))
    other = walk(OTHER_TURNS_V, 2, noise_n=0.0)
    calm, shaken = (fit_stops(TRUTH.branches, [each]).model for each in (clean, wild))
    assert np.abs(residuals_n(shaken, other) - residuals_n(calm, other)).max() < 0.25


def test_points_without_trust_are_passed_but_not_fitted() -> None:
    whole = walk(TURNS_V, 1)
    trust = np.where(np.arange(len(whole.force_n)) % 3 == 0, 0.0, 1.0)
    spoilt = replace(whole, force_n=whole.force_n + 9.0 * (trust == 0.0), trust=trust)
    clean, result = fit_stops(TRUTH.branches, [replace(whole, trust=trust)]), fit_stops(TRUTH.branches, [spoilt])
    assert (result.stops, result.rms_n) == (clean.stops, clean.rms_n)
    assert result.points == int(trust.sum())


def test_no_trust_at_all_and_no_loop_are_refused() -> None:
    nothing = walk(TURNS_V, 1)
    with pytest.raises(ValueError, match="no point"):
        fit_stops(TRUTH.branches, [replace(nothing, trust=np.zeros(len(nothing.force_n)))])
    with pytest.raises(ValueError, match="one curve"):
        fit_stops(Branches(RISING, RISING), [nothing])
    with pytest.raises(ValueError, match="one length"):
        Walk(np.zeros(3), np.zeros(4))


def test_a_staircase_is_walked_once_with_the_mean_of_its_groups() -> None:
    stairs = walk_of(ladder())
    assert len(stairs.voltage_v) == 101
    assert stairs.force_n == pytest.approx(ladder().force_n.reshape(4, 101).mean(axis=0))
    cut = ladder().part(np.arange(len(ladder())) < 350)
    assert len(walk_of(cut).voltage_v) == 350


def test_the_found_stops_always_leave_the_voltage_unique() -> None:
    """A friction without presliding: the walk asks for stops without any width, and gets the stiffest that may be."""
    sharp = walk(TURNS_V, 1)
    switched = np.where(
        np.diff(sharp.voltage_v, prepend=-1.0) > 0, RISING.value(sharp.voltage_v), FALLING.value(sharp.voltage_v)
    )
    result = fit_stops(TRUTH.branches, [Walk(sharp.voltage_v, switched)])
    assert result.model.reversal == result.stops  # Bsfm proves it, or raises


def test_table_inverse_and_free_numbers_agree_with_the_curves() -> None:
    forces = np.linspace(0.8, 39.0, 101)
    exact = [RISING.inverse(force_n)[0] for force_n in forces.tolist()]
    assert inverses(RISING, forces) == pytest.approx(exact, abs=1e-9)
    again = branches_of(free_numbers(TRUTH.branches), TRUTH.branches)
    grid_v = np.linspace(0.0, 5.0, 50)
    assert again.falling.value(grid_v) == pytest.approx(FALLING.value(grid_v))
    assert again.rising.value(grid_v) == pytest.approx(RISING.value(grid_v))


def test_weights_beyond_a_double_are_refused_in_silence() -> None:
    """A search's trial may go that far; its next step is a shorter one."""
    numbers = free_numbers(TRUTH.branches)
    numbers[-1] = 1.0e3
    with pytest.raises(ValueError, match="weight"):
        branches_of(numbers, TRUTH.branches)


def test_where_the_branches_meet_a_fit_that_crosses_by_a_hair_is_looked_for_again_not_given_up() -> None:
    """Without margins such a walk left branches that a staircase's turns had bent, and an error several times as large."""
    rising = RationalBezier(0.0, 5.0, (2.5, 4.0, 9.0, 40.0), (1.0, 1.0, 1.0, 1.0))
    falling = RationalBezier(0.0, 5.0, (2.5, 4.2, 22.0, 44.0), (1.0, 1.0, 1.0, 1.0))
    truth = Bsfm(Branches(rising, falling), STOPS)
    turns = walk(TURNS_V, 1, 0.0)
    shares = [STOPS.branch_share(tuple(place)) for place in places(turns.voltage_v, np.array(STOPS.radii_v)).tolist()]
    noise_n = NOISE_N * np.random.default_rng(4).standard_normal(len(shares))
    forces_n = [truth.settled_n(volts, at) for volts, at in zip(turns.voltage_v.tolist(), shares, strict=True)]
    result = fit_joint(truth.branches, [Walk(turns.voltage_v, np.array(forces_n) + noise_n)])
    assert result.joint
    assert verdicts_of(result.branches, SLOPE_FLOOR_N_PER_V).usable
    assert result.rms_n < 1.2 * NOISE_N
