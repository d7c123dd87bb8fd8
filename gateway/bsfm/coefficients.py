"""A model's numbers before anybody trusts them, and what a fault in one of them is called.

A fault's index counts the numbers of the upload: 32 per branch (rising, falling), 16 handles then 16 weights each, so
that it is branch * 32 + (16 if weight) + i; then 16 radii and 16 shares of slip stops; then dead time, lag, second lag and
damping of the response. A fault of a whole branch, or of all stops, has the index of its first number; one of the whole set -1.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import IntEnum
from math import isfinite
from typing import Final

from gateway.bsfm.branches import Branches
from gateway.bsfm.model import Calibration, Response

STRIDE: Final = 16  # numbers of an array as carried, whatever the order
SLOPE_FLOOR_N_PER_V: Final = 0.5  # on a flatter branch a small error of force asks for a large voltage
WHOLE: Final = -1
RADII_FROM: Final = 4 * STRIDE
SHARES_FROM: Final = 5 * STRIDE
RESPONSE_FROM: Final = 6 * STRIDE
_NO_FIT_GIVES: Final = 1.0e-20  # so small a number other than 0 is a bit pattern, not a result
_MEANT: Final = 1.0e-6  # and this may be one


class CoefficientReason(IntEnum):
    """Reasons for which coefficients are refused: the numbers go to the failing_reason register."""

    NONE = 0
    NOT_FINITE = 1
    HANDLE_RANGE = 2
    WEIGHT_RANGE = 3
    WORDS_SWAPPED = 4
    NOT_INCREASING = 5
    SLOPE_FLOOR = 6
    CROSSING = 7
    VOLTAGE_RANGE = 8
    ORDER = 9
    BLEND_SPAN = 10
    SLIP_STOPS = 11  # how many
    SLIP_RADIUS = 12
    SLIP_SHARE = 13
    SLIP_STIFFNESS = 14  # against the branches
    RESPONSE = 15


@dataclass(frozen=True, slots=True)
class CoefficientFault:
    """One number that is refused. index: see the module; text: a sentence with the number seen and what is allowed."""

    index: int
    reason: CoefficientReason
    text: str


@dataclass(frozen=True, slots=True)
class CoefficientLimits:
    """Bounds of what coefficients may be. cell_range_n: the load cell's range, bound of |b|; weights are bounded as given
    and after w0 = 1.
    """

    cell_range_n: float
    voltage_min_v: float = 0.0
    voltage_max_v: float = 10.0
    voltage_range_least_v: float = 0.1  # over less no ladder is fitted
    weight_min: float = 1.0e-3
    weight_max: float = 1.0e3
    slope_floor_n_per_v: float = SLOPE_FLOOR_N_PER_V
    blend_span_max_n: float = 100.0
    slip_radius_min_v: float = 1.0e-4
    slip_radius_max_v: float = 100.0
    dead_time_max_s: float = 1.0
    lag_max_s: float = 2.0
    damping_max: float = 1.0


@dataclass(frozen=True, slots=True)
class Coefficients:
    """Numbers not yet trusted: any length, any value. No slip stops: the linear blend; response None: not measured."""

    x0_v: float
    x1_v: float
    rising_handles_n: tuple[float, ...]
    rising_weights: tuple[float, ...]
    falling_handles_n: tuple[float, ...]
    falling_weights: tuple[float, ...]
    blend_span_n: float = 0.0
    slip_radii_v: tuple[float, ...] = ()
    slip_shares: tuple[float, ...] = ()
    response: Response | None = None

    @classmethod
    def of(cls, branches: Branches, blend_span_n: float = 0.0) -> "Coefficients":
        """Return the coefficients of two branches with a linear blend."""
        rising, falling = branches.rising, branches.falling
        return cls(rising.x0, rising.x1, rising.handles, rising.weights, falling.handles, falling.weights, blend_span_n)

    @classmethod
    def of_calibration(cls, calibration: Calibration) -> "Coefficients":
        """Return the coefficients of a calibration, stops and response included."""
        return cls(
            calibration.x0_v,
            calibration.x1_v,
            calibration.rising_handles_n,
            calibration.rising_weights,
            calibration.falling_handles_n,
            calibration.falling_weights,
            calibration.blend_span_n,
            calibration.slip_radii_v,
            calibration.slip_shares,
            calibration.response,
        )

    def round_to_float32(self) -> "Coefficients":
        """Return the set as float32 stores it; what overflows float32 becomes infinite."""
        return Coefficients(
            float32(self.x0_v),
            float32(self.x1_v),
            tuple(map(float32, self.rising_handles_n)),
            tuple(map(float32, self.rising_weights)),
            tuple(map(float32, self.falling_handles_n)),
            tuple(map(float32, self.falling_weights)),
            float32(self.blend_span_n),
            tuple(map(float32, self.slip_radii_v)),
            tuple(map(float32, self.slip_shares)),
            None if self.response is None else _round_response(self.response),
        )


@dataclass(frozen=True, slots=True)
class Allowed:
    """What a number may be, and what it is called and why refused when it is not."""

    name: str
    low: float
    high: float
    unit: str
    reason: CoefficientReason

    def faults(self, index: int, number: float) -> Iterator[CoefficientFault]:
        """Yield none or one fault. A number that makes sense with its words swapped was meant to be that."""
        tiny = 0.0 < abs(number) < _NO_FIT_GIVES
        if self.low <= number <= self.high and not tiny:
            return
        if swapped := self._swapped_fault(index, number):
            yield swapped
        elif not tiny or not self.low <= number <= self.high:
            reason = self.reason if isfinite(number) else CoefficientReason.NOT_FINITE
            yield CoefficientFault(index, reason, self._refused(number))

    def _refused(self, number: float) -> str:
        allowed = f"{self.low:g} .. {self.high:g} {self.unit}".rstrip()
        return f"{self.name} = {number:g}: {allowed} is allowed"

    def swap_fault(self, number: float) -> CoefficientFault | None:
        """Return the fault of a number of the whole set that makes sense with its words swapped alone, None for none. A range
        or a limit is no result of a fit: next to nothing is not meant by it, though it is within what is allowed."""
        is_meant = self.low <= number <= self.high and not 0.0 < abs(number) < _MEANT
        return None if is_meant else self._swapped_fault(WHOLE, number)

    def _swapped_fault(self, index: int, number: float) -> CoefficientFault | None:
        swapped = _swap_words(number)
        if not (self.low <= swapped <= self.high and abs(swapped) > _MEANT):
            return None
        if self.low <= number <= self.high:
            text = f"{self.name} = {number:g}; with its words swapped {swapped:g}: the sender uses the other word order"
        else:  # one number in ten that nobody has sent, as a fit's, is so by chance
            text = (
                f"{self._refused(number)}; with its words swapped {swapped:g}, as from a sender of the other word order"
            )
        return CoefficientFault(index, CoefficientReason.WORDS_SWAPPED, text)


def float32(number: float) -> float:
    """Return the nearest float32; infinite beyond its range."""
    try:
        return float(struct.unpack(">f", struct.pack(">f", number))[0])
    except OverflowError:
        return float("inf") if number > 0 else float("-inf")


def _round_response(response: Response) -> Response:
    return replace(
        response,
        dead_time_s=float32(response.dead_time_s),
        lag_s=float32(response.lag_s),
        second_lag_s=float32(response.second_lag_s),
        damping=float32(response.damping),
    )


def _swap_words(number: float) -> float:
    data = struct.pack(">f", number)
    return float(struct.unpack(">f", data[2:] + data[:2])[0])
