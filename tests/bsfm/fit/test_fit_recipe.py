"""The fit: as good as an independent optimiser, never a pole, honest verdicts, fast."""

import warnings
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import least_squares

from gateway.bsfm.fit.branch_fit import FitSettings, fit, fit_orders, residual_n
from gateway.bsfm.fit.levenberg_marquardt import Effort
from gateway.bsfm.fit.projected_problem import ProjectedProblem, bernstein, merge_samples
from gateway.bsfm.fit.result import Covariance, ModelName
from gateway.bsfm.ladder.measured_ladder import Ladder

MODELS = tuple(ModelName)


def spread_share(ladder: Ladder) -> np.ndarray:
    return ladder.voltage_v / ladder.voltage_v.max()


def independent_rms_n(ladder: Ladder, order: int, tied: bool, starts: int) -> float:
    """scipy's trust region on another parametrisation: all handles and square roots of weights, in power form of t."""
    t, rising = spread_share(ladder), ladder.direction > 0
    rungs, index = np.unique(np.stack([t, rising]), axis=1, return_inverse=True)
    index = index.reshape(-1)
    count = np.bincount(index)
    mean = np.bincount(index, ladder.force_n) / count
    scatter = float(np.sum((ladder.force_n - mean[index]) ** 2))
    place, up = rungs[0], rungs[1] > 0
    powers = np.stack([place**i * (1.0 - place) ** (order - i) for i in range(order + 1)], axis=1)
    binomial = np.array([bernstein(np.array([0.5]), order)[0, i] * 2.0**order for i in range(order + 1)])

    def residual(unknown: np.ndarray) -> np.ndarray:
        roots, handles = unknown[: 2 * order].reshape(2, order), unknown[2 * order :]
        first = handles[: order + 1]
        second = np.concatenate([first[:1], handles[order + 1 :], first[-1:]]) if tied else handles[order + 1 :]
        away = np.empty(len(place))
        for mask, root, b in ((up, roots[0], first), (~up, roots[1], second)):
            terms = powers[mask] * binomial * np.concatenate([[1.0], root**2])
            away[mask] = mean[mask] - terms @ b / terms.sum(axis=1)
        return np.sqrt(count) * away

    rng = np.random.default_rng(order)
    handles = 2 * order + (0 if tied else 2)
    bounds = np.array([np.exp(-3.0)] * 2 * order), np.array([np.exp(3.0)] * 2 * order)  # |log w| <= 6
    low = np.concatenate([bounds[0], np.full(handles, -np.inf)])
    high = np.concatenate([bounds[1], np.full(handles, np.inf)])
    costs = []
    for start in range(starts):
        roots = np.exp(rng.normal(0.0, 0.6, 2 * order)) if start else np.ones(2 * order)
        first = np.clip(np.concatenate([roots, np.linspace(0.0, 36.0, handles)]), low, high)
        costs.append(2.0 * least_squares(residual, first, bounds=(low, high), x_scale="jac", max_nfev=150).cost)
    return float(np.sqrt((min(costs) + scatter) / len(ladder)))


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("order", "plant"),
    [
        *((order, plant) for order in (1, 2, 5) for plant in ("smooth", "slip")),
        (3, "smooth"),
        (4, "slip"),
        pytest.param(3, "slip", marks=pytest.mark.long),
        pytest.param(4, "smooth", marks=pytest.mark.long),
    ],
)
def test_residual_reaches_an_independent_optimiser_within_one_percent(order, plant, loops):
    ladder = loops[plant](order)
    ours = fit(ladder, "bsfm", order).rms_n
    assert ours <= 1.01 * independent_rms_n(ladder, order, tied=True, starts=2)


def test_free_ends_reach_an_independent_optimiser_too(loops):
    ladder = loops["slip"](9)
    assert fit(ladder, "bsfm", 3, "free").rms_n <= 1.01 * independent_rms_n(ladder, 3, tied=False, starts=3)


@pytest.mark.parametrize("curves", [1, 2])
def test_the_analytic_jacobian_is_the_difference_quotient(curves, loops):
    ladder = loops["slip"](3)
    masks = [ladder.direction > 0, ladder.direction < 0][:curves]
    weight = 1.0 + 0.5 * np.sin(np.arange(len(ladder)))
    samples = tuple(merge_samples(spread_share(ladder)[m], ladder.force_n[m], weight[m]) for m in masks)
    problem = ProjectedProblem(samples, 4, tied=curves == 2)
    theta = np.random.default_rng(0).normal(size=(3, 4 * curves))
    steps = 1e-6 * np.eye(4 * curves)
    quotient = np.stack(
        [(problem.evaluate(theta + s).residual - problem.evaluate(theta - s).residual) / 2e-6 for s in steps], -1
    )
    assert problem.jacobian(problem.evaluate(theta)) == pytest.approx(quotient, abs=2e-7)


