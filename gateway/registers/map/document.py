"""The register table for people and tools: Markdown, CSV and JSON out of the one map.

Registers are shown by name (4xxxx/3xxxx, counting from 1) and by address (0-based, decimal and hex). FC03 and FC04 read
the same registers, so each has both names. The JSON form repeats names: (name, block) is unique.
"""

import csv
import io
import json
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Any, Final

from gateway import defaults
from gateway.modbus.pdu import MOST_REGISTERS_READ, MOST_REGISTERS_WRITTEN
from gateway.registers.map.register_map import PLAIN_BLOCKS, Block, Register, RegisterMap, holding_number, span_of
from gateway.registers.values import WordOrder

ACTING: Final = ("commit", "slot_select")
"""Registers that do something when they are written, and are written alone therefore."""
FORMATS: Final = ("markdown", "csv", "json")
MOST_BITS: Final = 16
MOST_USED: Final = (
    "control_word",
    "force_setpoint",
    "heartbeat",
    "status_word",
    "state",
    "force_measured",
    "output_voltage",
    "fault_code",
    "refusal_address",
    "refusal_reason",
)
_HEADINGS: Final = ("4xxxx/3xxxx", "address", "hex", "R/W", "name", "type", "scale", "unit", "range", "text")


def render_registers(register_map: RegisterMap, form: str) -> str:
    """Return the whole map, ending with a newline. ValueError for a form that is not in FORMATS."""
    if form == "markdown":
        return _markdown(register_map)
    if form == "csv":
        return _csv(register_map)
    if form == "json":
        return json.dumps([_entry(register) for register in register_map.registers], indent=1) + "\n"
    raise ValueError(f"{form} is not one of {', '.join(FORMATS)}")


def render_block(register_map: RegisterMap, name: str) -> str:
    """Return one block's table in Markdown, without heading. LookupError for an unknown block."""
    rows = [_HEADINGS, ("---",) * len(_HEADINGS)]
    rows += [_row(register) for register in register_map.registers_of(register_map.block(name).name)]
    return "".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |\n" for row in rows)


def render_most_used(register_map: RegisterMap) -> str:
    """Return the registers that a first program needs as a short table in Markdown. LookupError where the map lacks one."""
    rows = [("4xxxx", "address", "name", "unit of one count", "what"), ("---",) * 5]
    for name in MOST_USED:
        register = register_map.find(name)
        unit = f"{register.scale:g} {register.unit}" if register.unit else ""
        rows.append((holding_number(register.address), str(register.address), name, unit, _describe_briefly(register)))
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def _describe_briefly(register: Register) -> str:
    """Return what its bits or its few values are called, else the first sentence of its text."""
    names = register.bits or register.values
    if not names or len(names) > MOST_BITS:
        return register.text.partition(". ")[0].rstrip(".")
    kind = "bit " if register.bits else ""
    return ", ".join(f"{kind}{number} {name}" for number, name in names.items())


def _markdown(register_map: RegisterMap) -> str:
    about = f"# Register map {register_map.name}, version {register_map.version}\n\n{register_map.text}\n\n"
    about += (
        f"map_hash 0x{register_map.map_hash:08X}. FC03 and FC04 read the same registers; FC06, FC16, FC22 and FC23 write those "
        f"marked RW. Words without a name are reserved: they read 0 and accept only 0.{_coils(register_map)}\n"
    )
    return about + "".join(_section(register_map, block) for block in register_map.blocks)


def _coils(register_map: RegisterMap) -> str:
    """Return where the bits of both words are, of a map that has them: at the words' own addresses."""
    words = {one.name: one.address for one in register_map.registers if one.block in PLAIN_BLOCKS}
    if not {"control_word", "status_word"} <= words.keys():
        return ""
    control, status = (f"{words[name]}-{words[name] + MOST_BITS - 1}" for name in ("control_word", "status_word"))
    bits = f"are the bits of control_word, coils {status} those of status_word; FC02 reads both too."
    return f" Coils {control} (FC01, FC05, FC15) {bits}"


