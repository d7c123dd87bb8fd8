"""From one request PDU to one answer PDU: which function codes are served, and in which order things are checked.

Order (V1.1b3, section 7): function 01, shape and quantity 03, address 02, value 03. Addresses and values are the bank's to
judge, in that order; FC05 with a value other than 0x0000/0xFF00 is 03 only when the coil exists. FC23 checks both
halves before it writes: the read half here by check_registers_readable, the write half by the bank, whose writes are
all or nothing. What is refused here, before the bank has looked at it, the bank is told (note_refusal): it keeps the reasons.
Only ModbusError becomes an answer; anything else a bank raises is an internal error and reaches the caller.
"""

from collections.abc import Callable, Mapping, Sequence
from struct import Struct
from typing import Final, Protocol

from gateway.modbus import pdu as P  # noqa: N812  the names of function codes are constants
from gateway.modbus.diagnostics import ServerId, loopback_answer, report_answer
from gateway.modbus.errors import ModbusError, RequestError, RequestFault
from gateway.modbus.identification import identification_answer
from gateway.modbus.peer import NOBODY, Peer

_ONE_WORD: Final = Struct(">H")


class DataBank(Protocol):
    """What a server needs from behind it. Methods raise ModbusError to refuse; a refused write changes nothing."""

    known_answers: dict[bytes, bytes]
    """Of reads that were answered: request -> answer, both without their transaction. The bank empties it when a register may
    read otherwise than before."""

    @property
    def identity(self) -> Mapping[int, bytes]:
        """Objects of FC43/14: number to text."""

    @property
    def server_id(self) -> ServerId:
        """The identity that FC17 reports."""

    def read_registers(self, address: int, count: int, peer: Peer = NOBODY) -> bytes:
        """Return the registers as big-endian words. count is 1..125 already."""

    def read_bits(self, address: int, count: int, peer: Peer = NOBODY, *, is_write: bool = False) -> bytes:
        """Return bits, packed, first bit lowest, unused bits 0. count is 1..2000 already. is_write: of a request that would
        write them."""

    def check_registers_readable(self, address: int, count: int, peer: Peer = NOBODY) -> None:
        """Raise what read_registers would raise."""

    def write_registers(self, address: int, data: bytes, peer: Peer) -> None:
        """Write big-endian words, all or nothing."""

    def write_bits(self, address: int, values: Sequence[bool], peer: Peer) -> None:
        """Write all or nothing."""

    def mask_write(self, address: int, and_mask: int, or_mask: int, peer: Peer) -> None:
        """Write one word: (word & and_mask) | (or_mask & ~and_mask)."""

    def note_refusal(self, refusal: RequestError, peer: Peer) -> None:
        """Note a request that the protocol's own rules have refused. Must not raise."""


def answer(pdu: bytes, bank: DataBank, peer: Peer) -> bytes:
    """Execute one request and return its answer. An empty PDU, which no framing lets through, is function 0."""
    function = pdu[0] if pdu else 0
    try:
        return _HANDLERS.get(function, _not_served)(pdu, bank, peer)
    except RequestError as refusal:
        refusal.is_write = function in P.WRITES
        bank.note_refusal(refusal, peer)
        return P.exception_pdu(function, refusal.code)
    except ModbusError as error:
        return P.exception_pdu(function, error.code)


def refuse_unit(request: tuple[int, bytes], served: Sequence[int], bank: DataBank, peer: Peer) -> bytes:
    """Return the answer to a request (unit, PDU) for a unit that is not served here."""
    unit, pdu = request
    known = ", ".join(map(str, served))
    refusal = RequestError(RequestFault.UNIT, f"unit id {unit}, served here: {known}", unit, P.address_in(pdu))
    refusal.is_write = pdu[0] in P.WRITES
    bank.note_refusal(refusal, peer)
    return P.exception_pdu(pdu[0], refusal.code)


