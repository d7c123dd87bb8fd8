"""Coils in bytes: the first is bit 0 of the first byte, unused bits of the last byte are 0 (V1.1b3 section 6.1)."""

from collections.abc import Sequence


def pack_bits(values: Sequence[bool]) -> bytes:
    """Pack values as they are on the wire; an empty sequence is no byte."""
    number = 0
    for index, value in enumerate(values):
        number |= bool(value) << index
    return number.to_bytes((len(values) + 7) // 8, "little")


def unpack_bits(data: bytes, count: int) -> list[bool]:
    """Return the first count values; bits after them are ignored. Raises ValueError when data is too short."""
    if len(data) * 8 < count:
        raise ValueError(f"{count} bits do not fit in {len(data)} bytes")
    number = int.from_bytes(data, "little")
    return [bool(number >> index & 1) for index in range(count)]
