"""CRC-16/MODBUS: polynomial 0xA001 (0x8005 reflected), start 0xFFFF, low byte first on the wire.

Source: "MODBUS over Serial Line Specification and Implementation Guide V1.02", section 6.2.2 and its appendix B.
"""

from collections.abc import Iterable
from typing import Final


def _table_entry(byte: int) -> int:
    value = byte
    for _ in range(8):
        value = (value >> 1) ^ (0xA001 if value & 1 else 0)
    return value


_TABLE: Final = tuple(_table_entry(byte) for byte in range(256))


def crc16(data: Iterable[int]) -> int:
    """Return the checksum of the bytes of an RTU frame without its last two. The check value of b"123456789" is 0x4B37."""
    value = 0xFFFF
    for byte in data:
        value = (value >> 8) ^ _TABLE[(value ^ byte) & 0xFF]
    return value


def crc_bytes(data: Iterable[int]) -> bytes:
    """Return the checksum as it stands on the wire, low byte first."""
    return crc16(data).to_bytes(2, "little")


def checksum_end(data: Iterable[int], least: int) -> int:
    """Return the least size, at least `least`, at which the first bytes end with their own checksum; 0 for none."""
    value = 0xFFFF
    for size, byte in enumerate(data, start=1):
        value = (value >> 8) ^ _TABLE[(value ^ byte) & 0xFF]
        if value == 0 and size >= least:
            return size
    return 0
