"""Modbus framing as its specifications say it, once more: shares no code with the gateway."""

import struct


def frames_of(stream: bytes) -> tuple[list[tuple[int, int, bytes]], bool]:
    """The frames (transaction, unit, PDU) of a TCP stream, and whether its framing was lost."""
    frames, at = [], 0
    while True:
        head = stream[at : at + 6]
        if len(head) >= 4 and head[2:4] != b"\0\0":
            return frames, True
        if len(head) < 6:
            return frames, False
        size = head[4] * 256 + head[5]
        if size < 2 or size > 254:
            return frames, True
        if len(stream) < at + 6 + size:
            return frames, False
        body = stream[at + 6 : at + 6 + size]
        frames.append((head[0] * 256 + head[1], body[0], body[1:]))
        at += 6 + size


def crc(data: bytes) -> bytes:
    """CRC-16 of Modbus RTU, bit by bit, as it goes over the wire."""
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0xA001 if value & 1 else 0)
    return struct.pack("<H", value)
