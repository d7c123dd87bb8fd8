"""One value <-> its words on the wire.

Words are big-endian. A 32-bit value has its high word first (ABCD) or its low word first (CDAB); the bytes inside a word never
move. A number that is not available is NaN in float32 and 0x8000 in int16, which therefore no int16 quantity uses.
"""

from array import array
from enum import StrEnum
from math import copysign, inf, isfinite, nan
from struct import Struct
from typing import Final

UNAVAILABLE_INT16: Final = -0x8000
LARGEST_FLOAT32: Final = 3.4028234663852886e38


class WordOrder(StrEnum):
    """Order of the two words of a 32-bit value."""

    ABCD = "abcd"  # high word first
    CDAB = "cdab"  # low word first


_STRUCTS: Final = {
    "int16": Struct(">h"),
    "uint16": Struct(">H"),
    "int32": Struct(">i"),
    "uint32": Struct(">I"),
    "float32": Struct(">f"),
}
TYPES: Final = tuple(_STRUCTS)

RAW_LIMITS: Final = {
    "int16": (-0x7FFF, 0x7FFF),  # -0x8000 means unavailable
    "uint16": (0, 0xFFFF),
    "int32": (-0x80000000, 0x7FFFFFFF),
    "uint32": (0, 0xFFFFFFFF),
}
"""Smallest and largest count that a whole-number type carries."""


def words_of(kind: str) -> int:
    """Return registers that one value of this type takes."""
    return _STRUCTS[kind].size // 2


def swap_words(data: bytes) -> bytes:
    """Swap the words of any number of 32-bit values: ABCD bytes become CDAB bytes, and back."""
    swapped = bytearray(data)
    swapped[0::4], swapped[1::4], swapped[2::4], swapped[3::4] = data[2::4], data[3::4], data[0::4], data[1::4]
    return bytes(swapped)


def words_swapped_from_little_endian(data: bytes) -> bytes:
    """Turn float32 values packed little-endian (DCBA) -> CDAB: one call instead of four slices, for publish."""
    words = array("H", data)
    words.byteswap()
    return words.tobytes()


def pack_number(kind: str, order: WordOrder, number: float) -> bytes:
    """Return words of one raw number. ValueError when the type cannot carry it."""
    if kind == "float32":
        try:
            data = _STRUCTS[kind].pack(float(number))
        except OverflowError:
            raise ValueError(f"{number:g} does not fit in float32") from None
    else:
        low, high = RAW_LIMITS[kind]
        if number != number and kind == "int16":
            low, number = UNAVAILABLE_INT16, float(UNAVAILABLE_INT16)
        if not low <= number <= high:
            raise ValueError(f"{number:g} does not fit in {kind}: {low} .. {high}")
        data = _STRUCTS[kind].pack(round(number))
    return swap_words(data) if order is WordOrder.CDAB and len(data) == 4 else data


def unpack_number(kind: str, order: WordOrder, data: bytes) -> float | int:
    """Return the raw number of these words; NaN where int16 says unavailable. ValueError on a wrong length."""
    if len(data) != _STRUCTS[kind].size:
        raise ValueError(f"{kind} takes {words_of(kind)} registers, not {len(data) / 2:g}")
    number: float | int = _STRUCTS[kind].unpack(
        swap_words(data) if order is WordOrder.CDAB and len(data) == 4 else data
    )[0]
    return nan if kind == "int16" and number == UNAVAILABLE_INT16 else number


def float32(number: float) -> float:
    """Return the nearest float32; infinite beyond its range. A whole number may have any length."""
    try:
        return float(_STRUCTS["float32"].unpack(_STRUCTS["float32"].pack(float(number)))[0])
    except OverflowError:
        return inf if number > 0 else -inf


def decimal(number: float) -> float:
    """Return the shortest decimal that a float32 stands for: 25.3 for 25.299999237. Anything else comes back as it is."""
    return next((short for digits in (6, 7, 8) if float32(short := float(f"{number:.{digits}g}")) == number), number)


def carried_by_float32(number: float) -> float:
    """Return what a float register may show: NaN for anything not finite, clamped to what float32 carries."""
    if -LARGEST_FLOAT32 <= number <= LARGEST_FLOAT32:
        return number
    return copysign(LARGEST_FLOAT32, number) if isfinite(number) else nan
