"""Requests as bytes, both ends of the wire side by side: NAME_request() is the host's, parse_NAME() the device's.
Hosts here are those who write as any master does: the page (web), MQTT (telemetry) and `upload` (cli/master).

Plain functions and tuples on purpose: a frozen dataclass for each request costs more than the answer itself.
parse_* check shape and quantity and raise RequestError(03): a truncated PDU, surplus bytes and a byte count that
disagrees are all 03, and they are checked before any address is looked at. *_request raise ValueError: that is the
caller's mistake, never the wire's.
Source of layouts and limits: MODBUS Application Protocol V1.1b3, section 6.
"""

from struct import Struct
from typing import Final

from gateway.modbus.bits import unpack_bits
from gateway.modbus.errors import RequestError, RequestFault

READ_COILS: Final = 1
READ_DISCRETE_INPUTS: Final = 2
READ_HOLDING_REGISTERS: Final = 3
READ_INPUT_REGISTERS: Final = 4
WRITE_COIL: Final = 5
WRITE_REGISTER: Final = 6
DIAGNOSTICS: Final = 8
WRITE_COILS: Final = 15
WRITE_REGISTERS: Final = 16
REPORT_SERVER: Final = 17
MASK_WRITE: Final = 22
READ_WRITE: Final = 23
ENCAPSULATED: Final = 43

WRITES: Final = frozenset((WRITE_COIL, WRITE_REGISTER, WRITE_COILS, WRITE_REGISTERS, MASK_WRITE, READ_WRITE))
"""Functions of requests that want to write."""

MOST_BITS_READ: Final = 2000
MOST_BITS_WRITTEN: Final = 1968
MOST_REGISTERS_READ: Final = 125
MOST_REGISTERS_WRITTEN: Final = 123
MOST_REGISTERS_READ_WRITE: Final = 121  # the written half of FC23

_ADDRESSED: Final = frozenset((1, 2, 3, 4, 5, 6, 15, 16, 22, 23))  # the first two bytes are an address
_TWO: Final = Struct(">BHH")  # function, address, quantity or value
_MANY: Final = Struct(">BHHB")  # function, address, quantity, bytes that follow
_MASK: Final = Struct(">BHHH")  # function, address, and-mask, or-mask
_READ_WRITE: Final = Struct(">BHHHHB")  # function, read address, quantity, write address, quantity, bytes that follow


def read_request(function: int, address: int, count: int) -> bytes:
    """Return an FC01 to FC04 request. ValueError for a quantity that no device may accept."""
    most = MOST_BITS_READ if function <= READ_DISCRETE_INPUTS else MOST_REGISTERS_READ
    _own_quantity(count, most)
    return _TWO.pack(function, address, count)


def parse_read(pdu: bytes, most: int) -> tuple[int, int]:
    """Return address, count of FC01 to FC04."""
    if len(pdu) != _TWO.size:
        raise wrong_length(pdu, f"a read has {_TWO.size}")
    _function, address, count = _TWO.unpack(pdu)
    _quantity(count, most, address)
    return address, count


def write_register_request(address: int, word: int) -> bytes:
    """Return an FC06 request. word: 0..65535."""
    return _TWO.pack(WRITE_REGISTER, address, word)


def parse_write_one(pdu: bytes) -> tuple[int, int]:
    """Return address, word of FC05 and FC06. The word is the server's to judge: its address comes first."""
    if len(pdu) != _TWO.size:
        raise wrong_length(pdu, f"a single write has {_TWO.size}")
    _function, address, word = _TWO.unpack(pdu)
    return address, word


