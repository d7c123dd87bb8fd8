"""Is a staged set of coefficients whole and fit to be used? Pure: words in, a trusted set or the first fault out.

In the order in which a fault explains those after it: length, stops that a read-back has cut off, CRC-32, unused words and
places, order and number of stops, target slot, then the checks of every number, of the curves and of the stops
(gateway.bsfm.validate), then the force limits against what the curves reach.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from struct import Struct
from typing import Final, NamedTuple

from gateway.bsfm.coefficients import RADII_FROM, SHARES_FROM, STRIDE, WHOLE, Allowed
from gateway.bsfm.curve import ORDER_MAX
from gateway.bsfm.slip.slip_stops import STOPS_CARRIED, STOPS_MAX
from gateway.bsfm.validate import CoefficientLimits, CoefficientReason, Coefficients, validate_coefficients
from gateway.registers.upload.coefficients import (
    BLOCK_BYTES,
    HEAD_BYTES,
    HEAD_WORDS,
    SET_WORDS,
    UNUSED_WORDS,
    CoefficientSet,
    set_crc,
    words_of_block,
)
from gateway.registers.values import decimal
from gateway.registers.words import UploadReason

SLOTS: Final = 8
_TRAILER: Final = Struct(">H2xIH")  # length, unused, crc32, target_slot


@dataclass(frozen=True, slots=True)
class StagedFault:
    """index: the number as gateway.bsfm.coefficients counts, -1 the whole set; reason: an UploadReason or
    CoefficientReason; text: what was seen."""

    index: int
    reason: UploadReason | CoefficientReason
    text: str

    def sentence(self, active: int) -> str:
        """Return E401 for log and page. active: number of the calibration that stays in use."""
        where = "" if self.index == WHOLE else f"index {self.index}, "
        return f"E401 {where}{self.reason.name.lower()}: {self.text}; active set {active} unchanged"


class Staged(NamedTuple):
    """A set fit to be used. force_limits_n: of its own, as decimals, so that 25.3 N is 25.3 N and not the float32 just below
    it; empty where they are the branches' reach, which needs no limit to act. without_stops: it came in the form of version
    1 of the map, which has room for the linear blend alone."""

    coefficients: Coefficients
    force_limits_n: tuple[float, ...]
    slot: int
    without_stops: bool


class _StagedSet(NamedTuple):
    """What a block holds, taken apart. words: those that length and CRC speak of."""

    words: bytes
    staged: CoefficientSet
    length: int
    crc: int
    slot: int


def check_staged(block: bytes, limits: CoefficientLimits) -> Staged | StagedFault:
    """Return the set and its target slot, or the first fault. block: the words of the staging block, BLOCK_BYTES.

    ValueError on another length: that is our own fault.
    """
    if len(block) != BLOCK_BYTES:
        raise ValueError(f"{len(block)} bytes are staged, {BLOCK_BYTES} are needed")
    given = _take_apart(block)
    if (fault := next(_frame_faults(block, given), None)) is not None:
        return fault
    used = _cut_to_order(given.staged)
    for finding in validate_coefficients(used, limits):
        return StagedFault(finding.index, finding.reason, finding.text)
    if (fault := _force_fault(given.staged)) is not None:
        return fault
    return Staged(used, _own_limits_n(given.staged), given.slot, given.length == HEAD_WORDS)


def _take_apart(block: bytes) -> _StagedSet:
    length, crc, slot = _TRAILER.unpack_from(block, HEAD_BYTES)
    words = block[:HEAD_BYTES] if length == HEAD_WORDS else words_of_block(block)
    return _StagedSet(words, CoefficientSet.from_words(words), length, crc, slot)


def _frame_faults(block: bytes, given: _StagedSet) -> Iterator[StagedFault]:
    """Yield what can be said without judging a number."""
    staged = given.staged
    if given.length not in (SET_WORDS, HEAD_WORDS):
        text = f"length {given.length}: {SET_WORDS} is a whole set, {HEAD_WORDS} one without slip stops and response"
        yield StagedFault(WHOLE, UploadReason.LENGTH, text)
    if STOPS_CARRIED < staged.stops <= STOPS_MAX:
        text = f"{staged.stops} slip stops, the registers carry {STOPS_CARRIED}: a read-back that has lost the others"
        yield StagedFault(WHOLE, UploadReason.STOPS_CUT, text)
    if given.crc != (own := set_crc(given.words)):
        yield StagedFault(WHOLE, UploadReason.CRC, f"crc32 0x{given.crc:08X}, the words staged have 0x{own:08X}")
    used_words = UNUSED_WORDS[: 1 if given.length == HEAD_WORDS else None]
    for word in used_words:
        if any(block[2 * word : 2 * word + 2]):
            yield StagedFault(WHOLE, UploadReason.UNUSED_NOT_ZERO, f"unused word {word} of the block is not 0")
    if not 1 <= staged.order <= ORDER_MAX:
        yield StagedFault(WHOLE, CoefficientReason.ORDER, f"order {staged.order}: 1 .. {ORDER_MAX} is allowed")
    if staged.stops > STOPS_CARRIED:
        text = f"{staged.stops} slip stops: 0 .. {STOPS_CARRIED} is allowed"
        yield StagedFault(WHOLE, CoefficientReason.SLIP_STOPS, text)
    if given.slot >= SLOTS:
        yield StagedFault(WHOLE, UploadReason.TARGET_SLOT, f"target_slot {given.slot}: 0 .. {SLOTS - 1} is allowed")
    yield from _unused_places(staged)


def _unused_places(staged: CoefficientSet) -> Iterator[StagedFault]:
    """In the arrays, beyond what order and number of stops use."""
    arrays = [(branch * STRIDE, array, staged.order + 1) for branch, array in enumerate(staged.arrays)]
    arrays += [(RADII_FROM, staged.slip_radii_v, staged.stops), (SHARES_FROM, staged.slip_shares, staged.stops)]
    for first, array, used in arrays:
        for place, number in enumerate(array[used:], used):
            if number != 0.0:
                text = f"{number:g} in place {place}, places 0 .. {used - 1} are used"
                yield StagedFault(first + place, UploadReason.UNUSED_NOT_ZERO, text)


def _cut_to_order(staged: CoefficientSet) -> Coefficients:
    rising_b, rising_w, falling_b, falling_w = (array[: staged.order + 1] for array in staged.arrays)
    return Coefficients(
        staged.x0_v,
        staged.x1_v,
        rising_b,
        rising_w,
        falling_b,
        falling_w,
        staged.blend_span_n,
        staged.slip_radii_v[: staged.stops],
        staged.slip_shares[: staged.stops],
        staged.response,
    )


def _force_fault(staged: CoefficientSet) -> StagedFault | None:
    """Limits must lie within what both branches reach: their end handles, since the curves do increase. 40 N with its words
    swapped are 2.4e-41 N, which is within it: no force could be asked for any more."""
    low, high = _reach_n(staged)
    for name, limit_n, reached_n in (("low", staged.force_low_n, low), ("high", staged.force_high_n, high)):
        swapped = Allowed(f"force_{name}", low, high, "N", CoefficientReason.NONE).swap_fault(limit_n)
        if swapped and limit_n != reached_n:
            return StagedFault(swapped.index, swapped.reason, swapped.text)
    if low <= staged.force_low_n < staged.force_high_n <= high:
        return None
    text = f"force limits {staged.force_low_n:g} .. {staged.force_high_n:g} N, the branches reach {low:g} .. {high:g} N"
    return StagedFault(WHOLE, UploadReason.FORCE_LIMITS, text)


def _reach_n(staged: CoefficientSet) -> tuple[float, float]:
    low = max(staged.rising_handles_n[0], staged.falling_handles_n[0])
    return low, min(staged.rising_handles_n[staged.order], staged.falling_handles_n[staged.order])


def _own_limits_n(staged: CoefficientSet) -> tuple[float, ...]:
    limits_n = staged.force_low_n, staged.force_high_n
    return () if limits_n == _reach_n(staged) else (decimal(limits_n[0]), decimal(limits_n[1]))
