"""Values and words: round trips, word orders against the bytes that Modbus people write down."""

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.registers.values import (
    RAW_LIMITS,
    WordOrder,
    float32,
    pack_number,
    swap_words,
    unpack_number,
    words_swapped_from_little_endian,
)

FLOATS = st.floats(width=32, allow_nan=False)


def test_word_orders_of_the_proof_constants():
    assert pack_number("float32", WordOrder.ABCD, 1234.5) == bytes.fromhex("449A5000")
    assert pack_number("float32", WordOrder.CDAB, 1234.5) == bytes.fromhex("5000449A")
    assert pack_number("int32", WordOrder.CDAB, 0x12345678) == bytes.fromhex("56781234")


def test_twelve_newtons_swapped_read_next_to_nothing():
    swapped = unpack_number("float32", WordOrder.CDAB, pack_number("float32", WordOrder.ABCD, 12.0))
    assert f"{swapped:.3g}" == "2.34e-41"


@given(st.sampled_from(sorted(RAW_LIMITS)), st.sampled_from(WordOrder), st.data())
def test_whole_numbers_survive(kind, order, data):
    number = data.draw(st.integers(*RAW_LIMITS[kind]))
    assert unpack_number(kind, order, pack_number(kind, order, number)) == number


@given(FLOATS, st.sampled_from(WordOrder))
def test_floats_survive(number, order):
    assert unpack_number("float32", order, pack_number("float32", order, number)) == number


@given(st.lists(FLOATS, max_size=20))
def test_the_quick_swap_is_the_plain_one(numbers):
    high_first = struct.pack(f">{len(numbers)}f", *numbers)
    low_first = words_swapped_from_little_endian(struct.pack(f"<{len(numbers)}f", *numbers))
    assert low_first == swap_words(high_first)
    assert swap_words(low_first) == high_first


def test_what_does_not_fit_is_said_not_wrapped():
    for kind, (low, high) in RAW_LIMITS.items():
        for number in (low - 1, high + 1):
            with pytest.raises(ValueError, match="does not fit"):
                pack_number(kind, WordOrder.ABCD, number)
    with pytest.raises(ValueError, match="does not fit"):
        pack_number("uint16", WordOrder.ABCD, math.nan)
    for number in (1e39, -1e300):  # it went out as infinite, and the gateway called a number of somebody's no number
        with pytest.raises(ValueError, match="does not fit"):
            pack_number("float32", WordOrder.ABCD, number)
    assert pack_number("float32", WordOrder.ABCD, math.inf) == bytes.fromhex("7F800000")
    with pytest.raises(ValueError, match="takes 2 registers"):
        unpack_number("float32", WordOrder.ABCD, b"\0\0")


def test_unavailable():
    assert pack_number("int16", WordOrder.ABCD, math.nan) == b"\x80\x00"
    assert math.isnan(unpack_number("int16", WordOrder.ABCD, b"\x80\x00"))
    for kind in ("int32", "float32"):  # no other kind has a number that means it
        assert unpack_number(kind, WordOrder.ABCD, pack_number(kind, WordOrder.ABCD, -32768)) == -32768
    assert float32(1e39) == math.inf
    assert float32(-1e39) == -math.inf