@pytest.mark.sampled
@pytest.mark.parametrize("order", [1, 2, 3, 5, 9, 15])
@pytest.mark.parametrize("model", MODELS)
def test_no_model_of_any_order_has_a_pole_or_a_negative_weight(model, order, loops):
    result = fit(loops["slip"](11), model, order)
    for curve in (result.branches.rising, result.branches.falling):
        logs = np.log(curve.weights)
        assert np.all(np.abs(logs) <= 6.0 + 1e-12) and logs[0] == 0.0
        assert model.rational or not logs.any()
        assert curve.order == order
    assert np.isfinite(result.max_n) and result.rms_n <= result.max_n


def test_a_polynomial_is_plain_least_squares(loops):
    ladder = loops["smooth"](4)
    pooled = np.polynomial.Polynomial.fit(ladder.voltage_v, ladder.force_n, 3)
    assert fit(ladder, "pfm", 3).rms_n == pytest.approx(
        np.sqrt(np.mean((pooled(ladder.voltage_v) - ladder.force_n) ** 2)), rel=1e-9
    )
    squares = 0.0
    for direction in (1, -1):
        part = ladder.part(ladder.direction == direction)
        own = np.polynomial.Polynomial.fit(part.voltage_v, part.force_n, 3)
        squares += float(np.sum((own(part.voltage_v) - part.force_n) ** 2))
    assert fit(ladder, "psfm", 3, "free").rms_n == pytest.approx(np.sqrt(squares / len(ladder)), rel=1e-9)


def test_a_rational_loop_without_noise_is_found_exactly(loops):
    ladder = loops["smooth"](5)
    truth = fit(ladder, "bsfm", 2).branches
    exact = Ladder(ladder.voltage_v, ladder.force_n - residual_n(ladder, truth), ladder.direction, ladder.group)
    assert fit(exact, "bsfm", 2).rms_n < 1e-6


def test_more_order_never_fits_worse(loops):
    for model in MODELS:
        rms = [result.rms_n for result in fit_orders(loops["slip"](6), model, range(1, 5))]
        assert all(later <= 1.001 * earlier for earlier, later in pairwise(rms))


def test_tied_ends_are_shared_and_free_ends_fit_no_worse(loops):
    ladder = loops["slip"](7)
    tied, free = fit(ladder, "bsfm", 2), fit(ladder, "bsfm", 2, "free")
    assert tied.branches.tied and not free.branches.tied
    assert free.rms_n <= tied.rms_n
    assert (tied.form.coefficients, free.form.coefficients) == (8, 10)


def test_pooled_models_have_one_curve_and_no_crossing(loops):
    result = fit(loops["smooth"](8), "bfm", 2)
    assert result.branches.rising == result.branches.falling and result.verdicts.crossing is None
    assert result.form.coefficients == 5


def test_verdicts_tell_what_speaks_against_a_fit(loops):
    ladder = loops["smooth"](2)
    good = fit(ladder, "bsfm", 2)
    assert good.verdicts.usable and good.verdicts.sentences == ()
    assert good.bsfm(3.0).force_range_n == (good.branches.rising.handles[0], good.branches.rising.handles[-1])
    wild = Ladder(
        ladder.voltage_v, 20.0 + 4.0 * np.sin(3.0 * ladder.voltage_v) + ladder.direction, ladder.direction, ladder.group
    )
    verdicts = fit(wild, "bsfm", 5).verdicts
    assert not verdicts.usable and len(verdicts.sentences) == 4
    assert "below the rising one" in verdicts.sentences[2]
    steeper = fit(ladder, "bsfm", 2, settings=FitSettings(slope_floor_n_per_v=30.0)).verdicts
    assert steeper.sentences == ("the slope falls below 30 N/V",)


def test_covariance_agrees_with_the_scatter_of_repeated_fits(loops):
    fits = [fit(loops["smooth"](1, noise_n=0.0), "psfm", 3)]
    base = loops["smooth"](1, noise_n=0.0)
    rng = np.random.default_rng(1)
    for _ in range(40):
        noisy = base.force_n + 0.3 * rng.standard_normal(len(base))
        fits.append(fit(Ladder(base.voltage_v, noisy, base.direction, base.group), "psfm", 3))
    assert isinstance(fits[1].covariance, Covariance)
    assert fits[1].covariance.names[:3] == ("both b0", "rising b1", "rising b2")
    values = np.std([[result.branches.rising.handles[i] for i in range(3)] for result in fits[1:]], axis=0)
    text = np.sqrt(np.diag(fits[1].covariance.matrix))[:3]
    assert text == pytest.approx(
        values, rel=0.6
    )  # the loop is no cubic: its misfit counts as noise, and 40 fits are few


