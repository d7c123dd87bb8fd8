"""The few functions that a formula without memory needs to hold for one float and for a whole series alike.

The running twin calls the formulas with floats, replay with arrays. Everything else in them is plain arithmetic.
"""

import math
from typing import Any, TypeAlias

import numpy as np

from gateway.compiled import step

Real: TypeAlias = Any
"""A float, or an array. The types agree by construction; a union would not type-check."""


@step
def positive_part(value: Real) -> Real:
    """Return the larger of a value and 0."""
    return 0.5 * (value + abs(value))


def larger(left: Real, right: Real) -> Real:
    """Return the larger of two values, element by element."""
    if type(left) is float and type(right) is float:
        return left if left > right else right
    return np.maximum(left, right)


def smaller(left: Real, right: Real) -> Real:
    """Return the smaller of two values, element by element."""
    if type(left) is float and type(right) is float:
        return left if left < right else right
    return np.minimum(left, right)


def clip(value: Real, low: float, high: float) -> Real:
    """Return a value within low .. high."""
    if type(value) is float:
        value = value if value > low else low
        return value if value < high else high
    return smaller(larger(value, low), high)


def sign(value: Real) -> Real:
    """Return -1, 0 or +1."""
    if type(value) is float:
        return 1.0 if value > 0.0 else -1.0 if value < 0.0 else 0.0
    return np.sign(value)


def exponential(value: Real) -> Real:
    """Return exp by the same routine for both."""
    result = np.exp(value)
    return result if isinstance(value, np.ndarray) else float(result)


def quantise(value: Real, size: float) -> Real:
    """Return the nearest multiple of `size`; a size of 0 leaves the value alone."""
    if size == 0.0:
        return value
    return math.floor(value / size + 0.5) * size if type(value) is float else np.floor(value / size + 0.5) * size


def sine(value: Real) -> Real:
    """Return sin by the same routine for both."""
    result = np.sin(value)
    return result if isinstance(value, np.ndarray) else float(result)


def root(value: Real) -> Real:
    """Return the square root of what is not negative."""
    return np.sqrt(value) if isinstance(value, np.ndarray) else math.sqrt(value)
