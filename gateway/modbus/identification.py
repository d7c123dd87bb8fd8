"""Read device identification, FC43 with MEI type 14 (V1.1b3 section 6.21).

Basic objects 0..2, regular 3..0x7F, extended 0x80..0xFF; codes 1, 2, 3 stream a category from an object on, 4 asks for
one. A category beyond what the device has is answered with what it has; a stream from an unknown object starts again
at 0.
"""

from collections.abc import Iterable, Mapping
from typing import Final

from gateway.modbus.errors import RequestError, RequestFault
from gateway.modbus.pdu import ENCAPSULATED, wrong_length

MEI_TYPE: Final = 14
BASIC: Final = 1
REGULAR: Final = 2
EXTENDED: Final = 3
INDIVIDUAL: Final = 4

_LAST_OBJECT: Final = {BASIC: 0x02, REGULAR: 0x7F, EXTENDED: 0xFF}
_ROOM: Final = 253 - 7  # a PDU less function, MEI type, code, conformity, more follows, next object, number of objects


def identification_answer(pdu: bytes, identity: Mapping[int, bytes]) -> bytes:
    """Return the device's answer. Raises RequestError: 01 other MEI types, 03 shape or code, 02 an object that is not there."""
    if len(pdu) > 1 and pdu[1] != MEI_TYPE:
        raise RequestError(
            RequestFault.FUNCTION, f"function 43 with MEI type {pdu[1]}, served is {MEI_TYPE}", ENCAPSULATED
        )
    if len(pdu) != 4:
        raise wrong_length(pdu, "read device identification has 4")
    code, first = pdu[2], pdu[3]
    if code == INDIVIDUAL:
        return _individual(first, identity)
    if code not in _LAST_OBJECT:
        raise RequestError(RequestFault.VALUE, f"read device identification code {code}, allowed 1 .. 4", code)
    numbers = sorted(number for number in identity if number <= _LAST_OBJECT[code])
    return _stream(code, numbers[numbers.index(first) if first in numbers else 0 :], identity)


def _individual(number: int, identity: Mapping[int, bytes]) -> bytes:
    if number not in identity:
        raise RequestError(RequestFault.OBJECT, f"no identification object {number}", number)
    value = identity[number][: _ROOM - 2]
    return _head(INDIVIDUAL, identity) + bytes((0, 0, 1, number, len(value))) + value


def _stream(code: int, numbers: list[int], identity: Mapping[int, bytes]) -> bytes:
    """As many whole objects as fit, and where to go on."""
    body = b""
    for sent, number in enumerate(numbers):
        value = identity[number][: _ROOM - 2]
        if len(body) + 2 + len(value) > _ROOM:
            return _head(code, identity) + bytes((0xFF, number, sent)) + body
        body += bytes((number, len(value))) + value
    return _head(code, identity) + bytes((0, 0, len(numbers))) + body


def _head(code: int, identity: Iterable[int]) -> bytes:
    highest = max(identity, default=0)
    conformity = next(level for level, last in _LAST_OBJECT.items() if highest <= last)
    return bytes((ENCAPSULATED, MEI_TYPE, code, 0x80 | conformity))