def refuse_echo(pdu: bytes, bank: DataBank, peer: Peer) -> bytes:
    """Return the answer to a write that may be the echo of the answer before it, and is not executed."""
    sentence = "a write like an answer just before it, as an adapter that hears itself gives one back: write it again"
    refusal = RequestError(RequestFault.ECHO, sentence, pdu[0], P.address_in(pdu))
    refusal.is_write = True
    bank.note_refusal(refusal, peer)
    return P.exception_pdu(pdu[0], refusal.code)


def _not_served(pdu: bytes, _bank: DataBank, _peer: Peer) -> bytes:
    function = pdu[0] if pdu else 0
    raise RequestError(RequestFault.FUNCTION, f"function {function} is not served", function)


def _read_bits(pdu: bytes, bank: DataBank, peer: Peer) -> bytes:
    data = bank.read_bits(*P.parse_read(pdu, P.MOST_BITS_READ), peer)
    return bytes((pdu[0], len(data))) + data


def _read_registers(pdu: bytes, bank: DataBank, peer: Peer) -> bytes:
    data = bank.read_registers(*P.parse_read(pdu, P.MOST_REGISTERS_READ), peer)
    return bytes((pdu[0], len(data))) + data


def _write_coil(pdu: bytes, bank: DataBank, peer: Peer) -> bytes:
    address, word = P.parse_write_one(pdu)
    if word not in (0x0000, 0xFF00):
        bank.read_bits(address, 1, peer, is_write=True)
        raise RequestError(RequestFault.VALUE, f"coil value 0x{word:04X}, allowed 0x0000 and 0xFF00", word, address)
    bank.write_bits(address, (word == 0xFF00,), peer)
    return pdu


def _write_register(pdu: bytes, bank: DataBank, peer: Peer) -> bytes:
    address, word = P.parse_write_one(pdu)
    bank.write_registers(address, _ONE_WORD.pack(word), peer)
    return pdu


def _write_coils(pdu: bytes, bank: DataBank, peer: Peer) -> bytes:
    address, values = P.parse_write_coils(pdu)
    bank.write_bits(address, values, peer)
    return pdu[:5]


def _write_registers(pdu: bytes, bank: DataBank, peer: Peer) -> bytes:
    address, data = P.parse_write_registers(pdu)
    bank.write_registers(address, data, peer)
    return pdu[:5]


def _mask_write(pdu: bytes, bank: DataBank, peer: Peer) -> bytes:
    address, and_mask, or_mask = P.parse_mask_write(pdu)
    bank.mask_write(address, and_mask, or_mask, peer)
    return pdu


def _read_write(pdu: bytes, bank: DataBank, peer: Peer) -> bytes:
    read_address, count, write_address, data = P.parse_read_write(pdu)
    bank.check_registers_readable(read_address, count, peer)
    bank.write_registers(write_address, data, peer)
    words = bank.read_registers(read_address, count, peer)
    return bytes((P.READ_WRITE, len(words))) + words


def _identification(pdu: bytes, bank: DataBank, _peer: Peer) -> bytes:
    return identification_answer(pdu, bank.identity)


def _diagnostics(pdu: bytes, _bank: DataBank, _peer: Peer) -> bytes:
    return loopback_answer(pdu)


def _report_server(pdu: bytes, bank: DataBank, _peer: Peer) -> bytes:
    return report_answer(pdu, bank.server_id)


_HANDLERS: Final[Mapping[int, Callable[[bytes, DataBank, Peer], bytes]]] = {
    P.READ_COILS: _read_bits,
    P.READ_DISCRETE_INPUTS: _read_bits,
    P.READ_HOLDING_REGISTERS: _read_registers,
    P.READ_INPUT_REGISTERS: _read_registers,
    P.WRITE_COIL: _write_coil,
    P.WRITE_REGISTER: _write_register,
    P.DIAGNOSTICS: _diagnostics,
    P.WRITE_COILS: _write_coils,
    P.WRITE_REGISTERS: _write_registers,
    P.REPORT_SERVER: _report_server,
    P.MASK_WRITE: _mask_write,
    P.READ_WRITE: _read_write,
    P.ENCAPSULATED: _identification,
}
