"""CRC-16/MODBUS: polynomial 0xA001 (0x8005 reflected), start 0xFFFF, low byte first on the wire."""

from collections.abc import Iterable
from typing import Final


def _entry(byte: int) -> int:
    value = byte
    for _ in range(8):
        value = (value >> 1) ^ (0xA001 if value & 1 else 0)
    return value


_TABLE: Final = tuple(_entry(byte) for byte in range(256))


def crc16(data: Iterable[int]) -> int:
    """Checksum of the bytes of an RTU frame without its last two. The check value of b"123456789" is 0x4B37."""
    value = 0xFFFF
    for byte in data:
        value = (value >> 8) ^ _TABLE[(value ^ byte) & 0xFF]
    return value


def crc_bytes(data: Iterable[int]) -> bytes:
    """The same as it stands on the wire, low byte first."""
    return crc16(data).to_bytes(2, "little")
