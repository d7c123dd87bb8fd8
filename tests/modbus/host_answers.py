"""The host's view of an answer: does it belong to the request, and what does it carry; and how a host asks what the gateway
never does.

No transaction logic here: a client compares transaction ids itself.
"""

from collections.abc import Iterator, Sequence

from gateway.modbus.bits import pack_bits, unpack_bits
from gateway.modbus.diagnostics import RETURN_QUERY_DATA
from gateway.modbus.errors import ModbusError
from gateway.modbus.identification import MEI_TYPE
from gateway.modbus.pdu import (
    DIAGNOSTICS,
    ENCAPSULATED,
    MASK_WRITE,
    READ_DISCRETE_INPUTS,
    READ_WRITE,
    REPORT_SERVER,
    WRITE_COIL,
    WRITE_COILS,
    WRITE_REGISTER,
)

_ECHOED_WHOLE = (WRITE_COIL, WRITE_REGISTER, DIAGNOSTICS, MASK_WRITE)


class AnswerMismatch(Exception):  # noqa: N818  no error of ours: the wire does this
    """The bytes are no answer to this request: an earlier one's, a damaged one, or another device's."""


def answer_data(request: bytes, answer: bytes) -> bytes:
    """Words or packed bits of a read, everything after the function for FC43, what FC17's
    byte count covers, nothing for a write or FC08.

    Raises ModbusError with the device's code when it refused, AnswerMismatch when the answer is not this request's.
    """
    function = request[0]
    if len(answer) == 2 and answer[0] == function | 0x80:
        raise ModbusError(answer[1])
    if not answer or answer[0] != function:
        raise AnswerMismatch(f"asked function {function}, answered {answer[:1].hex() or 'nothing'}")
    if function <= 4 or function == READ_WRITE:
        return _read_data(request, answer)
    if function == ENCAPSULATED:
        return answer[1:]
    if function == REPORT_SERVER:
        return _counted(answer)
    if answer != (request if function in _ECHOED_WHOLE else request[:5]):
        raise AnswerMismatch(f"the echo of function {function} differs from the request")
    return b""


def answer_bits(request: bytes, answer: bytes) -> list[bool]:
    """The values of an FC01 or FC02 answer. Raises as answer_data."""
    return unpack_bits(answer_data(request, answer), int.from_bytes(request[3:5], "big"))


def _read_data(request: bytes, answer: bytes) -> bytes:
    count = int.from_bytes(request[3:5], "big")
    size = (count + 7) // 8 if request[0] <= READ_DISCRETE_INPUTS else 2 * count
    if len(answer) != 2 + size or answer[1] != size:
        raise AnswerMismatch(f"asked for {size} bytes, answered {len(answer) - 2}")
    return answer[2:]


def _counted(answer: bytes) -> bytes:
    if len(answer) < 2 or len(answer) != 2 + answer[1]:
        raise AnswerMismatch(f"{len(answer) - 2} bytes where the answer counts {answer[1:2].hex() or 'none'}")
    return answer[2:]


def identification_request(code: int, first_object: int = 0) -> bytes:
    """Ask for a category from first_object on, or for one object with INDIVIDUAL."""
    return bytes((ENCAPSULATED, MEI_TYPE, code, first_object))


def parse_identification(data: bytes) -> tuple[dict[int, bytes], int | None]:
    """Return the host's reading of an answer after its function byte: objects, and which to ask for next (None: no more).

    Raises ValueError when the objects do not fill the answer exactly.
    """
    if len(data) < 6 or data[0] != MEI_TYPE:
        raise ValueError("not a device identification answer")
    objects = dict(_objects(data[6:]))
    if len(objects) != data[5]:
        raise ValueError(f"{data[5]} objects announced, {len(objects)} sent")
    return objects, data[4] if data[3] else None


def _objects(data: bytes) -> Iterator[tuple[int, bytes]]:
    at = 0
    while at < len(data):
        if at + 2 > len(data) or at + 2 + data[at + 1] > len(data):
            raise ValueError("an object is cut off")
        yield data[at], data[at + 2 : at + 2 + data[at + 1]]
        at += 2 + data[at + 1]


def loopback_request(data: bytes) -> bytes:
    """Ask for the same bytes back."""
    return bytes((DIAGNOSTICS, 0, RETURN_QUERY_DATA)) + data


def report_request() -> bytes:
    """Ask who the server is and whether it runs."""
    return bytes((REPORT_SERVER,))


def write_coil_request(address: int, value: bool) -> bytes:
    """Switch one coil."""
    return bytes((WRITE_COIL,)) + address.to_bytes(2) + (b"\xff\x00" if value else b"\x00\x00")


def write_coils_request(address: int, values: Sequence[bool]) -> bytes:
    """Switch several in a row."""
    data = pack_bits(values)
    return bytes((WRITE_COILS,)) + address.to_bytes(2) + len(values).to_bytes(2) + bytes((len(data),)) + data
