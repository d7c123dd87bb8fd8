"""The card of one register: where it is by every name that masters have for it, what it carries, and how to read it."""

from collections.abc import Iterator

from gateway import defaults
from gateway.cli.cards.card import Fact
from gateway.cli.master.value_text import limits_of
from gateway.profiles.rigs.rig import map_option
from gateway.registers import Register, RegisterMap, UnknownRegister
from gateway.registers.values import WordOrder


def find_registers(register_map: RegisterMap, name: str) -> list[Register]:
    """Return the register of NAME or NAME@BLOCK, by its 4xxxx number or its address. Of a bare name that several blocks have,
    the one in the plain block, or all. UnknownRegister, with what was probably meant, where there is none."""
    if name.isdecimal():
        number = int(name)
        address = number - 40001 if 40001 <= number < 50000 else number
        found = [one for one in register_map.registers if one.address <= address < one.address + one.words]
        return found or [register_map.find(name)]
    try:
        return [register_map.find(name)]
    except UnknownRegister:
        if several := [one for one in register_map.registers if one.name == name]:
            return several
        raise


def register_facts(register_map: RegisterMap, register: Register) -> Iterator[Fact]:
    """Yield the facts of the card in reading order."""
    last = register.address + register.words - 1
    span = f"{register.address}" if register.words == 1 else f"{register.address} and {last}"
    yield "what", register.text
    yield "is", f"4{register.address + 1:04d} (holding) and 3{register.address + 1:04d} (input)"
    yield "address", f"{span}, counted from 0 (0x{register.address:04X}); block {register.block}"
    yield "type", _describe_type(register)
    yield "access", "read and write (FC03/04, FC06/16/22/23)" if register.is_writable else "read only (FC03/04)"
    yield "limits", _describe_limits(register)
    yield "values", ", ".join(f"{number} {name}" for number, name in sorted(register.values.items()))
    yield "bits", ", ".join(f"{number} {name}" for number, name in sorted(register.bits.items()))
    yield "also", ", ".join(f"{other.name}@{other.block} at {other.address}" for other in _same(register_map, register))
    yield "mbpoll", read_line(register)
    label, option = _label(register_map, register), map_option(register_map)
    yield "read", f"force-gateway read {label}{option}"
    if register.is_writable:
        yield "write", f"force-gateway write {label}={_example(register)}{option}"


def read_line(register: Register) -> str:
    """Return how mbpoll reads it: it counts from 1, and expects the low word first unless -B says otherwise."""
    base = f"mbpoll -1 -p {defaults.MODBUS_PORT} -r {register.address + 1} -c 1"
    if register.words == 1:
        return f"{base} HOST" + ("    (a negative value: the number in brackets)" if register.type == "int16" else "")
    order = " -B" if register.word_order is WordOrder.ABCD else ""
    kind = "float" if register.type == "float32" else "int"
    return f"{base} -t 4:{kind}{order} HOST"


def _describe_type(register: Register) -> str:
    words = f", {register.words} words, {register.word_order.upper()}" if register.words > 1 else ""
    if register.scale == 1.0:
        return f"{register.type}{words}" + (f", in {register.unit}" if register.unit else "")
    return f"{register.type}{words}, times {register.scale:g} {register.unit}: 100 is {100 * register.scale:g} {register.unit}"


def _describe_limits(register: Register) -> str:
    if register.constant is not None:
        return f"always {register.constant:g}"
    if register.values or register.bits:
        return ""
    low, high = limits_of(register)
    if low is None or high is None:
        return ""
    rig = "; the rig's own may be narrower" if register.is_writable and register.block == "command" else ""
    missing = "; 0x8000 (-32768): not available" if register.type == "int16" and not register.is_writable else ""
    return f"{low:.10g} .. {high:.10g} {register.unit}".rstrip() + rig + missing


def _same(register_map: RegisterMap, register: Register) -> list[Register]:
    return [one for one in register_map.registers if one.name == register.name and one is not register]


def _label(register_map: RegisterMap, register: Register) -> str:
    full = f"{register.name}@{register.block}"
    try:
        return register.name if register_map.find(register.name) is register else full
    except LookupError:
        return full


def _example(register: Register) -> str:
    """Return a value that may be written: a name where it has names, else one within its limits."""
    if register.bits:
        return next(iter(register.bits.values()))
    if register.values:
        return next(iter(register.values.values()))
    low, high = limits_of(register)
    return f"{min(12.0, high if high is not None else 12.0) if (low or 0.0) <= 12.0 else low:g}"
