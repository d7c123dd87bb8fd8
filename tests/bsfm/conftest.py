"""A reference curve in 50 digits, written apart from the code under test, and ladders from plants that it knows nothing of."""

from collections.abc import Callable

import mpmath
import numpy as np
import pytest

from gateway.bsfm.curve import RationalBezier
from gateway.bsfm.ladder.measured_ladder import Ladder, ladder_plan


class Reference:
    """Eq. (3) as printed, in mpmath."""

    def __init__(self, curve: RationalBezier) -> None:
        self.n = curve.order
        self.x0, self.x1 = mpmath.mpf(curve.x0), mpmath.mpf(curve.x1)
        self.handles = [mpmath.mpf(handle) for handle in curve.handles]
        self.totals = [mpmath.binomial(self.n, i) * mpmath.mpf(weight) for i, weight in enumerate(curve.weights)]

    def _sums(self, t: mpmath.mpf) -> tuple[mpmath.mpf, mpmath.mpf]:
        terms = [w * t**i * (1 - t) ** (self.n - i) for i, w in enumerate(self.totals)]
        return sum(a * b for a, b in zip(terms, self.handles, strict=True)), sum(terms)

    def value(self, x: object) -> mpmath.mpf:
        with mpmath.workdps(50):
            numerator, denominator = self._sums((mpmath.mpf(x) - self.x0) / (self.x1 - self.x0))
            return numerator / denominator

    def slope(self, x: object) -> mpmath.mpf:
        with mpmath.workdps(80):
            step = (self.x1 - self.x0) * mpmath.mpf(10) ** -25
            return (self.value_at(x, step) - self.value_at(x, -step)) / (2 * step)

    def value_at(self, x: object, offset: mpmath.mpf) -> mpmath.mpf:
        numerator, denominator = self._sums((mpmath.mpf(x) + offset - self.x0) / (self.x1 - self.x0))
        return numerator / denominator

    def inverse(self, force: float) -> mpmath.mpf:
        """Bisection, which cannot be wrong, to 1e-18; then two Newton steps."""
        with mpmath.workdps(50):
            low, high = self.x0, self.x1
            for _ in range(60):
                middle = (low + high) / 2
                low, high = (middle, high) if self.value(middle) < force else (low, middle)
            middle = (low + high) / 2
            for _ in range(2):
                middle -= (self.value(middle) - force) / self.slope(middle)
            return middle


@pytest.fixture
def reference() -> Callable[[RationalBezier], Reference]:
    return Reference


def smooth_loop(seed: int, noise_n: float = 0.14, v_max_v: float = 5.0) -> Ladder:
    """Ten groups on a smooth loop a few newtons wide that closes at both ends: tanh flanks, no rational function."""
    plan = ladder_plan(v_max_v, 0.1, 10)
    voltage, direction = np.array(plan.voltage_v), np.array(plan.direction)
    rng = np.random.default_rng(seed)
    width, bend = rng.uniform(0.8, 1.6), rng.uniform(-0.3, 0.3)
    share = voltage / v_max_v
    middle = 36.0 * share + bend * 36.0 * share * (1.0 - share)
    gap = width * np.tanh(4.0 * share) * np.tanh(4.0 * (1.0 - share))
    force = middle - direction * gap + noise_n * rng.standard_normal(len(voltage))
    return Ladder(voltage, force, direction, np.array(plan.group))


def slip_loop(seed: int, noise_n: float = 0.14) -> Ladder:
    """Maxwell-slip friction under a regulator with a dead start: kinks, and a first group that starts inside the loop."""
    plan = ladder_plan(5.0, 0.1, 10)
    rng = np.random.default_rng(seed)
    stop, stiffness = rng.uniform(0.05, 1.0, 5), rng.uniform(0.1, 0.5, 5)
    slip, last, force = np.zeros(5), 0.0, []
    for voltage in plan.voltage_v:
        slip, last = np.clip(slip + voltage - last, -stop, stop), voltage
        force.append(8.0 * max(voltage - 0.1, 0.0) ** 1.04 - float((stiffness * slip).sum()) * (1.0 + 0.15 * voltage))
    measured = np.array(force) + noise_n * rng.standard_normal(len(force))
    return Ladder(np.array(plan.voltage_v), measured, np.array(plan.direction), np.array(plan.group))


@pytest.fixture
def loops() -> dict[str, Callable[..., Ladder]]:
    return {"smooth": smooth_loop, "slip": slip_loop}
