"""A staged set is used whole or not at all, and a refusal says which number and why."""

import struct
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.bsfm import CoefficientLimits, CoefficientReason, Coefficients, Response
from gateway.bsfm.coefficients import RADII_FROM, SHARES_FROM, WHOLE
from gateway.bsfm.slip.slip_stops import STOPS_CARRIED, STOPS_MAX
from gateway.registers.upload.coefficients import BLOCK_BYTES, SET_BYTES, CoefficientSet, set_crc, words_of_block
from gateway.registers.upload.staging import StagedFault, check_staged
from gateway.registers.values import float32
from gateway.registers.words import UploadReason
from tests.calibrations.coefficients import calibration, swapped

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


SLIP = replace(
    GOOD, stops=2, slip_radii_v=(0.5, 1.0), slip_shares=(0.75, 0.25), response_s=(float32(0.08), float32(0.1), 0.0, 0.0)
)


def staged(given: CoefficientSet = GOOD, *, length: int = 190, slot: int = 3, crc: int | None = None) -> bytes:
    """A staging block: 140 words of the set, the trailer, 5 words of the commit, 50 words of the set."""
    words = given.to_words()
    covered = words[:280] if length == 140 else words
    trailer = struct.pack(">H2xIH", length, set_crc(covered) if crc is None else crc, slot)
    return words[:280] + trailer + bytes(10) + words[280:]


def fault_of(words: bytes) -> StagedFault:
    result = check_staged(words, LIMITS)
    assert isinstance(result, StagedFault)
    return result


def test_a_good_set_comes_out_with_its_slot():
    coefficients, force_limits_n, slot, without_stops = check_staged(staged(), LIMITS)
    assert isinstance(coefficients, Coefficients)
    assert (force_limits_n, slot, without_stops) == ((1.0, 59.0), 3, False)
    assert (coefficients.slip_radii_v, coefficients.slip_shares, coefficients.response) == ((), (), None)
    assert coefficients.rising_handles_n == GOOD.rising_handles_n
    assert coefficients.falling_weights == pytest.approx(GOOD.falling_weights)


def test_stops_and_response_come_out_as_they_were_sent():
    coefficients = check_staged(staged(SLIP), LIMITS).coefficients
    assert (coefficients.slip_radii_v, coefficients.slip_shares) == ((0.5, 1.0), (0.75, 0.25))
    assert coefficients.response == Response(dead_time_s=0.08, lag_s=0.1), "the decimals that were meant"


def test_a_set_of_140_words_has_no_stops_whatever_lies_above():
    found = check_staged(staged(SLIP, length=140), LIMITS)
    assert found.without_stops
    assert (found.coefficients.slip_radii_v, found.coefficients.response) == ((), None)
    assert fault_of(staged(SLIP, length=140, crc=set_crc(SLIP.to_words()))).reason is UploadReason.CRC
    assert fault_of(staged(length=190, crc=set_crc(GOOD.to_words()[:280]))).reason is UploadReason.CRC


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


PULLS_AT_0_V = {"rising_handles_n": (-4.0, 20.0, 60.0), "falling_handles_n": (-4.0, 30.0, 60.0)}


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
        ({"falling_handles_n": (0.0, 30.0, 64.0), "force_high_n": 62.0}, -1, UploadReason.FORCE_LIMITS),
        ({"rising_handles_n": (-4.0, 20.0, 60.0), "force_low_n": -2.0}, -1, UploadReason.FORCE_LIMITS),
        ({"force_high_n": swapped(40.0)}, -1, CoefficientReason.WORDS_SWAPPED),
        ({"force_low_n": swapped(2.0)}, -1, CoefficientReason.WORDS_SWAPPED),
        ({**PULLS_AT_0_V, "force_low_n": swapped(2.0078125)}, -1, CoefficientReason.WORDS_SWAPPED),
    ],
)
def test_a_bad_set_is_refused_with_index_and_reason(change, index, reason):
    fault = fault_of(staged(replace(GOOD, **change)))
    assert (fault.index, fault.reason) == (index, reason)
    assert fault.sentence(16).startswith("E401 ")
    assert fault.sentence(16).endswith("active set 16 unchanged")


def test_a_limit_where_its_branches_begin_is_no_number_with_swapped_words():
    """Branches that a fit has begun at 5e-10 N instead of 0 N have their least force there as well; with its words swapped
    that is 2.0007 N."""
    (begins_n,) = struct.unpack(">f", bytes.fromhex("30004000"))
    curves = {"rising_handles_n": (begins_n, 20.0, 60.0), "falling_handles_n": (begins_n, 30.0, 60.0)}
    result = check_staged(staged(replace(GOOD, **curves, force_low_n=begins_n)), LIMITS)
    assert not isinstance(result, StagedFault), result.text


def test_force_limits_that_no_branch_reaches_are_told_with_what_is_reached():
    fault = fault_of(staged(replace(GOOD, force_high_n=61.0)))
    assert fault.text == "force limits 1 .. 61 N, the branches reach 0 .. 60 N"


