"""The inverse of a curve gives its force back, at every order, near both ends and at sizes whose squares no float has."""

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise
from math import comb, inf, nan

import pytest

from gateway.bsfm import inverse as room
from gateway.bsfm.inverse import InverseStatus, inverse_of, refuse_inverse

X0, X1 = 1.0, 9.0
MEAN_STEPS, MOST_STEPS = 4.6, 15
EDGES = (1e-12, 1e-6, 1e-3)
SHARES = (*EDGES, 0.1, 0.3, 0.499, 0.5, 0.501, 0.7, 0.9, *(1.0 - edge for edge in reversed(EDGES)))
CURVES: dict[str, tuple[Sequence[float], Sequence[float]]] = {
    "straight": ((0.0, 60.0), (1.0, 1.0)),
    "order 1, pulled to its end": ((-5.0, 60.0), (1.0, 40.0)),
    "order 1, pulled to its begin": ((-5.0, 60.0), (1.0, 0.02)),
    "order 2": ((0.0, 20.0, 60.0), (1.0, 0.9, 1.0)),
    "order 2, middle above its end": ((0.0, 59.0, 60.0), (1.0, 3.0, 0.5)),
    "order 2, middle near its begin": ((-3.0, -2.9, 60.0), (1.0, 0.2, 2.0)),
    "order 2, 0 by 0 in the textbook": ((0.0, 18.0, 36.0), (1.0, 1.0, 1.0)),
    "order 3": ((0.0, 10.0, 50.0, 60.0), (1.0, 2.0, 0.4, 1.0)),
    "order 3, flat begin": ((0.0, 1e-9, 1e-6, 60.0), (1.0, 1.0, 1.0, 1.0)),
    "order 3, flat end": ((0.0, 60.0 - 1e-6, 60.0 - 1e-9, 60.0), (1.0, 1.0, 1.0, 1.0)),
    "order 5": ((-1.0, 2.0, 20.0, 21.0, 50.0, 60.0), (1.0, 0.3, 5.0, 0.1, 2.0, 1.0)),
    "order 9": (tuple(float(k * k) for k in range(10)), tuple(1.0 + 0.3 * (k % 3) for k in range(10))),
}


def force_at(x: float, handles: Sequence[float], weights: Sequence[float], first: float = X0) -> Fraction:
    """The curve's force, without rounding; first: voltage of its begin."""
    t, n = (Fraction(x) - Fraction(first)) / (Fraction(X1) - Fraction(X0)), len(handles) - 1
    shares = [comb(n, i) * Fraction(w) * t**i * (1 - t) ** (n - i) for i, w in enumerate(weights)]
    return sum(s * Fraction(b) for s, b in zip(shares, handles, strict=True)) / sum(shares)


def forces(handles: Sequence[float]) -> list[float]:
    low, high = handles[0], handles[-1]
    return [low + share * (high - low) for share in SHARES]


@pytest.mark.sampled
@pytest.mark.parametrize("scale", [1.0, 1e-156, 1e-90, 1e90, 1e156, 1e199], ids=lambda scale: f"x{scale:g}")
@pytest.mark.parametrize("name", CURVES)
def test_the_force_of_the_inverse_is_the_one_that_was_asked_for(name: str, scale: float) -> None:
    handles, weights = [scale * handle for handle in CURVES[name][0]], CURVES[name][1]
    inverse = inverse_of(X0, X1, handles, weights)
    span, found = Fraction(handles[-1]) - Fraction(handles[0]), list[float]()
    for force_n in forces(handles):
        x, status = inverse(force_n)
        assert status is InverseStatus.OK
        steepest = max(
            abs(float((force_at(min(X1, x + 1e-7), handles, weights) - force_at(x, handles, weights)) / span)), 1e-16
        )
        off = abs(float((force_at(x, handles, weights) - Fraction(force_n)) / span))
        assert off <= 1e-7 * steepest + 1e-14, (force_n, x)
        found.append(x)
    assert all(before <= after for before, after in pairwise(found))


