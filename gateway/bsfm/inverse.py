"""Force -> voltage on one increasing rational Bezier curve.

`inverse_of` builds, once per curve, the function for its order: closed forms for n = 1 and 2, bracketed Newton above.
Closures were chosen over methods because a control cycle in plain Python pays for each attribute look-up; the order-2
form costs about 2.5 cubic polynomials. All forms work with differences handle - force, which are exact near the
handles, and measure the answer from the nearer end, so that it keeps its relative accuracy there (the textbook
quadratic divides 0 by 0 at w = 1, b = (0, 18, 36)).

Newton runs on f(t) - force, written in r = t/(1-t) (mirrored above 1/2): f(t) is nearly straight where the polynomial
in r is not, which takes 3-5 iterations instead of 6/11/18 at n = 2/5/15. Bisection in the logarithm of r guards it, so
that a flat end costs no more. Control asks for the same few forces again and again, within a step and from one to the
next, so Newton's last answers are kept.
"""

from collections.abc import Callable, Sequence
from enum import StrEnum
from functools import lru_cache
from math import comb, inf, sqrt


class InverseStatus(StrEnum):
    """Outcome of an inverse: OK, or clamped at the LOW or HIGH end of the curve."""

    OK = "ok"
    LOW = "low"
    HIGH = "high"


Inverse = Callable[[float], tuple[float, InverseStatus]]
OK, LOW, HIGH = (
    InverseStatus.OK,
    InverseStatus.LOW,
    InverseStatus.HIGH,
)  # an enum member looked up on its class costs 30 ns
KEPT = 8  # answers: the aim, and where the slide is, before and after a movement
PLAIN = 1.0e60  # closed forms square their terms: outside 1e-60..1e60 the Newton form, which does not, is used


def inverse_of(x0: float, x1: float, handles: Sequence[float], weights: Sequence[float]) -> Inverse:
    """Return the inverse of an increasing curve. `weights` may be scaled by any common factor."""
    ratios = tuple(weight / weights[0] for weight in weights)
    sizes = (*ratios, handles[-1] - handles[0], max(map(abs, handles)))
    plain = all(1 / PLAIN < size < PLAIN for size in sizes)
    if len(weights) == 2 and plain:
        return _inverse_1(x0, x1, (handles[0], handles[1]), ratios[1])
    if len(weights) == 3 and plain:
        return _inverse_2(x0, x1, (handles[0], handles[1], handles[2]), (ratios[1], ratios[2]))
    return lru_cache(KEPT)(_inverse_n(x0, x1, tuple(handles), tuple(weights)))


def refuse_inverse(_force_n: float) -> tuple[float, InverseStatus]:
    """Raise ValueError: stands for the inverse of a curve that has none."""
    raise ValueError("the curve is not increasing: it has no inverse")


def _inverse_1(x0: float, x1: float, handles: tuple[float, float], w1: float) -> Inverse:
    b0, b1 = handles
    span = x1 - x0

    def inverse(force_n: float) -> tuple[float, InverseStatus]:
        up = force_n - b0
        down = b1 - force_n
        if up > 0.0 < down:
            down *= w1
            if up <= down:
                return x0 + span * (up / (up + down)), OK
            return x1 - span * (down / (up + down)), OK
        return _at_an_end(force_n, (b0, b1), x0, x1)

    return inverse


def _inverse_2(x0: float, x1: float, handles: tuple[float, float, float], weights: tuple[float, float]) -> Inverse:
    """Return the quadratic's root with w0 = 1. With a = b0 - f, m = w1 (b1 - f), c = w2 (b2 - f) and s = sqrt(m^2 - a c),
    t : 1-t is -a : m + s where m >= 0, else s - m : c. Below, up is -a and down is c, then both sides of that ratio."""
    b0, b1, b2 = handles
    w1, w2 = weights
    span = x1 - x0

    def inverse(force_n: float) -> tuple[float, InverseStatus]:
        up = force_n - b0
        down = b2 - force_n
        if up > 0.0 < down:
            m = w1 * (b1 - force_n)
            down *= w2
            root = sqrt(m * m + up * down)
            if m >= 0.0:
                down = m + root
            else:
                up = root - m
            if up <= down:
                return x0 + span * (up / (up + down)), OK
            return x1 - span * (down / (up + down)), OK
        return _at_an_end(force_n, (b0, b2), x0, x1)

    return inverse


def _inverse_n(x0: float, x1: float, handles: tuple[float, ...], weights: tuple[float, ...]) -> Inverse:
    n = len(handles) - 1
    first, last = handles[0], handles[-1]
    w = tuple(comb(n, i) * weight for i, weight in enumerate(weights))
    terms = tuple(zip(w, handles, strict=True))
    terms_down = terms[::-1]
    half = sum(a * b for a, b in terms) / sum(w)
    span = x1 - x0

    def inverse(force_n: float) -> tuple[float, InverseStatus]:
        force_n = float(force_n)  # a numpy scalar would cost three times as much in each of the steps below
        if not first < force_n < last:
            return _at_an_end(force_n, (first, last), x0, x1)
        if force_n <= half:
            pairs = [(a * (b - force_n), a) for a, b in terms_down]
            return x0 + span * _near_share(pairs, (force_n - first) / (half - first)), OK
        pairs = [(a * (force_n - b), a) for a, b in terms]
        return x1 - span * _near_share(pairs, (last - force_n) / (last - half)), OK

    return inverse


def _at_an_end(force_n: float, ends: tuple[float, float], x0: float, x1: float) -> tuple[float, InverseStatus]:
    if force_n <= ends[0]:
        return x0, (LOW if force_n < ends[0] else OK)
    if force_n >= ends[1]:
        return x1, (HIGH if force_n > ends[1] else OK)
    raise ValueError(f"force {force_n!r} N is not a number")


def _near_share(pairs: Sequence[tuple[float, float]], share: float) -> float:
    """The root t in (0, 1/2] of sum g_i r^i = 0, r = t/(1-t), where g_0 < 0 and the curve increases.

    pairs: (g_i, C(n,i) w_i), g_i = C(n,i) w_i (b_i - force), highest power first; share: a first guess of 2t.
    """
    low, high, shrink, last_step = 0.0, 2.0, 0.25, inf
    r = share / (2.0 - share)
    for _ in range(200):
        gap, gap_slope, total, total_slope = _values_and_slopes(pairs, r)
        if gap == 0.0:
            break
        low, high = (r, high) if gap < 0.0 else (low, r)
        rise = gap_slope * total - gap * total_slope  # df/dr times W^2
        step = -gap * total / rise if rise > 0.0 else inf
        new = (r * (1.0 + r) + step) / (1.0 + r - step) if step < 1.0 + r else inf  # the step in t, written in r
        if abs(new - r) <= 1.0e-10 * r:
            r = new  # quadratic: the next step would be rounding
            break
        if not low < new < high or abs(new - r) > 0.5 * last_step:
            new = sqrt(low) * sqrt(high) if low > 0.0 else high * shrink
            shrink = shrink if low > 0.0 else shrink * shrink
        last_step, r = abs(new - r), new
    return r / (1.0 + r)


def _values_and_slopes(pairs: Sequence[tuple[float, float]], r: float) -> tuple[float, float, float, float]:
    gap = gap_slope = total = total_slope = 0.0
    for g, w in pairs:
        gap_slope = gap_slope * r + gap
        gap = gap * r + g
        total_slope = total_slope * r + total
        total = total * r + w
    return gap, gap_slope, total, total_slope