def test_length_crc_slot_and_unused_word_are_checked():
    fault = fault_of(staged(length=139))
    assert (fault.index, fault.reason) == (WHOLE, UploadReason.LENGTH)
    assert fault.text == "length 139: 190 is a whole set, 140 one without slip stops and response"
    assert fault_of(staged(crc=0)).reason is UploadReason.CRC
    assert fault_of(staged(slot=8)).reason is UploadReason.TARGET_SLOT
    for unused in (1, 151):
        words = bytearray(staged())
        words[2 * unused + 1] = 1
        words[284:288] = set_crc(words_of_block(bytes(words))).to_bytes(4, "big")
        assert fault_of(bytes(words)).reason is UploadReason.UNUSED_NOT_ZERO


@given(st.integers(0, 8 * SET_BYTES - 1), st.sampled_from([GOOD, SLIP]))
def test_no_flipped_bit_passes(bit, given_set):
    """Of the number of stops one may make a cut read-back of it, which is said first."""
    words = bytearray(staged(given_set))
    byte = bit // 8 + (20 if bit // 8 >= 280 else 0)
    words[byte] ^= 1 << bit % 8
    assert fault_of(bytes(words)).reason in (UploadReason.CRC, *[UploadReason.STOPS_CUT] * (byte == 301))


@given(st.integers(0, 8 * 280 - 1))
def test_no_flipped_bit_of_140_words_passes(bit):
    words = bytearray(staged(length=140))
    words[bit // 8] ^= 1 << bit % 8
    assert fault_of(bytes(words)).reason is UploadReason.CRC


def test_nothing_staged_is_refused():
    assert fault_of(bytes(BLOCK_BYTES)).reason is UploadReason.LENGTH
    with pytest.raises(ValueError, match="400 are needed"):
        check_staged(bytes(10), LIMITS)


def test_as_many_stops_as_the_registers_carry_are_taken_and_more_than_a_model_has_are_none():
    radii = tuple(float32(0.2 * (k + 1)) for k in range(10))
    full = replace(GOOD, stops=10, slip_radii_v=radii, slip_shares=(0.125,) * 6 + (0.0625,) * 4)
    assert not isinstance(check_staged(staged(full), LIMITS), StagedFault)
    fault = fault_of(staged(replace(full, stops=17)))
    assert (fault.reason, fault.text) == (CoefficientReason.SLIP_STOPS, "17 slip stops: 0 .. 10 is allowed")


def test_a_calibration_s_response_is_in_its_set():
    measured = replace(calibration(), response=Response(dead_time_s=0.125, lag_s=0.25, second_lag_s=0.5, damping=0.75))
    assert CoefficientSet.of_calibration(measured).response_s == (0.125, 0.25, 0.5, 0.75)


def test_a_calibrations_set_has_its_stops_its_response_and_no_more_force_than_both_branches_reach() -> None:
    response = Response(dead_time_s=0.08, lag_s=0.1, second_lag_s=0.02, damping=0.7)
    stops = {"slip_radii_v": (0.5, 1.0), "slip_shares": (0.75, 0.25)}
    given = CoefficientSet.of_calibration(calibration(force_limits_n=(2.0, 900.0), response=response, **stops))
    assert (given.stops, given.slip_radii_v, given.slip_shares) == (2, (0.5, 1.0), (0.75, 0.25))
    assert given.response == response
    reach_n = min(given.rising_handles_n[-1], given.falling_handles_n[-1])
    assert (given.force_low_n, given.force_high_n) == (2.0, pytest.approx(reach_n))


def test_stops_beyond_their_number_are_a_master_that_means_more_of_them() -> None:
    for where, index in (("slip_radii_v", RADII_FROM), ("slip_shares", SHARES_FROM)):
        more = (*getattr(SLIP, where), 0.25)
        fault = fault_of(staged(replace(SLIP, **{where: more})))
        assert (fault.index, fault.reason) == (index + 2, UploadReason.UNUSED_NOT_ZERO)
        assert f"index {index + 2}" in fault.sentence(4)


def test_a_set_whose_stops_a_read_back_has_cut_is_told_as_such_before_its_crc() -> None:
    fault = fault_of(staged(replace(SLIP, stops=STOPS_CARRIED + 1), crc=1))
    assert fault.reason is UploadReason.STOPS_CUT
    assert fault_of(staged(replace(SLIP, stops=STOPS_MAX + 1))).reason is CoefficientReason.SLIP_STOPS


@pytest.mark.parametrize(
    ("word", "length", "is_part"), [(1, 190, True), (1, 140, True), (151, 190, True), (151, 140, False)]
)
def test_an_unused_word_counts_where_it_is_part_of_what_is_sent(word: int, length: int, is_part: bool) -> None:
    """A set of version 1 ends before the second of them: what lies there is none of it."""
    block = bytearray(staged(length=length))
    block[2 * word + 1] = 1
    covered = bytes(block[:280]) if length == 140 else words_of_block(bytes(block))
    block[284:288] = struct.pack(">I", set_crc(covered))
    result = check_staged(bytes(block), LIMITS)
    is_refused = isinstance(result, StagedFault) and result.reason is UploadReason.UNUSED_NOT_ZERO
    assert is_refused == is_part, result
