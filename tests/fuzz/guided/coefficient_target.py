"""What a byte string does to the check of an upload: what it lets pass must be a model that control can live with."""

import struct
from itertools import pairwise
from math import isfinite

from gateway.bsfm import CoefficientLimits, RationalBezier
from gateway.bsfm.coefficients import SLOPE_FLOOR_N_PER_V, Coefficients
from gateway.registers.upload.coefficients import (
    BLOCK_BYTES,
    HEAD_BYTES,
    HEAD_WORDS,
    CoefficientSet,
    set_crc,
    words_of_block,
)
from gateway.registers.upload.staging import Staged, StagedFault, check_staged
from tests.calibrations.coefficients import calibration, staged

LIMITS = CoefficientLimits(cell_range_n=100.0)
PARTS = 64
CRC_AT = HEAD_BYTES + 4


def judge_coefficients(data: bytes) -> None:
    """The input as a staging block, its checksum made right: refused with a sentence, or fit by sampling."""
    block = bytearray(data[:BLOCK_BYTES].ljust(BLOCK_BYTES, b"\0"))
    is_short = int.from_bytes(block[HEAD_BYTES : HEAD_BYTES + 2], "big") == HEAD_WORDS
    words = bytes(block[:HEAD_BYTES]) if is_short else words_of_block(bytes(block))
    struct.pack_into(">I", block, CRC_AT, set_crc(words))
    checked = check_staged(bytes(block), LIMITS)
    if isinstance(checked, StagedFault):
        assert checked.text and "\n" not in checked.text
        return
    assert_fit(checked)


def assert_fit(given: Staged) -> None:
    """Both branches finite, rising, invertible, and the falling one not below; no stop that is none."""
    used = given.coefficients
    span_v = used.x1_v - used.x0_v
    assert LIMITS.voltage_min_v <= used.x0_v < used.x1_v <= LIMITS.voltage_max_v
    rising = sampled(used.rising_handles_n, used.rising_weights)
    falling = sampled(used.falling_handles_n, used.falling_weights)
    least_n = 0.99 * SLOPE_FLOOR_N_PER_V * span_v / PARTS
    for forces_n in (rising, falling):
        assert all(isfinite(force_n) and abs(force_n) <= LIMITS.cell_range_n for force_n in forces_n)
        assert all(above - below >= least_n - 1e-7 for below, above in pairwise(forces_n)), forces_n
    assert all(above >= below - 1e-6 for below, above in zip(rising, falling, strict=True))
    assert all(radius > 0.0 and isfinite(radius) for radius in used.slip_radii_v)
    assert not used.slip_shares or abs(sum(used.slip_shares)) < 10.0
    assert_invertible(used)
    low, high = given.force_limits_n or (max(rising[0], falling[0]), min(rising[-1], falling[-1]))
    assert max(rising[0], falling[0]) - 1e-4 <= low < high <= min(rising[-1], falling[-1]) + 1e-4


def assert_invertible(used: Coefficients) -> None:
    for handles_n, weights in (
        (used.rising_handles_n, used.rising_weights),
        (used.falling_handles_n, used.falling_weights),
    ):
        curve = RationalBezier(used.x0_v, used.x1_v, handles_n, weights)
        span_n = handles_n[-1] - handles_n[0]
        for part in range(PARTS // 4 + 1):
            force_n = handles_n[0] + span_n * part / (PARTS // 4)
            voltage_v, _ = curve.inverse(force_n)
            share = (voltage_v - used.x0_v) / (used.x1_v - used.x0_v)
            assert 0.0 <= share <= 1.0
            assert abs(de_casteljau(handles_n, weights, share) - force_n) <= 1e-5 * (1.0 + span_n)


def sampled(handles_n: tuple[float, ...], weights: tuple[float, ...]) -> list[float]:
    return [de_casteljau(handles_n, weights, k / PARTS) for k in range(PARTS + 1)]


def de_casteljau(handles_n: tuple[float, ...], weights: tuple[float, ...], t: float) -> float:
    """A point of a rational Bezier curve by repeated interpolation (Farin, "Curves and Surfaces for CAGD", 13.2)."""
    above = [handle * weight for handle, weight in zip(handles_n, weights, strict=True)]
    below = list(weights)
    while len(above) > 1:
        above = [(1.0 - t) * one + t * other for one, other in pairwise(above)]
        below = [(1.0 - t) * one + t * other for one, other in pairwise(below)]
    return above[0] / below[0]


def coefficient_seeds() -> list[bytes]:
    """Sets of several orders, with stops and response, and in the short form."""
    sets = [CoefficientSet.of_calibration(calibration(3, order=order)) for order in (1, 2, 5, 15)]
    return [*map(staged, sets), staged(sets[1], length=HEAD_WORDS)]
