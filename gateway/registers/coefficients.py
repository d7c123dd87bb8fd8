"""A set of coefficients as words: the common part of the staging and the active block, from order through blend_span.

140 words: order, one unused, x range, then rising b, rising w, falling b, falling w with a fixed stride of 16 float32
(unused ones 0), force limits, blend span; big-endian, high word first. The CRC-32 (zlib, initial 0) of an upload covers
exactly these bytes. A test compares the offsets with the map.
"""

from dataclasses import dataclass
from struct import Struct
from typing import Final
from zlib import crc32

from gateway.bsfm.model import Calibration

STRIDE: Final = 16
_SET: Final = Struct(f">H2x2f{4 * STRIDE}f3f")
SET_BYTES: Final = _SET.size
SET_WORDS: Final = SET_BYTES // 2
UNUSED_WORD: Final = 1  # the one after order, which keeps the floats at even addresses

Numbers = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class CoefficientSet:
    """As carried: arrays of up to 16 numbers, not judged. Handles and limits in N, range in V."""

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

    @property
    def arrays(self) -> tuple[Numbers, Numbers, Numbers, Numbers]:
        return self.rising_handles_n, self.rising_weights, self.falling_handles_n, self.falling_weights

    @classmethod
    def of_calibration(cls, calibration: Calibration) -> "CoefficientSet":
        """The limits are the calibration's own, else the forces that both branches reach."""
        low_n, high_n = calibration.allowed_n
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
        )

    def to_words(self) -> bytes:
        """SET_BYTES bytes. ValueError when an array is longer than the stride."""
        if any(len(array) > STRIDE for array in self.arrays):
            raise ValueError(f"at most {STRIDE} handles and weights per branch")
        padded = (number for array in self.arrays for number in (*array, *(0.0,) * (STRIDE - len(array))))
        tail = (self.force_low_n, self.force_high_n, self.blend_span_n)
        return _SET.pack(self.order, self.x0_v, self.x1_v, *padded, *tail)

    @classmethod
    def from_words(cls, words: bytes) -> "CoefficientSet":
        """All 16 places of each array, whatever the order says. ValueError on a wrong length."""
        if len(words) != SET_BYTES:
            raise ValueError(f"{len(words)} bytes, a set has {SET_BYTES}")
        order, x0, x1, *rest = _SET.unpack(words)
        rising_b, rising_w, falling_b, falling_w = (tuple(rest[k : k + STRIDE]) for k in range(0, 4 * STRIDE, STRIDE))
        low, high, span = rest[4 * STRIDE :]
        return cls(order, x0, x1, rising_b, rising_w, falling_b, falling_w, low, high, span)


def set_crc(words: bytes) -> int:
    """The number that an upload's crc32 must have, and model_hash of the active set."""
    return crc32(words)
