"""CRC-32 as zlib counts it, for languages without one: steps of four or of two bits, from a table."""

POLYNOMIAL = 0xEDB88320
"""Reversed, as IEEE 802.3 gives it."""


def crc_table(bits: int) -> list[int]:
    """Return the CRC of each value of so many bits: crc = crc >> bits ^ table[(crc ^ value) & mask]."""
    return [_shift(value, bits) for value in range(1 << bits)]


def _shift(value: int, bits: int) -> int:
    for _ in range(bits):
        value = value >> 1 ^ (POLYNOMIAL if value & 1 else 0)
    return value
