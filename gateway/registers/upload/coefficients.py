"""A whole model as words: the common part of the staging and the active block.

190 words in two stretches of a block, by address. 140 words at its start: order, one unused, x range, then rising b, rising
w, falling b, falling w with a fixed stride of 16 float32 (unused ones 0), force limits, blend span. 50 words at +150: number
of slip stops, one unused, dead time and two lags of the response in s (all 0: not measured) and its damping (0: it does not
ring), ten radii, ten shares. Big-endian, high word first. The CRC-32 (zlib, initial 0) of an upload covers exactly these
bytes, and is model_hash.

The first stretch alone was the whole set in version 1 of the map; masters may still send it, as a set without slip stops
and response. A test compares the offsets with the map.
"""

import struct
from dataclasses import dataclass, replace
from struct import Struct
from typing import Final
from zlib import crc32

from gateway.bsfm.coefficients import STRIDE
from gateway.bsfm.model import Calibration, Response
from gateway.bsfm.slip.slip_stops import STOPS_CARRIED
from gateway.registers.values import decimal

_HEAD: Final = Struct(f">H2x2f{4 * STRIDE}f3f")
_TAIL: Final = Struct(f">H2x4f{2 * STOPS_CARRIED}f")
HEAD_BYTES: Final = _HEAD.size
HEAD_WORDS: Final = HEAD_BYTES // 2
"""Length of a set without slip stops and response."""
SET_BYTES: Final = HEAD_BYTES + _TAIL.size
SET_WORDS: Final = SET_BYTES // 2
TAIL_FROM: Final = 150  # in words, from a block's first address
BLOCK_BYTES: Final = 2 * TAIL_FROM + _TAIL.size
UNUSED_WORDS: Final = (1, TAIL_FROM + 1)  # of a block: they keep floats at even addresses

Numbers = tuple[float, ...]
NOT_MEASURED: Final = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class CoefficientSet:
    """As carried: arrays of up to 16 numbers, stops of up to 10, not judged. Handles and limits in N, range and radii in V.

    stops: how many the model has, which may be more than are carried. response_s: dead time, lag, second lag in s, and damping.
    """

    order: int
    x0_v: float
    x1_v: float
    rising_handles_n: Numbers
    rising_weights: Numbers
    falling_handles_n: Numbers
    falling_weights: Numbers
    force_low_n: float
    force_high_n: float
    blend_span_n: float
    stops: int = 0
    slip_radii_v: Numbers = ()
    slip_shares: Numbers = ()
    response_s: tuple[float, float, float, float] = NOT_MEASURED

    @property
    def arrays(self) -> tuple[Numbers, Numbers, Numbers, Numbers]:
        """The four arrays: rising handles in N, rising weights, falling handles in N, falling weights."""
        return self.rising_handles_n, self.rising_weights, self.falling_handles_n, self.falling_weights

    @property
    def response(self) -> Response | None:
        """The response, as the decimals that were meant; None where it was not measured."""
        if self.response_s == NOT_MEASURED:
            return None
        dead_time_s, lag_s, second_lag_s, damping = map(decimal, self.response_s)
        return Response(dead_time_s=dead_time_s, lag_s=lag_s, second_lag_s=second_lag_s, damping=damping)

    @classmethod
    def of_calibration(cls, calibration: Calibration) -> "CoefficientSet":
        """Return the set of a calibration. Its limits are its own as far as both branches reach, else that reach. Of
        more stops than a set carries the first."""
        low_n, high_n = _limits_n(calibration)
        response = calibration.response
        return cls(
            order=calibration.order,
            x0_v=calibration.x0_v,
            x1_v=calibration.x1_v,
            rising_handles_n=calibration.rising_handles_n,
            rising_weights=calibration.rising_weights,
            falling_handles_n=calibration.falling_handles_n,
            falling_weights=calibration.falling_weights,
            force_low_n=low_n,
            force_high_n=high_n,
            blend_span_n=calibration.blend_span_n,
            stops=len(calibration.slip_radii_v),
            slip_radii_v=calibration.slip_radii_v[:STOPS_CARRIED],
            slip_shares=calibration.slip_shares[:STOPS_CARRIED],
            response_s=_numbers_of(response) if response else NOT_MEASURED,
        )

    def to_words(self) -> bytes:
        """Return SET_BYTES bytes. ValueError when an array is longer than there is room."""
        branches = (number for array in self.arrays for number in _pad(array, STRIDE))
        stops = (number for array in (self.slip_radii_v, self.slip_shares) for number in _pad(array, STOPS_CARRIED))
        limits = (self.force_low_n, self.force_high_n, self.blend_span_n)
        head = _HEAD.pack(self.order, self.x0_v, self.x1_v, *branches, *limits)
        return head + _TAIL.pack(self.stops, *self.response_s, *stops)

    @classmethod
    def from_words(cls, words: bytes) -> "CoefficientSet":
        """Return a set with all places of each array, whatever order and number of stops say. HEAD_BYTES make a set
        without stops and response. ValueError on any other length than that and SET_BYTES."""
        if len(words) not in (HEAD_BYTES, SET_BYTES):
            raise ValueError(f"{len(words)} bytes, a set has {SET_BYTES}, or {HEAD_BYTES} without slip stops")
        order, x0, x1, *rest = _HEAD.unpack(words[:HEAD_BYTES])
        rising_b, rising_w, falling_b, falling_w = (tuple(rest[k : k + STRIDE]) for k in range(0, 4 * STRIDE, STRIDE))
        low, high, span = rest[4 * STRIDE :]
        stops, dead_time, lag, second_lag, damping, *slip = _TAIL.unpack(words[HEAD_BYTES:] or bytes(_TAIL.size))
        return cls(
            order, x0, x1, rising_b, rising_w, falling_b, falling_w, low, high, span,
            stops, tuple(slip[:STOPS_CARRIED]), tuple(slip[STOPS_CARRIED:]), (dead_time, lag, second_lag, damping),
        )  # fmt: skip


def words_of_block(block: bytes) -> bytes:
    """Return the set's words (SET_BYTES) out of a staging or active block."""
    return block[:HEAD_BYTES] + block[2 * TAIL_FROM : BLOCK_BYTES]


def set_crc(words: bytes) -> int:
    """Return the number that an upload's crc32 must have."""
    return crc32(words)


def model_hash(calibration: Calibration) -> int:
    """Return the CRC-32 of all that changes a voltage: the CRC of the calibration's words, and of stops beyond those
    after them."""
    beyond = (*calibration.slip_radii_v[STOPS_CARRIED:], *calibration.slip_shares[STOPS_CARRIED:])
    words = CoefficientSet.of_calibration(calibration).to_words()
    return set_crc(words + struct.pack(f">{len(beyond)}f", *beyond))


def _limits_n(calibration: Calibration) -> tuple[float, float]:
    low_n, high_n = replace(calibration, force_limits_n=()).allowed_n
    own_low_n, own_high_n = calibration.allowed_n
    return max(low_n, own_low_n), min(high_n, own_high_n)


def _numbers_of(response: Response) -> tuple[float, float, float, float]:
    return response.dead_time_s, response.lag_s, response.second_lag_s, response.damping


def _pad(array: Numbers, room: int) -> Numbers:
    if len(array) > room:
        raise ValueError(f"{len(array)} numbers in an array of at most {room}")
    return (*array, *(0.0,) * (room - len(array)))
