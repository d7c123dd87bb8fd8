"""From the content of a register map's YAML file to a RegisterMap, strictly: every fault is told, with its place.

The document is plain data (mappings, lists, text, numbers), so that no YAML library is needed here:

    name, version, text
    blocks: {NAME: {first, last, text, and either
        registers: [{name, address, type, scale, unit, access, min, max, text, values, bits, constant, word_order, count}]
        or repeats: {BLOCK: base address}, word_order}}

`count: 16` makes NAME_0 .. NAME_15. values and bits are {number: name}, or the name of one of the program's enumerations
(value_names.py). Missing access is R, missing scale 1, missing limits are those of the type.
"""

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Any, Final

from gateway.registers.map.document_reader import DocumentReader, Flaw, Place, suggest
from gateway.registers.map.register_map import Block, Register, RegisterMap, repeat_as_float
from gateway.registers.map.value_names import BIT_NAMES, VALUE_NAMES
from gateway.registers.values import RAW_LIMITS, TYPES, words_of

_MAP_KEYS: Final = ("name", "version", "text", "blocks")
_BLOCK_KEYS: Final = ("first", "last", "text", "word_order", "repeats", "registers")
_REGISTER_KEYS: Final = (
    "name", "address", "type", "scale", "unit", "access", "min", "max", "text", "values", "bits", "constant", "word_order",
    "count",
)  # fmt: skip


class MapError(ValueError):
    """The document is no register map. faults: each with its place in the document."""

    def __init__(self, faults: list[Flaw]) -> None:
        super().__init__("; ".join(f"{'.'.join(map(str, one.place)) or 'map'}: {one.sentence}" for one in faults))
        self.faults = tuple(faults)


def read_map(document: Mapping[str, Any]) -> RegisterMap:
    """Read and check a map. Raises MapError with every fault found."""
    reader = _MapReader()
    register_map = reader.map(document)
    if reader.faults:
        raise MapError(reader.faults)
    return register_map


