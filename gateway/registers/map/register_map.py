"""The Modbus map as data: blocks of registers, each with name, address, type, scale, unit, access, limits and text.

Built from profiles/registers/*.yaml by map_reader.read_map. Addresses are 0-based. A name is unique
within its block; a bare NAME means the int16 register, `NAME@BLOCK` any other.
"""

from array import array
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cached_property, lru_cache
from json import dumps
from typing import Any, Final
from zlib import crc32

from gateway.registers.values import WordOrder, pack_number, unpack_number, words_of

ADDRESSES: Final = 0x10000
PLAIN_BLOCKS = ("command", "status")
"""Blocks whose registers a bare NAME means."""

_DECIMALS = {"N": 2, "N/s": 1, "deg": 1, "V": 3, "s": 4}


@lru_cache(maxsize=16)
def _nearest(word: str, names: tuple[str, ...]) -> list[str]:
    """Milliseconds of difflib, kept for who asks for the same wrong name again and again."""
    return get_close_matches(word, names, 1, 0.6)


class UnknownRegister(LookupError):  # noqa: N818  reads as what it is
    """No register of that name; the message proposes one."""


@dataclass(frozen=True, slots=True)
class Register:
    """One value of the map. address: 0-based, of the first word; minimum, maximum: in `unit`, None where the type decides.

    scale: unit per count (0.01 N); values: names of an enumeration's numbers; bits: names of a word's bits;
    constant: what a proof register always reads.
    """

    name: str
    block: str
    address: int
    words: int
    type: str
    scale: float
    unit: str
    access: str  # "R" or "RW"
    minimum: float | None
    maximum: float | None
    text: str
    values: Mapping[int, str] = field(default_factory=dict)
    bits: Mapping[int, str] = field(default_factory=dict)
    word_order: WordOrder = WordOrder.ABCD
    constant: float | None = None

    @property
    def is_writable(self) -> bool:
        """Decide whether a master may write this register."""
        return self.access == "RW"

    @property
    def counts_per_unit(self) -> int:
        """1 / scale, a whole number: dividing by it rounds correctly where multiplying by 0.01 does not."""
        return round(1.0 / self.scale)

    def check_meant(self, value: float) -> None:
        """Check a value that a person or a program gives in place of words. ValueError where a bit, a choice or a count is
        asked for by a fraction: rounded, 0.7 in control_word would enable and 1.5 reset."""
        is_count = self.type != "float32" and self.scale == 1.0 and not self.unit
        if (is_count or self.bits or self.values) and not float(value).is_integer():
            raise ValueError(f"{self.name} = {value:g} is not a whole number")

    @property
    def decimals(self) -> int:
        """Digits after the point that people want to see of this quantity, the same in all blocks."""
        return _DECIMALS.get(self.unit, 0)

    def decode(self, data: bytes) -> float | int:
        """Return the value of these words in `unit`; NaN when unavailable. ValueError on a wrong length."""
        number = unpack_number(self.type, self.word_order, data)
        return number if self.scale == 1.0 else number / self.counts_per_unit

    def encode(self, value: float) -> bytes:
        """Return the words of a value in `unit`, rounded to the register's resolution. ValueError when the type cannot
        carry it."""
        return pack_number(self.type, self.word_order, value if self.scale == 1.0 else value * self.counts_per_unit)


@dataclass(frozen=True, slots=True)
class Block:
    """A contiguous range of addresses, first..last. repeats: {block: base address} shown again here as float32."""

    name: str
    first: int
    last: int
    text: str = ""
    word_order: WordOrder = WordOrder.ABCD
    repeats: Mapping[str, int] = field(default_factory=dict)

    @property
    def words(self) -> int:
        """Number of registers, both ends included."""
        return self.last - self.first + 1


def span_of(registers: Sequence[Register]) -> tuple[int, int]:
    """Return (first address, words) from the first of these registers to the last."""
    first, last = registers[0], registers[-1]
    return first.address, last.address + last.words - first.address


def holding_number(address: int) -> str:
    """Return the number by which people, and MB_DATA_ADDR of an S7, call a holding register: 40001 is address 0. Five digits up
    to 49999, six from 410000 on."""
    return f"4{address + 1:04d}"


def repeat_as_float(register: Register, source: Block, block: Block) -> Register | None:
    """Return the same quantity as float32 in a float block: word k of the source at base + 2k. None if float32 cannot
    carry it."""
    if register.type in ("int32", "uint32"):
        return None
    return Register(
        name=register.name,
        block=block.name,
        address=block.repeats[source.name] + 2 * (register.address - source.first),
        words=words_of("float32"),
        type="float32",
        scale=1.0,
        unit=register.unit,
        access=register.access,
        minimum=register.minimum,
        maximum=register.maximum,
        text=register.text,
        values=register.values,
        bits=register.bits,
        word_order=block.word_order,
    )


def _zero_words() -> "array[int]":
    return array("H", bytes(2 * ADDRESSES))


