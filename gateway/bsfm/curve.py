"""One branch: a rational Bezier curve from voltage to force, with slope, inverse and exact tests (the paper's Eq. 3).

Evaluated in Bernstein-Horner form in r = t/(1-t), mirrored above 1/2, with coefficients multiplied out once: each sum
has positive weights, and the float32 error at n = 15 is 1e-5 N against 1.7 N for monomials. The slope is numerator /
W^2 with the c_k of `exact.slope_numerator` instead of N'W - NW': the c_k of increasing handles are all positive, so
nothing cancels. One formula serves floats and arrays; numpy is imported only when an array comes in.

Weights are scaled by a power of two (exact) so that the largest is in [1/2, 1). A polynomial (PFM, PSFM) is the curve
with equal weights.
"""

from collections.abc import Callable, Sequence
from math import comb, frexp, isfinite, ldexp
from typing import TYPE_CHECKING, Any, NamedTuple, overload

from gateway.bsfm import exact_polynomials as exact
from gateway.bsfm.inverse import Inverse, inverse_of, refuse_inverse

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

ORDER_MAX = 15
SLOPE_TOLERANCE = 1.0e-9  # of the mean slope, in minimum_slope


class _Side(NamedTuple):
    """Coefficients seen from one end, highest power of r first."""

    pairs: tuple[tuple[float, float], ...]  # C(n,i) w_i b_i and C(n,i) w_i
    slopes: tuple[float, ...]  # c_k


class RationalBezier:
    """f(x) = sum w_i b_i B_i(t) / sum w_i B_i(t), t = (x - x0) / (x1 - x0), of order 1..15.

    x in volts, handles b_i in newtons (n + 1 of them), weights w_i > 0 (as many; a common scale is free). value and
    slope clamp x to [x0, x1] and take a float (float out) or an array (array of the same shape out); NaN gives NaN.
    inverse(force_n) -> (x, Status): clamped with LOW or HIGH beyond the end handles, which themselves are OK;
    ValueError for NaN and for a curve that is not increasing. Immutable by convention; compared, hashed and pickled by
    its four arguments. ValueError on arguments that are no such curve.
    """

    __slots__ = ("_above", "_below", "_increasing", "_numerator", "handles", "inverse", "order", "weights", "x0", "x1")
    inverse: Inverse

    def __init__(self, x0: float, x1: float, handles: Sequence[float], weights: Sequence[float]) -> None:
        self.x0, self.x1 = float(x0), float(x1)
        self.handles = tuple(float(handle) for handle in handles)
        self.weights = tuple(float(weight) for weight in weights)
        self.order = len(self.handles) - 1
        _check(self)
        scaled = _scale_weights(self.weights)
        self._multiply_out(scaled)
        self._increasing = exact.place_not_positive(self._numerator) is None
        self.inverse = inverse_of(self.x0, self.x1, self.handles, scaled) if self._increasing else refuse_inverse

    def _multiply_out(self, weights: tuple[float, ...]) -> None:
        totals = [comb(self.order, i) * weight for i, weight in enumerate(weights)]
        pairs = tuple((w * b, w) for w, b in zip(totals, self.handles, strict=True))
        (whole_weights, weight_scale), (whole_handles, handle_scale) = map(exact.whole_numbers, (weights, self.handles))
        self._numerator = exact.slope_numerator(whole_weights, whole_handles)
        slopes = tuple(exact.quotient(c, weight_scale**2 * handle_scale) for c in self._numerator)
        if not isfinite(sum(map(abs, slopes)) + sum(abs(product) for product, _ in pairs)):
            raise ValueError("handles: too large for a double")
        self._below, self._above = _Side(pairs[::-1], slopes[::-1]), _Side(pairs, slopes)

    @overload
    def value(self, x: float) -> float: ...
    @overload
    def value(self, x: "NDArray[np.float64]") -> "NDArray[np.float64]": ...
    def value(self, x: Any) -> Any:
        """Return the force in N at x volts; exactly the end handles at and beyond the ends."""
        if not isinstance(x, (float, int)):
            return self._of_array(x, self.value, _value)
        if x <= self.x0:
            return self.handles[0]
        if x >= self.x1:
            return self.handles[-1]
        up, down = float(x - self.x0), float(self.x1 - x)
        return _value(self._below, up / down) if up <= down else _value(self._above, down / up)

    @overload
    def slope(self, x: float) -> float: ...
    @overload
    def slope(self, x: "NDArray[np.float64]") -> "NDArray[np.float64]": ...
    def slope(self, x: Any) -> Any:
        """Return df/dx in N/V at x volts; the one-sided slope at and beyond the ends."""
        if not isinstance(x, (float, int)):
            return self._of_array(x, self.slope, self._slope)
        x = self.x0 if x < self.x0 else self.x1 if x > self.x1 else x
        up, down = float(x - self.x0), float(self.x1 - x)
        return self._slope(self._below, up / down) if up <= down else self._slope(self._above, down / up)

    def is_increasing(self) -> bool:
        """Decide exactly whether df/dx > 0 all over the open interval (zero slope at an end allowed, a constant is not
        increasing).
        """
        return self._increasing

    def slope_is_at_least(self, floor_n_per_v: float) -> bool:
        """Decide exactly whether df/dx >= floor on [x0, x1]: numerator - floor (x1 - x0) W^2 is nowhere negative."""
        (weights, _), (handles, scale) = map(exact.whole_numbers, (_scale_weights(self.weights), self.handles))
        ((low, high), span_scale), ((floor,), floor_scale) = map(
            exact.whole_numbers, ((self.x0, self.x1), (floor_n_per_v,))
        )
        total = exact.scale_bernstein(weights)
        least = floor * (high - low) * scale
        steepness = exact.raise_degree_by_two(exact.slope_numerator(weights, handles))
        squares = exact.product(total, total)
        rest = [c * span_scale * floor_scale - least * w for c, w in zip(steepness, squares, strict=True)]
        return exact.place_negative(rest) is None

    def minimum_slope(self) -> float:
        """Return a proven lower bound of df/dx in N/V on [x0, x1], within 1e-9 of the mean slope below the true minimum."""
        upper = min(self.slope(self.x0 + (self.x1 - self.x0) * i / 64) for i in range(65))
        tolerance = SLOPE_TOLERANCE * (
            abs(self.handles[-1] - self.handles[0]) / (self.x1 - self.x0) + abs(upper) + 1.0e-300
        )
        lower, step = upper - tolerance, tolerance
        while not self.slope_is_at_least(lower):
            upper, step = lower, 4.0 * step
            lower -= step
        while upper - lower > tolerance:
            middle = (upper + lower) / 2
            lower, upper = (middle, upper) if self.slope_is_at_least(middle) else (lower, middle)
        return lower

    def _slope(self, side: _Side, r: Any) -> Any:
        """(1+r)^2 P(r) / W(r)^2 / span, for a float or an array r in [0, 1]."""
        numerator = denominator = 0.0 * r
        for c in side.slopes:
            numerator = numerator * r + c
        for _, w in side.pairs:
            denominator = denominator * r + w
        share = (1.0 + r) / denominator
        return numerator * share * share / (self.x1 - self.x0)

    def _of_array(self, x: Any, of_float: Callable[[float], Any], formula: Callable[[_Side, Any], Any]) -> Any:
        import numpy as np

        x = np.asarray(x, dtype=np.float64)
        if x.ndim == 0:
            return of_float(float(x))
        up = np.clip(x, self.x0, self.x1) - self.x0
        down = self.x1 - np.clip(x, self.x0, self.x1)
        below = up <= down
        result = np.empty_like(up)
        result[below] = formula(self._below, up[below] / down[below])
        result[~below] = formula(self._above, down[~below] / up[~below])
        if formula is _value:
            result[up == 0.0], result[down == 0.0] = self.handles[0], self.handles[-1]
        return result

    def _arguments(self) -> tuple[float, float, tuple[float, ...], tuple[float, ...]]:
        return self.x0, self.x1, self.handles, self.weights

    def __eq__(self, other: object) -> bool:
        return isinstance(other, RationalBezier) and self._arguments() == other._arguments()

    def __hash__(self) -> int:
        return hash(self._arguments())

    def __reduce__(self) -> tuple[type["RationalBezier"], tuple[Any, ...]]:
        return RationalBezier, self._arguments()

    def __repr__(self) -> str:
        return "RationalBezier(x0={!r}, x1={!r}, handles={!r}, weights={!r})".format(*self._arguments())


