"""The registers as masters read them: one big-endian bytearray, and tables that answer for an address in one look-up.

A read is a slice, a publish is `pack_into`. Words inside a block that no register uses read 0.
"""

from array import array
from collections.abc import Iterable
from typing import Final

from gateway.registers.map.register_map import Block, Register, RegisterMap

ADDRESSES: Final = 0x10000


class RegisterImage:
    """`data[2 * address]` is the high byte of a word. room[address]: words from there to its block's end, 0 outside.
    is_behind: more has been accepted or published than is packed here: whoever reads has that done first."""

    def __init__(self, register_map: RegisterMap) -> None:
        last = max((block.last for block in register_map.blocks), default=-1)
        self.is_behind = False
        self.data = bytearray(2 * (last + 1))
        self.room = array("H", bytes(2 * ADDRESSES))
        self.writable = array("H", bytes(2 * ADDRESSES))  # words from there on that are not read-only, inside the block
        self.block_at: dict[int, Block] = {}
        self.register_at: dict[int, Register] = {}
        for block in register_map.blocks:
            self._add_block(block, register_map.registers_of(block.name))

    def _add_block(self, block: Block, registers: Iterable[Register]) -> None:
        for register in registers:
            for address in range(register.address, register.address + register.words):
                self.register_at[address] = register
            if register.constant is not None:
                self.put(register, register.constant)
        for address in range(block.last, block.first - 1, -1):
            self.block_at[address] = block
            self.room[address] = block.last - address + 1
            mapped = self.register_at.get(address)
            is_closed = mapped is not None and not mapped.is_writable
            self.writable[address] = 0 if is_closed else self.writable[address + 1] + 1 if address < block.last else 1

    def read(self, address: int, count: int) -> bytes:
        """Return words without any check."""
        return bytes(self.data[2 * address : 2 * (address + count)])

    def write(self, address: int, words: bytes) -> None:
        """Write words without any check."""
        self.data[2 * address : 2 * address + len(words)] = words

    def put(self, register: Register, value: float) -> None:
        """Write a value in the register's unit. ValueError when its type cannot carry it."""
        self.write(register.address, register.encode(value))

    def word(self, address: int) -> int:
        """Return the word at this address."""
        return self.data[2 * address] << 8 | self.data[2 * address + 1]

    def cuts_value(self, address: int, count: int) -> Register | None:
        """Return the register that a range of words would take a part of."""
        first, last = self.register_at.get(address), self.register_at.get(address + count - 1)
        if first is not None and first.address != address:
            return first
        return last if last is not None and last.address + last.words > address + count else None
