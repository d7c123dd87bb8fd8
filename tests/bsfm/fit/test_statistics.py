"""Numbers about a finished fit, from numbers that are known: residuals, the variance of a sample, the paper's own norm."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gateway.bsfm.fit import statistics
from gateway.bsfm.fit.result import Residuals


def test_residuals_are_told_by_size_and_by_sign() -> None:
    assert statistics.summarize_residuals(np.array([1.0, -3.0])) == Residuals(5.0**0.5, 3.0, -1.0, 2)
    assert statistics.summarize_residuals(np.zeros(0)) == Residuals(0.0, 0.0, 0.0, 0)


@pytest.mark.parametrize(("is_rational", "spare"), [(True, 5), (False, 7)])
def test_the_variance_of_a_sample_counts_what_was_fitted(is_rational: bool, spare: int) -> None:
    """By mean weight, so that weights of any size mean the same; and never by less than one spare sample."""
    problem: Any = SimpleNamespace(handle_count=3, unknowns=2)
    solution: Any = SimpleNamespace(form=SimpleNamespace(model=SimpleNamespace(rational=is_rational)))
    residual_n, weight = np.linspace(-1.0, 2.0, 10), np.linspace(1.0, 3.0, 10)
    expected = float(np.average(residual_n**2, weights=weight)) / spare
    for factor in (1.0, 100.0):
        found = statistics._variance(problem, residual_n, factor * weight, solution)
        assert found == pytest.approx(expected)
    assert statistics._variance(problem, residual_n[:2], weight[:2], solution) == pytest.approx(
        float(np.average(residual_n[:2] ** 2, weights=weight[:2]))
    )


def test_the_paper_s_norm_is_of_stair_means_and_of_both_directions_by_themselves(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each stair counts once, however many readings it has; a stair that neither rose nor fell is no rising one."""
    monkeypatch.setattr(statistics, "stair_index", lambda ladder: (np.array([0, 0, 1, 2, 2, 2]), 3))
    ladder: Any = SimpleNamespace(direction=np.array([1, 1, 1, -1, -1, 0]))
    residual_n = np.array([2.0, 4.0, 4.0, 5.0, 6.0, 7.0])
    assert statistics.paper_norm(ladder, residual_n, split=True) == pytest.approx(5.0 / 2 + 6.0)
    assert statistics.paper_norm(ladder, residual_n, split=False) == pytest.approx((9 + 16 + 36) ** 0.5 / 3)


def test_blocks_stand_along_the_diagonal_and_nothing_beside_them() -> None:
    found = statistics.block_diagonal([np.full((2, 2), 1.0), np.full((1, 1), 5.0)])
    assert found.tolist() == [[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 5.0]]


@pytest.mark.parametrize("split", [True, False])
def test_each_number_of_a_fit_has_the_name_of_its_branch(split: bool) -> None:
    """Ends that both branches share have one name and one place."""
    model = SimpleNamespace(per_direction=split, rational=True)
    solution: Any = SimpleNamespace(form=SimpleNamespace(model=model, order=2))
    if not split:
        problem: Any = SimpleNamespace(columns=[np.array([0, 1, 2])])
        assert statistics.parameter_names(problem, [0], solution) == [
            "pooled b0", "pooled b1", "pooled b2", "pooled log w1", "pooled log w2",
        ]  # fmt: skip
        return
    problem = SimpleNamespace(columns=[np.array([0, 1, 2]), np.array([0, 3, 2])])
    assert statistics.parameter_names(problem, [0, 1], solution) == [
        "both b0", "rising b1", "both b2", "falling b1",
        "rising log w1", "rising log w2", "falling log w1", "falling log w2",
    ]  # fmt: skip


def block_of(jacobian: list[list[float]], variance: float, handles: int = 2, theta: float = 0.0) -> Any:
    """Of one problem whose derivatives are these, with a box of 6 for its log weights."""
    problem: Any = SimpleNamespace(handle_count=handles)
    at: Any = SimpleNamespace(q=[np.array(jacobian)], r=[np.eye(len(jacobian[0]))], theta=np.array([[theta]]))
    solution: Any = SimpleNamespace(form=SimpleNamespace(model=SimpleNamespace(rational=False)))
    return statistics._block(problem, at, variance, solution, 6.0)


def test_a_covariance_is_that_of_linearised_least_squares_whatever_the_units() -> None:
    jacobian = np.array([[1.0, 2.0], [3.0, 5.0], [7.0, 1.0]])
    for units in (1.0, 1e-6):
        scaled = jacobian * np.array([1.0, units])
        assert block_of(scaled.tolist(), 0.3) == pytest.approx(0.3 * np.linalg.inv(scaled.T @ scaled), rel=1e-9)


def test_what_the_data_leave_open_has_no_covariance() -> None:
    good = [[1.0, 2.0], [3.0, 5.0], [7.0, 1.0]]
    assert block_of(good, 0.3, handles=1) is not None
    assert block_of(good, 30.0, handles=1) is None, "a log weight that may be anything"
    assert block_of(good, 0.3, theta=6.0) is None and block_of(good, 0.3, theta=-6.0) is None, "stopped by the box"
    assert block_of([[1.0, 1.0], [1.0, 1.0 + 1e-7], [1.0, 1.0]], 1e-20) is None, "two that only act together"
    assert block_of([[1.0, 0.0], [3.0, 0.0], [7.0, 0.0]], 0.3) is None, "one that acts nowhere"