@pytest.mark.parametrize("name", [name for name in CURVES if CURVES[name][0][0] == 0.0 and "flat" not in name])
def test_near_an_end_at_0_v_and_0_n_the_voltage_keeps_its_digits(name: str) -> None:
    """Whichever end that is: a voltage is measured from the nearer one."""
    handles, weights = CURVES[name]
    mirrored = [-handle for handle in reversed(handles)], list(reversed(weights))
    rising, pulling = inverse_of(0.0, 8.0, handles, weights), inverse_of(-8.0, 0.0, *mirrored)
    for force_n in (6e-14, 6e-11, 6e-7):
        x, _ = rising(force_n)
        reached_n = force_at(x, handles, weights, first=0.0)
        assert float(reached_n) == pytest.approx(force_n, rel=1e-12, abs=0.0)
        assert pulling(-force_n)[0] == pytest.approx(-x, rel=1e-12, abs=0.0)


@pytest.mark.parametrize("name", CURVES)
def test_a_common_factor_of_the_weights_changes_nothing(name: str) -> None:
    handles, weights = CURVES[name]
    plain, scaled = inverse_of(X0, X1, handles, weights), inverse_of(X0, X1, handles, [1e-80 * w for w in weights])
    for force_n in forces(handles):
        assert scaled(force_n)[0] == pytest.approx(plain(force_n)[0], abs=1e-9)


@pytest.mark.parametrize("name", CURVES)
def test_beyond_its_ends_a_curve_stays_there_and_says_so(name: str) -> None:
    handles, weights = CURVES[name]
    inverse = inverse_of(X0, X1, handles, weights)
    assert inverse(handles[0]) == (X0, InverseStatus.OK) and inverse(handles[-1]) == (X1, InverseStatus.OK)
    for beyond in (1e-9, 5.0, inf):
        assert inverse(handles[0] - beyond) == (X0, InverseStatus.LOW)
        assert inverse(handles[-1] + beyond) == (X1, InverseStatus.HIGH)
    with pytest.raises(ValueError, match="is not a number"):
        inverse(nan)


@pytest.mark.parametrize("weight", [1e-170, 1e-150, 1e150, 1e170])
def test_a_weight_whose_square_no_float_has_is_carried(weight: float) -> None:
    handles, weights = (0.0, 20.0, 60.0), (1.0, weight, 1.0)
    inverse = inverse_of(X0, X1, handles, weights)
    for force_n in (5.0, 19.0, 20.0, 21.0, 55.0):
        x, _ = inverse(force_n)
        around = [float(force_at(min(X1, max(X0, x + by)), handles, weights)) for by in (-1e-6, 1e-6)]
        assert around[0] <= force_n <= around[1]


def test_newton_needs_few_steps_and_none_for_a_force_that_was_just_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """A cycle of control asks several times: what takes bisection instead would be felt."""
    steps = list[float]()
    values = room._values_and_slopes
    monkeypatch.setattr(room, "_values_and_slopes", lambda pairs, r: steps.append(r) or values(pairs, r))
    needed = list[int]()
    for name in ("order 3", "order 5", "order 9", "order 3, flat begin", "order 3, flat end"):
        handles, weights = CURVES[name]
        inverse = inverse_of(X0, X1, handles, weights)
        for force_n in forces(handles):
            steps.clear()
            inverse(force_n)
            needed.append(len(steps))
            inverse(force_n)
            assert len(steps) == needed[-1]
        steps.clear()
        for force_n in forces(handles)[-room.KEPT :]:  # as many as control asks for in turn
            inverse(force_n)
        assert not steps and room.KEPT >= 4, "the aim, and where the slide is, before and after a movement"
    assert sum(needed) / len(needed) < MEAN_STEPS and max(needed) <= MOST_STEPS, (
        sum(needed) / len(needed),
        max(needed),
    )


def test_a_curve_that_does_not_increase_has_none() -> None:
    with pytest.raises(ValueError, match="it has no inverse"):
        refuse_inverse(5.0)
