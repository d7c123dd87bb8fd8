"""Is a staged set of coefficients whole and fit to be used? Pure: words in, a trusted set or the first fault out.

In the order in which a fault explains those after it: length, CRC-32, unused words, order, target slot, then METHOD's
checks of every number and of the curves (gateway.bsfm.validate), then the force limits against what the curves reach.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from struct import Struct
from typing import Final, NamedTuple

from gateway.bsfm.curve import ORDER_MAX
from gateway.bsfm.validate import CoefficientLimits, CoefficientReason, Coefficients, validate_coefficients
from gateway.registers.coefficients import SET_BYTES, SET_WORDS, STRIDE, UNUSED_WORD, CoefficientSet, set_crc
from gateway.registers.values import decimal
from gateway.registers.words import UploadReason

SLOTS: Final = 8
_TRAILER: Final = Struct(">H2xIH")  # length, unused, crc32, target_slot
STAGED_BYTES: Final = SET_BYTES + _TRAILER.size
_WHOLE: Final = -1  # index of a fault that no single coefficient has


@dataclass(frozen=True, slots=True)
class StagedFault:
    """index: 0..63 the coefficient, -1 the whole set; reason: an UploadReason or CoefficientReason; text: what was seen."""

    index: int
    reason: UploadReason | CoefficientReason
    text: str

    def sentence(self, active: int) -> str:
        """E401 for log and page. active: number of the calibration that stays in use."""
        where = "" if self.index == _WHOLE else f"index {self.index}, "
        return f"E401 {where}{self.reason.name.lower()}: {self.text}; active set {active} unchanged"


class Staged(NamedTuple):
    """A set fit to be used. force_limits_n: of its own, as decimals, so that 25.3 N is 25.3 N and not the float32 just below
    it; empty where they are the branches' reach, which needs no limit to act."""

    coefficients: Coefficients
    force_limits_n: tuple[float, ...]
    slot: int


def check_staged(words: bytes, limits: CoefficientLimits) -> Staged | StagedFault:
    """The set and its target slot, or the first fault. words: order through target_slot (STAGED_BYTES).

    ValueError on another length: that is our own fault.
    """
    if len(words) != STAGED_BYTES:
        raise ValueError(f"{len(words)} bytes are staged, {STAGED_BYTES} are needed")
    staged = CoefficientSet.from_words(words[:SET_BYTES])
    if (fault := next(_frame_faults(words, staged), None)) is not None:
        return fault
    used = _used(staged)
    for found in validate_coefficients(used, limits):
        return StagedFault(found.index, found.reason, found.text)
    return _force_fault(staged) or Staged(used, _own_limits_n(staged), _TRAILER.unpack(words[SET_BYTES:])[2])


def _frame_faults(words: bytes, staged: CoefficientSet) -> Iterator[StagedFault]:
    """What can be said without judging a number."""
    length, crc, slot = _TRAILER.unpack(words[SET_BYTES:])
    if length != SET_WORDS:
        yield StagedFault(_WHOLE, UploadReason.LENGTH, f"length {length}, order to blend_span are {SET_WORDS} words")
    if crc != (own := set_crc(words[:SET_BYTES])):
        yield StagedFault(_WHOLE, UploadReason.CRC, f"crc32 0x{crc:08X}, the words staged have 0x{own:08X}")
    if any(words[2 * UNUSED_WORD : 2 * UNUSED_WORD + 2]):
        yield StagedFault(_WHOLE, UploadReason.UNUSED_NOT_ZERO, "the word after order is not 0")
    if not 1 <= staged.order <= ORDER_MAX:
        yield StagedFault(_WHOLE, CoefficientReason.ORDER, f"order {staged.order}: 1 .. {ORDER_MAX} is allowed")
    if slot >= SLOTS:
        yield StagedFault(_WHOLE, UploadReason.TARGET_SLOT, f"target_slot {slot}: 0 .. {SLOTS - 1} is allowed")
    for branch, array in enumerate(staged.arrays):
        for place in range(staged.order + 1, STRIDE):
            if array[place] != 0.0:
                text = f"{array[place]:g} in place {place}, order {staged.order} uses 0 .. {staged.order}"
                yield StagedFault(branch * STRIDE + place, UploadReason.UNUSED_NOT_ZERO, text)


def _used(staged: CoefficientSet) -> Coefficients:
    rising_b, rising_w, falling_b, falling_w = (array[: staged.order + 1] for array in staged.arrays)
    return Coefficients(staged.x0_v, staged.x1_v, rising_b, rising_w, falling_b, falling_w, staged.blend_span_n)


def _force_fault(staged: CoefficientSet) -> StagedFault | None:
    """Limits must lie within what both branches reach: their end handles, since the curves do increase."""
    low, high = _reach_n(staged)
    if low <= staged.force_low_n < staged.force_high_n <= high:
        return None
    text = f"force limits {staged.force_low_n:g} .. {staged.force_high_n:g} N, the branches reach {low:g} .. {high:g} N"
    return StagedFault(_WHOLE, UploadReason.FORCE_LIMITS, text)


def _reach_n(staged: CoefficientSet) -> tuple[float, float]:
    low = max(staged.rising_handles_n[0], staged.falling_handles_n[0])
    return low, min(staged.rising_handles_n[staged.order], staged.falling_handles_n[staged.order])


def _own_limits_n(staged: CoefficientSet) -> tuple[float, ...]:
    limits_n = staged.force_low_n, staged.force_high_n
    return () if limits_n == _reach_n(staged) else (decimal(limits_n[0]), decimal(limits_n[1]))