def _section(register_map: RegisterMap, block: Block) -> str:
    title = f"\n## {block.name}: {block.first} .. {block.last}\n\n{block.text}\n\n"
    return (
        title
        + "".join(f"- {line}\n" for line in _how_to(register_map, block))
        + "\n"
        + render_block(register_map, block.name)
    )


def _how_to(register_map: RegisterMap, block: Block) -> list[str]:
    """Return the whole block in the words of the masters that people use, in as many requests as Modbus needs."""
    registers = register_map.registers_of(block.name)
    reads = list(_requests(registers, MOST_REGISTERS_READ))
    lines = [f"S7 MB_CLIENT: MB_MODE 0 reads, {_s7_place(each)}" for each in reads]
    for run in _writable_runs(registers):
        lines += [
            f"S7 MB_CLIENT: MB_MODE 1 writes, {_s7_place(each)}" for each in _requests(run, MOST_REGISTERS_WRITTEN)
        ]
    return lines + [_mbpoll(block, each) for each in reads]


def _requests(registers: Sequence[Register], most: int) -> Iterator[list[Register]]:
    """Yield neighbours that one request carries, none of them cut, words between them included."""
    held: list[Register] = []
    for register in registers:
        if held and register.address + register.words - held[0].address > most:
            yield held
            held = []
        held.append(register)
    if held:
        yield held


def _writable_runs(registers: Sequence[Register]) -> list[list[Register]]:
    """Return what may be written in one stretch: up to the next register that is read only. Last those that act, each alone."""
    stretches = groupby(registers, lambda register: register.name if register.name in ACTING else register.access)
    runs = [list(run) for kind, run in stretches if kind != "R"]
    return sorted(runs, key=lambda run: run[0].name in ACTING)


def _s7_place(registers: Sequence[Register]) -> str:
    first, words = span_of(registers)
    names = registers[0].name if len(registers) == 1 else f"{registers[0].name} .. {registers[-1].name}"
    return f"MB_DATA_ADDR {holding_number(first)}, MB_DATA_LEN {words} ({names})"


def _mbpoll(block: Block, registers: Sequence[Register]) -> str:
    first, words = span_of(registers)
    if not block.repeats:
        return f"mbpoll -1 -p {defaults.MODBUS_PORT} -r {first + 1} -c {words} HOST"
    option = " -B" if block.word_order is WordOrder.ABCD else ""
    return f"mbpoll -1 -p {defaults.MODBUS_PORT} -t 4:float{option} -r {first + 1} -c {words // 2} HOST"


def _csv(register_map: RegisterMap) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(("block", *_HEADINGS))
    writer.writerows((register.block, *_row(register)) for register in register_map.registers)
    return out.getvalue()


def _row(register: Register) -> tuple[str, ...]:
    name = register.address + 1
    return (
        f"4{name:04d}/3{name:04d}",
        str(register.address),
        f"0x{register.address:04X}",
        register.access,
        register.name,
        register.type if register.words == 1 else f"{register.type} {register.word_order.upper()}",
        f"{register.scale:g}",
        register.unit,
        _range(register),
        _text(register),
    )


def _range(register: Register) -> str:
    if register.constant is not None:
        return f"{register.constant:g}"
    if register.values or register.bits or register.minimum is None or register.maximum is None:
        return ""
    return f"{register.minimum:.10g} .. {register.maximum:.10g}"


def _text(register: Register) -> str:
    values = ", ".join(f"{number} {name}" for number, name in register.values.items())
    bits = ", ".join(f"bit {number} {name}" for number, name in register.bits.items())
    return register.text.rstrip(".") + "".join(f": {names}" for names in (values, bits) if names)


def _entry(register: Register) -> dict[str, Any]:
    return {
        "name": register.name,
        "address": register.address,
        "words": register.words,
        "type": register.type,
        "scale": register.scale,
        "unit": register.unit,
        "access": register.access,
        "min": register.minimum,
        "max": register.maximum,
        "block": register.block,
        "text": register.text,
        "values": {str(number): name for number, name in register.values.items()},
        "bits": {str(number): name for number, name in register.bits.items()},
        "word_order": str(register.word_order),
    }