@dataclass(frozen=True, slots=True)
class AddressTables:
    """What there is at each address, made once for a map: a bank is made at each start, and by the thousand in tests.
    room[address]: words from there to its block's end, 0 outside; writable[address]: words from there on that are not
    read-only, inside the block. Nobody changes them."""

    room: "array[int]" = field(default_factory=_zero_words)
    writable: "array[int]" = field(default_factory=_zero_words)
    block_at: dict[int, Block] = field(default_factory=dict)
    register_at: dict[int, Register] = field(default_factory=dict)


def address_tables(blocks: Sequence[Block], registers: Sequence[Register]) -> AddressTables:
    """Return the tables of a map that has these blocks and registers."""
    tables = AddressTables()
    for register in registers:
        for address in range(register.address, register.address + register.words):
            tables.register_at[address] = register
    for block in blocks:
        _add_block(tables, block)
    return tables


def _add_block(tables: AddressTables, block: Block) -> None:
    room, writable = tables.room, tables.writable
    for address in range(block.last, block.first - 1, -1):
        tables.block_at[address] = block
        room[address] = block.last - address + 1
        mapped = tables.register_at.get(address)
        is_closed = mapped is not None and not mapped.is_writable
        writable[address] = 0 if is_closed else writable[address + 1] + 1 if address < block.last else 1


@dataclass(frozen=True)
class RegisterMap:
    """One version of the map. Numbers are frozen within a version. file: where it was read from."""

    name: str
    version: int
    blocks: tuple[Block, ...]
    registers: tuple[Register, ...]
    text: str = ""
    file: str = ""

    def block(self, name: str) -> Block:
        """Return the block of this name. Raises LookupError where there is none."""
        for block in self.blocks:
            if block.name == name:
                return block
        raise LookupError(f"map {self.name} has no block {name}")

    def name_float_block(self, order: str) -> str:
        """Return `block 300`: of commands as float32 in this word order; `no float block` where there is none."""
        first = next((b.first for b in self.blocks if "command" in b.repeats and b.word_order == order), None)
        return "no float block" if first is None else f"block {first}"

    def registers_of(self, block: str) -> tuple[Register, ...]:
        """Return the registers of one block, by address."""
        return self._by_block.get(block, ())

    def find(self, name: str) -> Register:
        """Return the register of `NAME` or `NAME@BLOCK`. UnknownRegister, with "did you mean", for anything else."""
        if (register := self._by_name.get(name)) is not None:
            return register
        bare = name.partition("@")[0]
        if matches := [register for register in self.registers if register.name == bare]:
            choices = " or ".join(f"{bare}@{register.block}" for register in matches)
            raise UnknownRegister(f"{name} is not a register; did you mean {choices}?")
        raise UnknownRegister(f"{name} is not a register{self._suggest_register(name)}")

    def _suggest_register(self, name: str) -> str:
        if name.isdecimal() and (register := self._at_number(int(name))):
            what = "address" if register.address == int(name) else "number"
            return f" by name: {name} is the {what} of {register.name}, so use {register.name}"
        plain = [register.name for register in self.registers if register.block in PLAIN_BLOCKS]
        near = [one for one in plain if name.lower() in one.split("_")] or _nearest(name.lower(), self._names)
        return f"; did you mean {' or '.join(near)}?" if near else "; force-gateway registers lists them"

    def _at_number(self, number: int) -> Register | None:
        """Return the register of an address, or of the name that PLCs give it: 40103, 30103."""
        base = next((first for first in (40001, 30001) if first <= number < first + 9999), 0)
        return next((one for one in self.registers if one.address <= number - base < one.address + one.words), None)

    @cached_property
    def _names(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys((*self._by_name, *(register.name for register in self.registers))))

    @cached_property
    def _by_name(self) -> dict[str, Register]:
        counts = Counter(register.name for register in self.registers)
        once = {register.name: register for register in self.registers if counts[register.name] == 1}
        plain = {register.name: register for register in self.registers if register.block in PLAIN_BLOCKS}
        names = {f"{register.name}@{register.block}": register for register in self.registers}
        return once | plain | names

    @cached_property
    def _by_block(self) -> dict[str, tuple[Register, ...]]:
        found: dict[str, list[Register]] = {}
        for register in self.registers:
            found.setdefault(register.block, []).append(register)
        return {block: tuple(registers) for block, registers in found.items()}

    @cached_property
    def by_address(self) -> AddressTables:
        """Return what there is at each address."""
        return address_tables(self.blocks, self.registers)

    @cached_property
    def map_hash(self) -> int:
        """Return the CRC-32 of the places and numbers that a master relies on. Texts may be improved without a change of it,
        and names of values and bits be added, such as a new fault's: a client that knows fewer of them commands as ever, and
        one that refuses another map would stand still behind each update."""
        content = [self.name, self.version, *([b.name, b.first, b.last] for b in self.blocks)]
        content += [_hashed_fields(register) for register in self.registers]
        return crc32(dumps(content, sort_keys=True, separators=(",", ":")).encode())


def _hashed_fields(register: Register) -> list[Any]:
    """Return what a master relies on of one register: everything but its text and the names of what it holds."""
    limits = [register.minimum, register.maximum, register.constant]
    place = [register.name, register.block, register.address, register.words, register.type, str(register.word_order)]
    return [*place, register.scale, register.unit, register.access, *limits]