def test_what_the_data_leave_open_is_called_not_identifiable(loops):
    ladder = loops["smooth"](3)
    assert isinstance(fit(ladder, "bsfm", 1).covariance, Covariance)
    assert fit(ladder, "bsfm", 5).covariance == "not identifiable"


def test_weights_of_samples_count_like_repetitions(loops):
    ladder = loops["smooth"](3)
    heavy = np.where(ladder.group < 3, 2.0, 1.0)
    weighted = Ladder(ladder.voltage_v, ladder.force_n, ladder.direction, ladder.group, heavy)
    again = ladder.group < 3
    doubled = Ladder(
        *(np.concatenate([c, c[again]]) for c in (ladder.voltage_v, ladder.force_n, ladder.direction, ladder.group))
    )
    one, two = fit(weighted, "bsfm", 2).branches, fit(doubled, "bsfm", 2).branches
    assert one.rising.value(2.2) == pytest.approx(two.rising.value(2.2), abs=1e-6)


@pytest.mark.parametrize("outliers", ["reject", "huber"])
def test_outliers_do_not_steer_a_robust_fit(outliers, loops):
    ladder = loops["smooth"](12)
    force = np.array(ladder.force_n)
    force[::50] += 8.0
    spoiled = Ladder(ladder.voltage_v, force, ladder.direction, ladder.group)
    clean = fit(ladder, "bsfm", 2).branches.rising
    x = np.linspace(0.0, 5.0, 50)
    away = {name: np.max(np.abs(fit(spoiled, "bsfm", 2, "tied", FitSettings(name)).branches.rising.value(x) - clean.value(x)))
            for name in ("keep", outliers)}  # fmt: skip
    assert away[outliers] < 0.06 < 0.15 < away["keep"]
    if outliers == "reject":
        result = fit(spoiled, "bsfm", 2, "tied", FitSettings("reject"))
        assert (result.rejected, result.count) == (21, 989)


def test_quiet_data_are_not_biased_by_the_ridge(loops):
    ladder = loops["slip"](4, noise_n=0.0)
    small = Ladder(ladder.voltage_v, 0.01 * ladder.force_n, ladder.direction, ladder.group)
    for order in (2, 3):
        assert fit(small, "bsfm", order).rms_n == pytest.approx(0.01 * fit(ladder, "bsfm", order).rms_n, rel=0.01)


def test_measured_voltages_that_all_differ_cost_no_accuracy(loops):
    ladder = loops["smooth"](6)
    jitter = ladder.voltage_v + np.random.default_rng(0).normal(0.0, 0.002, len(ladder))
    measured = Ladder(jitter, ladder.force_n, ladder.direction, ladder.group)
    assert fit(measured, "bsfm", 3).rms_n == pytest.approx(fit(ladder, "bsfm", 3).rms_n, rel=0.02)


def test_a_ladder_that_cannot_carry_the_model_is_refused_with_the_reason(loops):
    ladder = loops["smooth"](1)
    up = ladder.part(ladder.direction > 0)
    with pytest.raises(ValueError, match="one way only"):
        fit(up, "bsfm", 2)
    assert fit(up, "bfm", 2).falling.count == 0
    with pytest.raises(ValueError, match=r"order 5 needs 6 different voltages: rising has 3"):
        fit(ladder.part(ladder.voltage_v < 0.25), "bsfm", 5)
    for order in (0, 16):
        with pytest.raises(ValueError, match=r"1 \.\. 15"):
            fit(ladder, "pfm", order)
    with pytest.raises(ValueError, match="must cover"):
        fit(ladder, "pfm", 2, "tied", FitSettings(voltage_range_v=(0.0, 4.0)))
    with pytest.raises(ValueError, match="not a valid"):
        fit(ladder, "spline", 2)


def test_the_papers_norm_is_its_own_thing(loops):
    ladder = loops["smooth"](1, noise_n=0.0)
    result, pooled = fit(ladder, "bsfm", 1), fit(ladder, "bfm", 1)
    expected = sum(part.rms_n / np.sqrt(points) for part, points in ((result.rising, 51), (result.falling, 50)))
    assert result.paper_norm == pytest.approx(expected, rel=1e-9)
    assert pooled.paper_norm == pytest.approx(pooled.rms_n / np.sqrt(101), rel=1e-9)


def test_fits_are_repeatable_to_the_last_bit(loops):
    first, again = (fit(loops["slip"](2), "bsfm", 4) for _ in range(2))
    assert first.branches == again.branches


def test_no_warning_hides_in_a_hopeless_ladder(loops):
    ladder = loops["smooth"](1)
    flat = Ladder(ladder.voltage_v, np.zeros(len(ladder)), ladder.direction, ladder.group)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = fit(flat, "bsfm", 4, "tied", FitSettings(effort=Effort(screened=16, descending=4)))
    assert result.max_n < 1e-9 and not result.verdicts.usable
