"""A bank without meaning: words and bits from address 0 on, all readable and writable.

For tests and benches; the gateway's own bank, with names, owners and limits, is in gateway.registers.
"""

from collections.abc import Mapping, Sequence

from gateway.modbus.bits import pack_bits
from gateway.modbus.diagnostics import ServerId
from gateway.modbus.errors import ILLEGAL_ADDRESS, ModbusError, RequestError
from gateway.modbus.peer import NOBODY, Peer


class MemoryBank:
    """Implements DataBank. image: the words as on the wire, big-endian. bits: the coils, which discrete inputs mirror."""

    def __init__(self, words: int = 0, bits: int = 0, identity: Mapping[int, bytes] | None = None) -> None:
        self.image = bytearray(2 * words)
        self.bits = [False] * bits
        self.identity: Mapping[int, bytes] = identity or {}
        self.server_id = ServerId(0, True, b"")
        self.known_answers: dict[bytes, bytes] = {}

    def read_registers(self, address: int, count: int, _peer: Peer = NOBODY) -> bytes:
        self.check_registers_readable(address, count)
        return bytes(self.image[2 * address : 2 * (address + count)])

    def check_registers_readable(self, address: int, count: int, _peer: Peer = NOBODY) -> None:
        if 2 * (address + count) > len(self.image):
            raise ModbusError(ILLEGAL_ADDRESS)

    def write_registers(self, address: int, data: bytes, _peer: Peer) -> None:
        self.check_registers_readable(address, len(data) // 2)
        self.image[2 * address : 2 * address + len(data)] = data
        self.known_answers.clear()

    def mask_write(self, address: int, and_mask: int, or_mask: int, peer: Peer) -> None:
        word = int.from_bytes(self.read_registers(address, 1), "big")
        changed = (word & and_mask) | (or_mask & ~and_mask & 0xFFFF)
        self.write_registers(address, changed.to_bytes(2, "big"), peer)

    def read_bits(self, address: int, count: int, _peer: Peer = NOBODY, *, is_write: bool = False) -> bytes:
        self._check_bits(address, count)
        return pack_bits(self.bits[address : address + count])

    def write_bits(self, address: int, values: Sequence[bool], _peer: Peer) -> None:
        self._check_bits(address, len(values))
        self.bits[address : address + len(values)] = map(bool, values)

    def note_refusal(self, refusal: RequestError, peer: Peer) -> None:
        """Nobody asks a bank without meaning for its reasons."""

    def _check_bits(self, address: int, count: int) -> None:
        if address + count > len(self.bits):
            raise ModbusError(ILLEGAL_ADDRESS)
