"""Polynomials in Bernstein form over whole numbers: the sign of a polynomial on [0, 1], without rounding.

A double is a whole number times a power of two, so weights and handles become integers exactly, and so do all products
and sums of them. Coefficients are kept on t^k (1-t)^(m-k) ("scaled": binomials inside), where a product is a plain
convolution. The sign comes from subdivision at 1/2 by de Casteljau without the divisions. A sampled grid was rejected
(it misses dips), floats were rejected (a product of spread weights underflows, a tangency gets a random sign).

Subdivision ends at depth 80: a polynomial that comes within about 2^-160 of its scale to zero counts as touching it.
"""

from collections.abc import Iterable, Sequence
from itertools import pairwise
from math import comb, lcm

DEPTH = 80


def whole_numbers(values: Iterable[float]) -> tuple[list[int], int]:
    """Return integers n_i and one scale L (a power of two) with value_i = n_i / L, exactly. Finite values only."""
    ratios = [value.as_integer_ratio() for value in values]
    scale = max(denominator for _, denominator in ratios)
    return [numerator * (scale // denominator) for numerator, denominator in ratios], scale


def scale_bernstein(bernstein: Sequence[int]) -> list[int]:
    """Return the coefficients on t^k (1-t)^(m-k) of a polynomial given by its ordinary Bernstein coefficients."""
    degree = len(bernstein) - 1
    return [comb(degree, k) * value for k, value in enumerate(bernstein)]


def product(a: Sequence[int], b: Sequence[int]) -> list[int]:
    """Return the product of two scaled polynomials."""
    result = [0] * (len(a) + len(b) - 1)
    for i, left in enumerate(a):
        for j, right in enumerate(b):
            result[i + j] += left * right
    return result


def difference(a: Sequence[int], b: Sequence[int]) -> list[int]:
    """Return a - b, both of one degree."""
    return [left - right for left, right in zip(a, b, strict=True)]


def raise_degree_by_two(a: Sequence[int]) -> list[int]:
    """Return the same polynomial, two degrees higher: multiplied by ((1-t) + t)^2 = 1."""
    return product(a, (1, 2, 1))


def slope_numerator(weights: Sequence[int], handles: Sequence[int]) -> list[int]:
    """Return the scaled coefficients c_k, k = 0..2n-2, of the numerator of df/dt = numerator / W^2.

    c_k = sum_i (k-2i+1) C(n,i) C(n,k-i+1) w_i w_{k-i+1} (b_{k-i+1} - b_i), i from max(0, k+1-n) to floor(k/2), on
    t^k (1-t)^(2n-2-k): the quotient rule on the two Bernstein sums.
    """
    n = len(weights) - 1
    return [
        sum(_slope_term(weights, handles, i, k - i + 1) for i in range(max(0, k + 1 - n), k // 2 + 1))
        for k in range(2 * n - 1)
    ]


def _slope_term(weights: Sequence[int], handles: Sequence[int], i: int, j: int) -> int:
    n = len(weights) - 1
    return (j - i) * comb(n, i) * comb(n, j) * weights[i] * weights[j] * (handles[j] - handles[i])


def place_not_positive(coefficients: Sequence[int]) -> float | None:
    """Return where in [0, 1] the scaled polynomial fails to be > 0 inside (0, 1), or None. Zero at the two ends is allowed."""
    return _failing_place(_bernstein(coefficients), touch=False)


def place_negative(coefficients: Sequence[int]) -> float | None:
    """Return where in [0, 1] the scaled polynomial is < 0, or None. Touching zero is allowed."""
    return _failing_place(_bernstein(coefficients), touch=True)


def _bernstein(coefficients: Sequence[int]) -> list[int]:
    """Ordinary Bernstein coefficients, times a common multiple so that they stay whole."""
    degree = len(coefficients) - 1
    binomials = [comb(degree, k) for k in range(degree + 1)]
    common = lcm(*binomials)
    return [value * (common // binomial) for value, binomial in zip(coefficients, binomials, strict=True)]


def _failing_place(coefficients: list[int], touch: bool) -> float | None:
    pieces = [(coefficients, 0.0, 1.0, 0)]
    while pieces:
        piece, low, high, depth = pieces.pop()
        if min(piece) >= 0 and (touch or max(piece) > 0):
            continue  # every basis function is positive inside, so the sum is
        middle = (low + high) / 2
        if piece[0] < 0:
            return low
        if piece[-1] < 0:
            return high
        if max(piece) <= 0:
            return middle
        if depth == DEPTH:
            if touch:
                continue
            return middle
        left, right = _halves(piece)
        if left[-1] < 0 or (left[-1] == 0 and not touch):
            return middle
        pieces.append((right, middle, high, depth + 1))
        pieces.append((left, low, middle, depth + 1))
    return None


def _halves(piece: list[int]) -> tuple[list[int], list[int]]:
    """De Casteljau at 1/2, both halves times 2^degree so that no division is needed."""
    degree = len(piece) - 1
    left, right, row = [], [], piece
    for shift in range(degree, -1, -1):
        left.append(row[0] << shift)
        right.append(row[-1] << shift)
        row = [a + b for a, b in pairwise(row)]
    return left, right[::-1]


def quotient(numerator: int, denominator: int) -> float:
    """Return the nearest double; infinite where a double ends."""
    try:
        return numerator / denominator
    except OverflowError:
        return float("inf")
