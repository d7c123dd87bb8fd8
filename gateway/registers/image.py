"""The registers as masters read them: one big-endian bytearray, and tables that answer for an address in one look-up.

A read is a slice, a publish is `pack_into`. Words inside a block that no register uses read 0.
"""

from gateway.registers.map.register_map import Register, RegisterMap


class RegisterImage:
    """`data[2 * address]` is the high byte of a word. room, writable, block_at and register_at: of the map (AddressTables).
    is_behind: more has been accepted or published than is packed here: whoever reads has that done first. known_answers: see
    DataBank."""

    def __init__(self, register_map: RegisterMap) -> None:
        last = max((block.last for block in register_map.blocks), default=-1)
        self.is_behind = False
        self.known_answers: dict[bytes, bytes] = {}
        self.data = bytearray(2 * (last + 1))
        tables = register_map.by_address
        self.room, self.writable = tables.room, tables.writable
        self.block_at, self.register_at = tables.block_at, tables.register_at
        for register in register_map.registers:
            if register.constant is not None:
                self.put(register, register.constant)

    def read(self, address: int, count: int) -> bytes:
        """Return words without any check."""
        return bytes(self.data[2 * address : 2 * (address + count)])

    def fall_behind(self) -> None:
        """Note that more has been accepted or published than is packed here."""
        self.is_behind = True
        self.known_answers.clear()

    def write(self, address: int, words: bytes) -> None:
        """Write words without any check."""
        self.known_answers.clear()
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