class _MapReader(DocumentReader):
    """Knows what a map, a block and a register consist of."""

    def map(self, document: Mapping[str, Any]) -> RegisterMap:
        """Return the whole map, checked."""
        self.keys((), document, _MAP_KEYS)
        given = self.by_name(("blocks",), document.get("blocks"))
        blocks = tuple(self.block(name, self.group(("blocks", name), content)) for name, content in given.items())
        self.blocks_apart(blocks)
        own = [register for block in blocks for register in self.registers(block, self.group((), given[block.name]))]
        everything = [*own, *self.repetitions(blocks, own)]
        self.registers_apart(everything)
        return RegisterMap(
            name=self.text((), document, "name"),
            version=self.whole((), document, "version", 1, 0xFFFF),
            blocks=tuple(sorted(blocks, key=lambda block: block.first)),
            registers=tuple(sorted(everything, key=lambda register: register.address)),
            text=self.text((), document, "text", ""),
        )

    def block(self, name: str, content: Mapping[str, Any]) -> Block:
        """Return one block without its registers."""
        place: Place = ("blocks", name)
        self.keys(place, content, _BLOCK_KEYS)
        self.is_name(place, name)
        if ("registers" in content) == ("repeats" in content):
            self.fault(place, "has either registers or repeats")
        first = self.whole(place, content, "first", 0, 0xFFFF)
        return Block(
            name=name,
            first=first,
            last=self.whole(place, content, "last", first, 0xFFFF),
            text=self.text(place, content, "text", ""),
            word_order=self.order(place, content),
            repeats=dict(self.by_name((*place, "repeats"), content.get("repeats", {}))),
        )

    def registers(self, block: Block, content: Mapping[str, Any]) -> Iterator[Register]:
        """Yield the registers of one block."""
        given = content.get("registers", [])
        if not isinstance(given, list):
            self.fault(("blocks", block.name, "registers"), "is not a list")
            return
        for index, entry in enumerate(given):
            place: Place = ("blocks", block.name, "registers", index)
            yield from self.register(place, block, self.group(place, entry))

    def register(self, place: Place, block: Block, entry: Mapping[str, Any]) -> Iterator[Register]:
        """Yield one register, or `count` of them."""
        self.keys(place, entry, _REGISTER_KEYS)
        name, kind = self.text(place, entry, "name"), self.text(place, entry, "type")
        self.is_name((*place, "name"), name)
        if kind not in TYPES:
            self.fault((*place, "type"), f"{kind} is not one of {', '.join(TYPES)}{suggest(kind, TYPES)}")
            return
        address = self.whole(place, entry, "address", 0, 0xFFFF)
        count = self.whole(place, entry, "count", 1, 256) if "count" in entry else 1
        for k in range(count):
            label = f"{name}_{k}" if "count" in entry else name
            yield self.one(place, block, entry, (label, kind, address + k * words_of(kind)))

    def one(self, place: Place, block: Block, entry: Mapping[str, Any], what: tuple[str, str, int]) -> Register:
        """Return one register. what: its name, type and address."""
        name, kind, address = what
        scale = self.scale(place, entry, kind)
        low, high = self.limits(place, entry, kind, scale)
        if not block.first <= address <= address + words_of(kind) - 1 <= block.last:
            self.fault(place, f"{name} at {address} is outside block {block.name}, {block.first} .. {block.last}")
        return Register(
            name=name,
            block=block.name,
            address=address,
            words=words_of(kind),
            type=kind,
            scale=scale,
            unit=self.text(place, entry, "unit", ""),
            access=self.access(place, entry),
            minimum=low,
            maximum=high,
            text=self.text(place, entry, "text"),
            values=self.read_numbered((*place, "values"), entry.get("values", {}), 0xFFFF, VALUE_NAMES),
            bits=self.read_numbered((*place, "bits"), entry.get("bits", {}), 15, BIT_NAMES),
            word_order=self.order(place, entry),
            constant=self.number(place, entry, "constant") if "constant" in entry else None,
        )

    def repetitions(self, blocks: tuple[Block, ...], own: list[Register]) -> Iterator[Register]:
        """Yield the registers that a block shows again as float32."""
        by_name = {block.name: block for block in blocks}
        for block in blocks:
            for source_name, base in block.repeats.items():
                place: Place = ("blocks", block.name, "repeats", source_name)
                source = by_name.get(source_name)
                if source is None or source.repeats:
                    self.fault(place, f"{source_name} is not a block with registers{suggest(source_name, by_name)}")
                elif not isinstance(base, int) or base < block.first or base + 2 * source.words - 1 > block.last:
                    self.fault(place, f"{base} .. does not fit in {block.name}, {block.first} .. {block.last}")
                else:
                    copies = (
                        repeat_as_float(register, source, block) for register in own if register.block == source_name
                    )
                    yield from (register for register in copies if register is not None)

    def blocks_apart(self, blocks: tuple[Block, ...]) -> None:
        """Check that no two blocks overlap."""
        ordered = sorted(blocks, key=lambda block: block.first)
        for left, right in pairwise(ordered):
            if right.first <= left.last:
                self.fault(
                    ("blocks", right.name),
                    f"starts at {right.first} inside block {left.name}, which ends at {left.last}",
                )

    def registers_apart(self, registers: list[Register]) -> None:
        """Check that no two registers of a block share a name, and that none overlap."""
        names: set[tuple[str, str]] = set()
        owner_of: dict[int, Register] = {}
        for register in registers:
            place: Place = ("blocks", register.block)
            if (register.name, register.block) in names:
                self.fault(place, f"{register.name} is there twice")
            names.add((register.name, register.block))
            for address in range(register.address, register.address + register.words):
                other = owner_of.setdefault(address, register)
                if other is not register:
                    self.fault(place, f"{register.name} overlaps {other.name} at {address}")

    def scale(self, place: Place, entry: Mapping[str, Any], kind: str) -> float:
        """Return the scale of an entry, 1 where none is given."""
        scale = self.number(place, entry, "scale") if "scale" in entry else 1.0
        if scale not in (1, 0.1, 0.01, 0.001) or (scale != 1 and kind not in RAW_LIMITS):
            self.fault((*place, "scale"), f"{scale} is not 1, 0.1, 0.01 or 0.001 (float32: 1)")
            return 1.0
        return float(scale)

    def limits(
        self, place: Place, entry: Mapping[str, Any], kind: str, scale: float
    ) -> tuple[float | None, float | None]:
        """Return the lowest and highest allowed value in the register's unit; None where the type has no bound."""
        low, high = RAW_LIMITS.get(kind, (None, None))
        minimum = self.number(place, entry, "min") if "min" in entry else _scale_bound(low, scale)
        maximum = self.number(place, entry, "max") if "max" in entry else _scale_bound(high, scale)
        if minimum is not None and maximum is not None and minimum > maximum:
            self.fault(place, f"min {minimum:g} is above max {maximum:g}")
        for key, bound in (("min", minimum), ("max", maximum)):
            if bound is not None and low is not None and high is not None and not low <= round(bound / scale) <= high:
                self.fault((*place, key), f"{bound:g} does not fit in {kind} with scale {scale:g}")
        return minimum, maximum

    def access(self, place: Place, entry: Mapping[str, Any]) -> str:
        """Return R or RW."""
        access = self.text(place, entry, "access", "R")
        if access not in ("R", "RW"):
            self.fault((*place, "access"), f"{access} is not R or RW")
        return access


def _scale_bound(bound: int | None, scale: float) -> float | None:
    return None if bound is None else bound / round(1.0 / scale) if scale != 1.0 else bound