def elevate_order(curve: RationalBezier) -> RationalBezier:
    """Return the same curve with one order more (degree elevation of numerator and denominator)."""
    order = curve.order + 1

    def up(numbers: Sequence[float]) -> list[float]:
        inner = [(k * numbers[k - 1] + (order - k) * numbers[k]) / order for k in range(1, order)]
        return [numbers[0], *inner, numbers[-1]]

    weights = up(curve.weights)
    totals = up([w * b for w, b in zip(curve.weights, curve.handles, strict=True)])
    return RationalBezier(curve.x0, curve.x1, [t / w for t, w in zip(totals, weights, strict=True)], weights)


def _value(side: _Side, r: Any) -> Any:
    """Numerator over denominator by Horner in r, a float or an array in [0, 1]."""
    numerator = denominator = 0.0 * r
    for a, w in side.pairs:
        numerator = numerator * r + a
        denominator = denominator * r + w
    return numerator / denominator


def _check(curve: RationalBezier) -> None:
    x0, x1, handles, weights = curve.x0, curve.x1, curve.handles, curve.weights
    if not (isfinite(x0) and isfinite(x1) and x0 < x1 and isfinite(x1 - x0)):
        raise ValueError(f"range {x0!r} .. {x1!r} V: x0 < x1, both finite, is needed")
    if not 1 <= curve.order <= ORDER_MAX or len(weights) != len(handles):
        raise ValueError(
            f"{len(handles)} handles and {len(weights)} weights: as many of each, 2 to {ORDER_MAX + 1}, are needed"
        )
    for name, numbers in (("handle", handles), ("weight", weights)):
        for index, number in enumerate(numbers):
            if not isfinite(number) or (name == "weight" and number <= 0.0):
                raise ValueError(
                    f"{name} {index} is {number!r}: not {'finite' if name == 'handle' else 'finite and positive'}"
                )


def _scale_weights(weights: Sequence[float]) -> tuple[float, ...]:
    exponent = frexp(max(weights))[1]
    scaled = tuple(ldexp(weight, -exponent) for weight in weights)
    if min(scaled) == 0.0:
        raise ValueError("weights: spread over more than the range of a double")
    return scaled