def parse_write_coils(pdu: bytes) -> tuple[int, list[bool]]:
    """Return address, values of FC15; padding bits are ignored."""
    address, count, data = _parse_many(pdu)
    _quantity(count, MOST_BITS_WRITTEN, address)
    _byte_count(len(data), (count + 7) // 8, address)
    return address, unpack_bits(data, count)


def write_registers_request(address: int, data: bytes) -> bytes:
    """Return an FC16 request. data: big-endian words."""
    _own_quantity(len(data) // 2, MOST_REGISTERS_WRITTEN, odd=len(data) % 2)
    return _MANY.pack(WRITE_REGISTERS, address, len(data) // 2, len(data)) + data


def parse_write_registers(pdu: bytes) -> tuple[int, bytes]:
    """Return address, big-endian words of FC16."""
    address, count, data = _parse_many(pdu)
    _quantity(count, MOST_REGISTERS_WRITTEN, address)
    _byte_count(len(data), 2 * count, address)
    return address, data


def mask_write_request(address: int, and_mask: int, or_mask: int) -> bytes:
    """Return an FC22 request: word = (word & and_mask) | (or_mask & ~and_mask)."""
    return _MASK.pack(MASK_WRITE, address, and_mask, or_mask)


def parse_mask_write(pdu: bytes) -> tuple[int, int, int]:
    """Return address, and_mask, or_mask of FC22."""
    if len(pdu) != _MASK.size:
        raise wrong_length(pdu, f"a mask write has {_MASK.size}")
    _function, address, and_mask, or_mask = _MASK.unpack(pdu)
    return address, and_mask, or_mask


def read_write_request(read_address: int, count: int, write_address: int, data: bytes) -> bytes:
    """Return an FC23 request: data (big-endian words) is written before the count words are read."""
    _own_quantity(count, MOST_REGISTERS_READ)
    _own_quantity(len(data) // 2, MOST_REGISTERS_READ_WRITE, odd=len(data) % 2)
    return _READ_WRITE.pack(READ_WRITE, read_address, count, write_address, len(data) // 2, len(data)) + data


def parse_read_write(pdu: bytes) -> tuple[int, int, int, bytes]:
    """Return read address, count, write address, big-endian words of FC23."""
    if len(pdu) < _READ_WRITE.size:
        raise wrong_length(pdu, f"a read/write has at least {_READ_WRITE.size}")
    _function, read_address, count, write_address, written, size = _READ_WRITE.unpack_from(pdu)
    data = pdu[_READ_WRITE.size :]
    _quantity(count, MOST_REGISTERS_READ, read_address)
    _quantity(written, MOST_REGISTERS_READ_WRITE, write_address)
    _byte_count(size, 2 * written, write_address)
    _byte_count(len(data), size, write_address)
    return read_address, count, write_address, data


def exception_pdu(function: int, code: int) -> bytes:
    """Return the answer that refuses: the function with its top bit set, and the code."""
    return bytes((function | 0x80, code))


def is_exception(pdu: bytes) -> bool:
    """Return whether an answer refuses its request (section 7: function code + 0x80)."""
    return pdu[0] & 0x80 != 0


def _parse_many(pdu: bytes) -> tuple[int, int, bytes]:
    """address, quantity, data of FC15 and FC16, when the byte count is that of the data."""
    if len(pdu) < _MANY.size:
        raise wrong_length(pdu, f"a multiple write has at least {_MANY.size}")
    _function, address, count, size = _MANY.unpack_from(pdu)
    data = pdu[_MANY.size :]
    _byte_count(len(data), size, address)
    return address, count, data


def address_in(pdu: bytes) -> int | None:
    """Return the (first) address of a request, where it has one."""
    return int.from_bytes(pdu[1:3], "big") if len(pdu) > 2 and pdu[0] in _ADDRESSED else None


def wrong_length(pdu: bytes, expected: str) -> RequestError:
    """Return the refusal of a request that is cut off or has surplus bytes. expected: `a read has 5`."""
    sentence = f"function {pdu[0]} with {len(pdu)} bytes, {expected}"
    return RequestError(RequestFault.QUANTITY, sentence, len(pdu), address_in(pdu))


def _quantity(count: int, most: int, address: int) -> None:
    if not 1 <= count <= most:
        raise RequestError(RequestFault.QUANTITY, f"quantity {count}, allowed 1 .. {most}", count, address)


def _byte_count(count: int, expected: int, address: int) -> None:
    if count != expected:
        raise RequestError(RequestFault.QUANTITY, f"byte count {count}, expected {expected}", count, address)


def _own_quantity(count: int, most: int, odd: int = 0) -> None:
    if odd or not 1 <= count <= most:
        raise ValueError(f"{count} values in one request, allowed 1 to {most} whole ones")
