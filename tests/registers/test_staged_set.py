"""A staged set is used whole or not at all, and a refusal says which number and why."""

import struct
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.bsfm.validate import CoefficientLimits, CoefficientReason, Coefficients
from gateway.registers.coefficients import SET_BYTES, CoefficientSet, set_crc
from gateway.registers.staging import STAGED_BYTES, StagedFault, check_staged
from gateway.registers.words import UploadReason

LIMITS = CoefficientLimits(cell_range_n=100.0)
GOOD = CoefficientSet(
    order=2,
    x0_v=0.0,
    x1_v=8.0,
    rising_handles_n=(0.0, 20.0, 60.0),
    rising_weights=(1.0, 0.93, 1.0),
    falling_handles_n=(0.0, 30.0, 60.0),
    falling_weights=(1.0, 0.93, 1.0),
    force_low_n=1.0,
    force_high_n=59.0,
    blend_span_n=3.0,
)


def staged(given: CoefficientSet = GOOD, *, length: int = 140, slot: int = 3, crc: int | None = None) -> bytes:
    words = given.to_words()
    return words + struct.pack(">H2xIH", length, set_crc(words) if crc is None else crc, slot)


def fault_of(words: bytes) -> StagedFault:
    result = check_staged(words, LIMITS)
    assert isinstance(result, StagedFault)
    return result


def test_a_good_set_comes_out_with_its_slot():
    coefficients, force_limits_n, slot = check_staged(staged(), LIMITS)
    assert isinstance(coefficients, Coefficients)
    assert (force_limits_n, slot) == ((1.0, 59.0), 3)
    assert coefficients.rising_handles_n == GOOD.rising_handles_n
    assert coefficients.falling_weights == pytest.approx(GOOD.falling_weights)


def test_order_15_fits():
    handles = tuple(4.0 * k for k in range(16))
    raised = tuple(4.0 * k + (1.0 if 0 < k < 15 else 0.0) for k in range(16))
    full = replace(
        GOOD,
        order=15,
        rising_handles_n=handles,
        falling_handles_n=raised,
        rising_weights=(1.0,) * 16,
        falling_weights=(1.0,) * 16,
    )
    assert check_staged(staged(full), LIMITS).slot == 3


@pytest.mark.parametrize(
    ("low_n", "high_n", "own"), [(0.0, 60.0, ()), (0.0, 25.3, (0.0, 25.3)), (0.7, 60.0, (0.7, 60.0))]
)
def test_force_limits_of_its_own_come_out_as_the_decimals_that_were_meant(low_n, high_n, own):
    found = check_staged(staged(replace(GOOD, force_low_n=low_n, force_high_n=high_n)), LIMITS)
    assert found.force_limits_n == own


@pytest.mark.parametrize(
    ("change", "index", "reason"),
    [
        ({"order": 0}, -1, CoefficientReason.ORDER),
        ({"order": 16}, -1, CoefficientReason.ORDER),
        ({"order": 1}, 2, UploadReason.UNUSED_NOT_ZERO),
        ({"rising_handles_n": (0.0, 120.0, 60.0)}, 1, CoefficientReason.HANDLE_RANGE),
        ({"falling_weights": (1.0, 1.3e-26, 1.0)}, 49, CoefficientReason.WEIGHT_RANGE),
        ({"rising_handles_n": (0.0, float("nan"), 60.0)}, 1, CoefficientReason.NOT_FINITE),
        ({"rising_handles_n": (0.0, -90.0, 60.0)}, 0, CoefficientReason.NOT_INCREASING),
        ({"rising_handles_n": (0.0, 40.0, 60.0)}, -1, CoefficientReason.CROSSING),
        ({"x1_v": 12.0}, -1, CoefficientReason.VOLTAGE_RANGE),
        ({"force_high_n": 61.0}, -1, UploadReason.FORCE_LIMITS),
        ({"force_low_n": 59.0}, -1, UploadReason.FORCE_LIMITS),
        ({"force_low_n": float("nan")}, -1, UploadReason.FORCE_LIMITS),
    ],
)
def test_a_bad_set_is_refused_with_index_and_reason(change, index, reason):
    fault = fault_of(staged(replace(GOOD, **change)))
    assert (fault.index, fault.reason) == (index, reason)
    assert fault.sentence(16).startswith("E401 ")
    assert fault.sentence(16).endswith("active set 16 unchanged")


def test_length_crc_slot_and_unused_word_are_checked():
    assert fault_of(staged(length=139)).reason is UploadReason.LENGTH
    assert fault_of(staged(crc=0)).reason is UploadReason.CRC
    assert fault_of(staged(slot=8)).reason is UploadReason.TARGET_SLOT
    words = bytearray(staged())
    words[3] = 1
    words[284:288] = set_crc(bytes(words[:SET_BYTES])).to_bytes(4, "big")
    assert fault_of(bytes(words)).reason is UploadReason.UNUSED_NOT_ZERO


@given(st.integers(0, 8 * SET_BYTES - 1))
def test_no_flipped_bit_passes(bit):
    words = bytearray(staged())
    words[bit // 8] ^= 1 << bit % 8
    assert fault_of(bytes(words)).reason is UploadReason.CRC


def test_nothing_staged_is_refused():
    assert fault_of(bytes(STAGED_BYTES)).reason is UploadReason.LENGTH
    with pytest.raises(ValueError, match="290 are needed"):
        check_staged(bytes(10), LIMITS)
