"""A wave of the fit by hand: who goes on, what a step may do, and what of a simulation an offset moves."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gateway.diagnosis.model_fit import levenberg_marquardt as lm
from gateway.diagnosis.model_fit.levenberg_marquardt import Contest, FittedModel


def waves_of(
    monkeypatch: pytest.MonkeyPatch, chi2: list[float], gains: list[float], contest: Contest | None
) -> list[list[int]]:
    """Who steps in each of three waves, where each step gains as much as the one before."""
    stepped = list[list[int]]()

    def linearise(_bench: object, problems: list[Any], _whiten: object) -> list[Any]:
        return [SimpleNamespace(chi2=chi2[one.parameters], parameters=one.parameters, free=()) for one in problems]

    def step_all(_bench: object, _fitted: object, active: list[int], _whiten: object) -> dict[int, float]:
        stepped.append(list(active))
        return {k: gains[k] for k in active}

    monkeypatch.setattr(lm, "linearise", linearise)
    monkeypatch.setattr(lm, "_step_all", step_all)
    problems: Any = [SimpleNamespace(parameters=k, free=()) for k in range(len(chi2))]
    lm.refine(None, problems, None, 3, contest)  # type: ignore[arg-type]
    return stepped


def test_who_gains_too_little_goes_on_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """A fiftieth of a row's, or a hundred-thousandth of all; in a contest the share that it says."""
    assert waves_of(monkeypatch, [100.0, 100.0], [0.019, 0.021], None) == [[0, 1], [1], [1]]
    assert waves_of(monkeypatch, [1e6, 1e6], [9.0, 11.0], None) == [[0, 1], [1], [1]]
    assert waves_of(monkeypatch, [100.0], [0.5], Contest(least_gain=0.01)) == [[0]]
    assert waves_of(monkeypatch, [100.0], [1.5], Contest(least_gain=0.01)) == [[0], [0], [0]]


def test_in_a_contest_who_is_too_far_behind_to_catch_up_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """Five times its last gain; behind a rival of before as well, and where each is wanted for itself nobody is."""
    chi2, gains = [100.0, 104.0, 106.0], [1.0, 1.0, 1.0]
    assert waves_of(monkeypatch, chi2, gains, Contest()) == [[0, 1, 2], [0, 1], [0, 1]]
    assert waves_of(monkeypatch, chi2, gains, Contest(best_chi2=96.0)) == [[0, 1, 2], [0], [0]]
    assert waves_of(monkeypatch, chi2, gains, None) == [[0, 1, 2]] * 3


def fitted(value: float = 0.5, chi2: float = 10.0) -> FittedModel:
    parameters: Any = SimpleNamespace(offsets_n=[0.0], value=lambda _each: value)
    free: Any = (SimpleNamespace(low=0.0, high=1.0),)
    return FittedModel(parameters, free, np.zeros(2), chi2, np.zeros((2, 2)))


@pytest.mark.parametrize(("tried", "taken"), [((11.0, 12.0, 10.0), None), ((11.0, 9.0, 9.5), 1)])
def test_a_step_that_is_not_better_is_not_taken(
    monkeypatch: pytest.MonkeyPatch, tried: tuple[float, ...], taken: int | None
) -> None:
    monkeypatch.setattr(lm, "_damped_steps", lambda each, whiten: ["none", "some", "most"])
    monkeypatch.setattr(lm, "_chi2", lambda residuals, whiten: np.array([tried]))
    bench: Any = SimpleNamespace(simulate=lambda sets: None, residuals=lambda simulated: np.arange(6.0))
    (found,) = lm._try_steps(bench, [fitted()], None)  # type: ignore[arg-type]
    if taken is None:
        assert found is None
    else:
        assert found is not None and (found.parameters, found.chi2) == ("some", 9.0)  # type: ignore[comparison-overlap]
        assert found.residual_n.tolist() == [2.0, 3.0]


@pytest.mark.parametrize(("value", "slope", "expected"), [
    (0.5, (0.5, 0.4), "both"), (0.5, (0.5, 5.0), "clipped"), (1.0, (0.5, 5.0), "held"), (0.0, (0.5, -5.0), "held"),
])  # fmt: skip
def test_a_parameter_stays_in_its_bounds_and_one_that_pushes_against_them_lets_the_others_step_anew(
    monkeypatch: pytest.MonkeyPatch, value: float, slope: tuple[float, float], expected: str
) -> None:
    monkeypatch.setattr(lm, "_apply_values", lambda fitted, values: values)
    normal = np.array([[1.0, 0.5], [0.5, 1.0]])
    found: Any = lm._damped_step(fitted(value), normal, np.array(slope), 0.0)
    both = np.linalg.solve(normal, slope)
    alone = {"held": slope[0]}.get(expected, both[0])
    assert found[0] == pytest.approx(alone, rel=1e-6)
    assert found[1] == pytest.approx(value + both[1] if expected == "both" else float(slope[1] > 0.0))


def test_an_offset_moves_the_force_of_its_own_recording_alone() -> None:
    channels = [
        SimpleNamespace(recording=0, is_force=True, rows=slice(0, 2)),
        SimpleNamespace(recording=0, is_force=False, rows=slice(2, 4)),
        SimpleNamespace(recording=1, is_force=True, rows=slice(4, 6)),
    ]
    bench: Any = SimpleNamespace(rows=6, channels=channels)
    assert lm._offset_column(bench, 0).tolist() == [1, 1, 0, 0, 0, 0]
    assert lm._offset_column(bench, 1).tolist() == [0, 0, 0, 0, 1, 1]


@pytest.mark.parametrize(
    ("value", "shape", "neighbour"),
    [(10.0, False, 10.2), (0.0, False, 0.1), (10.0, True, 10.1), (99.0, False, 97.02), (99.95, True, 99.85)],
)
def test_a_neighbour_is_two_percent_away_or_a_step_and_never_beyond_the_bound(
    value: float, shape: bool, neighbour: float
) -> None:
    """Of a frequency, say, two percent are many turns over a minute: there it is a step."""

    class Parameters(float):
        def value(self, _parameter: object) -> float:
            return float(self)

        def with_value(self, _parameter: object, value: float) -> "Parameters":
            return Parameters(value)

    parameter: Any = SimpleNamespace(step=0.1, shape=shape, high=100.0)
    found, by = lm._secant(Parameters(value), parameter)  # type: ignore[arg-type]
    assert float(found) == pytest.approx(neighbour) and by == pytest.approx(neighbour - value)  # type: ignore[arg-type]
