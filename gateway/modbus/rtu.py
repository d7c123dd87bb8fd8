"""RTU frames: unit, PDU, CRC-16. Silence ends a frame on the wire; these functions also say how long one will be.

A length known from the first bytes lets a host stop waiting at once instead of after 3.5 characters, and a receiver
whose operating system merges or splits reads (every USB adapter) finds the end of a frame without trusting pauses.
Both roles: the gateway serves masters with it, and asks devices that speak Modbus RTU. Source: "MODBUS over Serial Line
Specification and Implementation Guide V1.02", section 2.5.1.
"""

from collections.abc import Callable
from typing import Final

from gateway.modbus import pdu as P  # noqa: N812  the names of function codes are constants
from gateway.modbus.crc import crc16, crc_bytes
from gateway.modbus.identification import MEI_TYPE

SHORTEST_ADU: Final = 4
LONGEST_ADU: Final = 256
BROADCAST_UNIT: Final = 0
LARGEST_UNIT: Final = 247
"""Of a server; 248 to 255 are reserved (section 2.2)."""


class RtuFault(Exception):  # noqa: N818  no error of ours: the wire does this
    """The bytes are not a frame: too short, too long, or the checksum differs."""


def encode_adu(unit: int, pdu: bytes) -> bytes:
    """Return the frame as bytes, either direction. Raises ValueError when the PDU is empty or longer than 253."""
    if not 1 <= len(pdu) <= LONGEST_ADU - 3:
        raise ValueError(f"a PDU has 1 to 253 bytes, not {len(pdu)}")
    body = bytes((unit,)) + pdu
    return body + crc_bytes(body)


def decode_adu(adu: bytes) -> tuple[int, bytes]:
    """Return unit, PDU of exactly one frame. Raises RtuFault."""
    if not SHORTEST_ADU <= len(adu) <= LONGEST_ADU:
        raise RtuFault(f"{len(adu)} bytes, a frame has {SHORTEST_ADU} to {LONGEST_ADU}")
    expected = crc_bytes(adu[:-2])
    if adu[-2:] != expected:
        raise RtuFault(f"checksum {adu[-2:].hex()}, expected {expected.hex()}")
    return adu[0], adu[1:-2]


def is_whole(frame: bytes, size: int) -> bool:
    """Decide whether the first bytes are a frame: a checksum that follows its own bytes leaves nothing."""
    return SHORTEST_ADU <= size <= len(frame) and crc16(frame[:size]) == 0


def silence_s(baud: int, character_s: float) -> float:
    """Return the silence that ends a frame: 3.5 characters, above 19200 baud 1.75 ms."""
    return 1.75e-3 if baud > 19200 else 3.5 * character_s


def request_length(adu: bytes) -> int | None:
    """Return the whole length of the request that starts with these bytes. None: not yet known, or a function without a
    length (8, and what is unknown), which silence alone ends."""
    return _length(adu, _REQUEST)


def answer_length(adu: bytes) -> int | None:
    """Return the whole length of the answer that starts with these bytes, exceptions included; None as in request_length."""
    if len(adu) > 1 and adu[1] & 0x80:
        return 5
    return _length(adu, _ANSWER)


def has_request_length(function: int) -> bool:
    """Decide whether the length of a request with this function can be known before its end."""
    return function in _REQUEST


def ends_in_silence(adu: bytes) -> bool:
    """Decide whether nothing but silence ends the request that starts with these bytes, three or more."""
    return adu[1] not in _REQUEST or (adu[1] == P.ENCAPSULATED and adu[2] != MEI_TYPE)


def has_answer_length(function: int) -> bool:
    """Decide whether the length of an answer with this function can be known before its end, a refusal's included."""
    return function & 0x7F in _ANSWER


def is_broadcast_function(function: int) -> bool:
    """Decide whether a request to everybody makes sense with this function: only one that writes does."""
    return function in _WRITES


def _length(adu: bytes, lengths: dict[int, int | Callable[[bytes], int | None]]) -> int | None:
    if len(adu) < 2:
        return None
    known = lengths.get(adu[1])
    length = known(adu) if callable(known) else known
    return length if length is None or length <= LONGEST_ADU else None


def _counted(at: int) -> Callable[[bytes], int | None]:
    """The length when the byte at this place counts the ones between it and the CRC."""

    def length(adu: bytes) -> int | None:
        return at + 1 + adu[at] + 2 if len(adu) > at else None

    return length


def _identification_request(adu: bytes) -> int | None:
    return 7 if len(adu) > 2 and adu[2] == MEI_TYPE else None


def _identification_answer(adu: bytes) -> int | None:
    """Walks the objects: each is number, size, bytes."""
    if len(adu) < 8 or adu[2] != MEI_TYPE:
        return None
    at = 8
    for _ in range(adu[7]):
        if len(adu) < at + 2:
            return None
        at += 2 + adu[at + 1]
    return at + 2


_REQUEST: Final[dict[int, int | Callable[[bytes], int | None]]] = {
    P.READ_COILS: 8,
    P.READ_DISCRETE_INPUTS: 8,
    P.READ_HOLDING_REGISTERS: 8,
    P.READ_INPUT_REGISTERS: 8,
    P.WRITE_COIL: 8,
    P.WRITE_REGISTER: 8,
    P.WRITE_COILS: _counted(6),
    P.WRITE_REGISTERS: _counted(6),
    P.REPORT_SERVER: 4,
    P.MASK_WRITE: 10,
    P.READ_WRITE: _counted(10),
    P.ENCAPSULATED: _identification_request,
}

_WRITES: Final = frozenset((P.WRITE_COIL, P.WRITE_REGISTER, P.WRITE_COILS, P.WRITE_REGISTERS, P.MASK_WRITE))

_ANSWER: Final[dict[int, int | Callable[[bytes], int | None]]] = {
    P.READ_COILS: _counted(2),
    P.READ_DISCRETE_INPUTS: _counted(2),
    P.READ_HOLDING_REGISTERS: _counted(2),
    P.READ_INPUT_REGISTERS: _counted(2),
    P.WRITE_COIL: 8,
    P.WRITE_REGISTER: 8,
    P.WRITE_COILS: 8,
    P.WRITE_REGISTERS: 8,
    P.REPORT_SERVER: _counted(2),
    P.MASK_WRITE: 10,
    P.READ_WRITE: _counted(2),
    P.ENCAPSULATED: _identification_answer,
}
