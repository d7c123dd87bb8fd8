"""Register values as people write them (`12`, `voltage`, `enable,tare`, `0x1`) and read them (`12.00 N`, `holding`)."""

from difflib import get_close_matches
from ipaddress import IPv4Address
from math import inf, isnan

from gateway.cli.command_line.numbers import describe_allowed, number_hint
from gateway.cli.master.client import RegisterReading
from gateway.registers import Register
from gateway.registers.values import RAW_LIMITS
from gateway.registers.writes.ownership import LARGEST_SERIAL_PLACE, NOT_IPV4, serial_host


def parse_value(register: Register, text: str) -> bytes:
    """Return the words for a value as typed; ValueError with a sentence."""
    if register.bits:
        number = _bits(register, text)
    elif register.values:
        number = _choice(register, text)
    else:
        expected = f"a number in {register.unit}" if register.unit else "a number"
        number = _number(text, expected)
        if isnan(number) and register.type != "float32":  # it would go out as the largest negative count
            raise ValueError(f"{text.strip()} is not {expected}")
    register.check_meant(number)
    return encode_within(register, number)


def encode_within(register: Register, number: float) -> bytes:
    """Return the words of a number; ValueError with what is allowed where the register cannot carry it. Narrower limits of the
    rig are the gateway's to tell."""
    try:
        return register.encode(number)
    except ValueError:
        low, high = limits_of(register)
        if low is None and high is None:
            raise
        raise ValueError(describe_allowed(f"{number:.10g}", low, high, register.unit)) from None


def limits_of(register: Register) -> tuple[float | None, float | None]:
    """Return the least and the largest value in the register's unit; what the map leaves open, its type decides."""
    raw = RAW_LIMITS.get(register.type)
    low, high = (raw[0] * register.scale, raw[1] * register.scale) if raw else (None, None)
    return low if register.minimum is None else register.minimum, high if register.maximum is None else register.maximum


def format_value(reading: RegisterReading) -> str:
    """Return a value with its unit or names; `-` when the gateway has none."""
    register, value = reading.register, reading.value
    if isnan(value):
        return "-"
    if register.bits:
        names = bit_names(reading)
        return f"0x{int(value):04X}" + (f" ({', '.join(names)})" if names else "")
    if register.values:
        return register.values.get(int(value), f"{int(value)} (no name)")
    if register.name == "owner_ip":
        return _owner(int(value))
    is_plain = register.type == "float32" and not register.unit  # a share, a weight, a constant
    number = f"{value:.6g}" if is_plain else f"{value:.{register.decimals}f}"
    return f"{number} {register.unit}" if register.unit else number


def _owner(number: int) -> str:
    if number == 0:
        return "nobody"
    if number == NOT_IPV4:
        return "somebody without an IPv4 address"
    return serial_host(number) if number <= LARGEST_SERIAL_PLACE else str(IPv4Address(number))


def bit_names(reading: RegisterReading) -> list[str]:
    """Return names of the bits that are set, lowest first."""
    if isnan(reading.value):
        return []
    return [name for bit, name in sorted(reading.register.bits.items()) if int(reading.value) >> bit & 1]


def raw(reading: RegisterReading) -> str:
    """Return the words as hexadecimal."""
    return " ".join(f"{word:04X}" for word in reading.words)


def _bits(register: Register, text: str) -> float:
    """Return a number, or names of bits joined by commas or plus signs."""
    bits = {_plain(name): bit for bit, name in register.bits.items()}
    number = 0
    for word in text.replace("+", ",").split(","):
        if _plain(word) in bits:
            number |= 1 << bits[_plain(word)]
        else:
            given = _number(word, f"a number or bits of {', '.join(register.bits.values())}", bits)
            register.check_meant(given)
            number |= int(given)
    return number


def _choice(register: Register, text: str) -> float:
    names = {_plain(name): number for number, name in register.values.items()}
    if _plain(text) in names:
        return names[_plain(text)]
    return _number(text, f"one of {', '.join(register.values.values())}", names)


def _number(text: str, expected: str, names: "dict[str, int] | tuple[()]" = ()) -> float:
    text = text.strip()
    try:
        return float(int(text, 0))
    except OverflowError:
        return inf  # as what is written with a point, and refused as such
    except ValueError:
        pass
    try:
        return float(text)
    except ValueError:
        near = get_close_matches(_plain(text), list(names), 1)
        meant = f"; did you mean {near[0]}?" if near else ""
        raise ValueError(f"{text or 'nothing'} is not {expected}{meant}{number_hint(text)}") from None


def _plain(name: str) -> str:
    return name.strip().lower().replace("-", "_").replace(" ", "_")
