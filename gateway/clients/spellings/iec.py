"""Structured Text (IEC 61131-3) and Siemens SCL: structures, CASE statements, conversions. SCL marks its own names with #."""

from collections.abc import Iterator
from dataclasses import dataclass

from gateway.clients.exchange import CONTROL_BITS, STATUS_BITS, ExchangeTable, ModelField
from gateway.registers.map.register_map import Register, holding_number, span_of

_SET_BY_THE_BLOCK = ("control_word", "force_setpoint", "heartbeat")


@dataclass(frozen=True)
class _Dialect:
    """Spelling of one of the two. indent: of a case, of a structure's member, of the encoding of a model."""

    local: str  # before a name of the block's own
    structures: tuple[str, str, str]  # command, status, model
    arrays: tuple[str, str, str]  # what is wanted, what was read, the set
    case: str
    member: str
    text: str  # of a function's result in its CASE
    types: dict[str, str]
    bits_of: str
    counts: tuple[str, str, str]  # what makes a word of a value: its name, its two inputs


_SCL = _Dialect(
    local="#",
    structures=("#command", "#status", "#model"),
    arrays=("#want", '"FG_Buffer".words', "#setWords"),
    case="      ",
    member="      ",
    text="#FG_{0} := ",
    types={"real": "Real", "uint": "UInt", "word": "Word", "dword": "DWord", "array": "Array[0..{0}] of Real"},
    bits_of="REAL_TO_DWORD({0})",
    counts=('"FG_Counts"', "value", "countsPerUnit"),
)
_ST = _Dialect(
    local="",
    structures=("stCommand", "stStatus", "stModel"),
    arrays=("aWant", "stLink.aRead", "aSet"),
    case="    ",
    member="    ",
    text="F_Fg{0} := ",
    types={"real": "REAL", "uint": "UINT", "word": "WORD", "dword": "DWORD", "array": "ARRAY[0..{0}] OF REAL"},
    bits_of="F_FgBits(fValue := {0})",
    counts=("F_FgCounts", "fValue", "fCountsPerUnit"),
)


def spell_scl(table: ExchangeTable) -> dict[str, str]:
    """Return the lists of the SCL source."""
    host = table.where.host
    part_a, part_b, part_c = table.parts
    stage = {name: table.at(name, "staging").address for name in ("order", "length", "commit", "commit_status")}
    numbers = {
        "command": table.command_span[0],
        "values": table.command_span[0] + table.values_first,
        "heartbeat": table.at("heartbeat", "command").address,
        "echo": table.at("byte_order_echo", "proof").address,
        "hash": table.at("map_hash", "proof").address,
        "test": table.self_test[0].address,
        "status": table.status_span[0],
        "stage_a": stage["order"],
        "stage_b": stage["order"] + part_a,
        "stage_c": table.at("slip_stops", "staging").address,
        "tail": stage["length"],
        "commit": stage["commit"],
        "commit_status": stage["commit_status"],
    }
    octets = {f"ip_{k}": octet for k, octet in enumerate(_octets(host), 1)}
    places = {f"s7_{name}": holding_number(address) for name, address in numbers.items()}
    hexadecimal = {"set_words_hex": f"{part_a + part_b + part_c:04X}", "unit_hex": f"{table.where.unit:02X}"}
    return {**_lists(table, _SCL), **octets, **places, **hexadecimal}


def spell_st(table: ExchangeTable) -> dict[str, str]:
    """Return the lists of the Structured Text."""
    host = table.where.host
    return {**_lists(table, _ST), "ip_list": ", ".join(_octets(host))}


def _octets(host: str) -> list[str]:
    """Return the four numbers of an IPv4 address; those of documentation (RFC 5737) where the host has a name."""
    numbers = host.split(".")
    return numbers if len(numbers) == 4 and all(each.isdigit() for each in numbers) else ["192", "0", "2", "1"]


def _lists(table: ExchangeTable, dialect: _Dialect) -> dict[str, str]:
    commands = [register for register in table.command if register.name not in _SET_BY_THE_BLOCK]
    part_a, part_b, part_c = table.parts
    depth = {"#": ("      ", "            ", "               "), "": ("", "        ", "                ")}[
        dialect.local
    ]
    return {
        "command_fields": "\n".join(_declare(register, dialect, registers=True) for register in commands),
        "status_fields": "\n".join(_declare(register, dialect, registers=False) for register in table.status),
        "model_fields": "\n".join(_declare_field(each, dialect) for each in table.model_fields),
        "command_encoding": "\n".join(depth[0] + _encode(each, table, dialect) for each in commands),
        "status_decoding": "\n".join(depth[1] + _decode(each, table, dialect) for each in table.status),
        "model_encoding": "\n".join(
            depth[2] + line for each in table.model_fields for line in _encode_field(each, dialect)
        ),
        "bit_constants": "\n".join(_constants(table, dialect)),
        "fault_cases": _cases(table.texts("fault_code"), "FaultText", dialect),
        "refusal_cases": _cases(table.texts("refusal_reason"), "RefusalText", dialect),
        "warning_cases": _cases(table.texts("warning_word"), "WarningText", dialect),
        "failing_cases": _cases(table.texts("failing_reason"), "FailingText", dialect),
        "state_cases": _cases(table.texts("state"), "StateText", dialect),
        "test_result_cases": _cases(table.texts("self_test_result"), "TestResultText", dialect),
        "verdict_cases": _cases(table.texts("self_test_noise"), "VerdictText", dialect),
        "test_fields": "\n".join(
            f"{dialect.member}{name} : {dialect.types['uint']};" for name in table.self_test_words
        ),
        "test_decoding": "\n".join(_decode_test(table, dialect)),
        "buffer_last": str(max(*table.parts, table.status_span[1], span_of(table.self_test)[1]) - 1),
        "set_last": str(table.set_words - 1),
        "part_a_last": str(part_a - 1),
        "part_b_last": str(part_b - 1),
        "part_c_last": str(part_c - 1),
    }


def _constants(table: ExchangeTable, dialect: _Dialect) -> Iterator[str]:
    control, shown = table.map.find("control_word").bits.items(), table.map.find("status_word").bits.items()
    masks = {f"{name}_BIT": 1 << bit for bit, name in control if name in CONTROL_BITS}
    masks |= {STATUS_BITS[name]: 1 << bit for bit, name in shown if name in STATUS_BITS}
    states = table.at("commit_status", "staging").values.items()
    masks |= {f"COMMIT_{name}": number for number, name in states if name in ("committed", "failed")}
    word = dialect.types["word"]
    masks["STARTS"] = table.starts
    yield from (f"{dialect.member}{name.upper()} : {word} := 16#{mask:04X};" for name, mask in masks.items())


def _kind(register: Register, *, registers: bool) -> str:
    """Return the member's type: whole words that carry bits are words, what has a unit is real."""
    if register.type in ("int16", "float32") or (_is_scaled_word(register) and not registers):
        return "real"
    if register.words == 2:
        return "dword"
    return "word" if register.bits and not registers else "uint"


def _is_scaled_word(register: Register) -> bool:
    return register.type == "uint16" and register.counts_per_unit != 1


def _declare(register: Register, dialect: _Dialect, *, registers: bool) -> str:
    kind = dialect.types[_kind(register, registers=registers)]
    unread = " := 9.0E9" if register.name == "force_measured" else ""  # before the first answer, as behind a loss
    return f"{dialect.member}{register.name} : {kind}{unread};{_unit_note(register.unit, dialect)}"


def _unit_note(unit: str, dialect: _Dialect) -> str:
    if not unit:
        return ""
    return f"   // {unit}" if dialect.local else f" (* {unit} *)"


def _declare_field(each: ModelField, dialect: _Dialect) -> str:
    kind = "uint" if each.type == "uint16" else "real"
    spelled = dialect.types["array"].format(each.count - 1) if each.count > 1 else dialect.types[kind]
    return f"{dialect.member}{each.name} : {spelled};{_unit_note(each.unit, dialect)}"


def _encode(register: Register, table: ExchangeTable, dialect: _Dialect) -> str:
    place = f"{dialect.arrays[0]}[{register.address - table.command_span[0]}]"
    value = f"{dialect.structures[0]}.{register.name}"
    if register.type == "int16":
        function, given, counts = dialect.counts
        return f"{place} := {function}({given} := {value}, {counts} := {register.counts_per_unit}.0);"
    return f"{place} := UINT_TO_WORD({value});"


def _decode(register: Register, table: ExchangeTable, dialect: _Dialect) -> str:
    k, read = register.address - table.status_span[0], dialect.arrays[1]
    place = f"{dialect.structures[1]}.{register.name} := "
    first, second = f"{read}[{k}]", f"{read}[{k + 1}]"
    if register.type == "int16":
        counts = f"{register.counts_per_unit}.0"
        scl = f'"FG_Scaled"(raw := {first}, countsPerUnit := {counts});'
        return place + (scl if dialect.local else f"F_FgScaled(nRaw := {first}, fCountsPerUnit := {counts});")
    if register.type == "float32":
        function, high, low = ('"FG_Real"', "high", "low") if dialect.local else ("F_FgReal", "nHigh", "nLow")
        return f"{place}{function}({high} := {first}, {low} := {second});"
    if register.words == 2:
        shifted = f"SHL(IN := WORD_TO_DWORD({first}), N := 16)" if dialect.local else f"SHL(WORD_TO_DWORD({first}), 16)"
        return f"{place}{shifted} OR WORD_TO_DWORD({second});"
    if _is_scaled_word(register):
        return f"{place}UINT_TO_REAL(WORD_TO_UINT({first})) / {register.counts_per_unit}.0;"
    return f"{place}{first};" if register.bits else f"{place}WORD_TO_UINT({first});"


def _decode_test(table: ExchangeTable, dialect: _Dialect) -> Iterator[str]:
    indent, structure = (" " * 12, "#test") if dialect.local else (" " * 8, "stTest")
    for name, place in table.self_test_words.items():
        yield f"{indent}{structure}.{name} := WORD_TO_UINT({dialect.arrays[1]}[{place}]);"


def _encode_field(each: ModelField, dialect: _Dialect) -> Iterator[str]:
    target, value, k = dialect.arrays[2], f"{dialect.structures[2]}.{each.name}", f"{dialect.local}k"
    if each.type == "uint16":
        yield f"{target}[{each.offset}] := UINT_TO_WORD({value});"
        yield from [f"{target}[{each.offset + 1}] := {'16#0000' if dialect.local else '0'};"]
        return
    places = (str(each.offset), str(each.offset + 1))
    indent, step = "", dialect.member[:3] if dialect.local else dialect.member
    if each.count > 1:
        yield f"FOR {k} := 0 TO {each.count - 1} DO"
        indent, value = step, f"{value}[{k}]"
        places = (f"{each.offset} + 2 * {k}", f"{each.offset + 1} + 2 * {k}")
    bits = f"{dialect.local}{'bits' if dialect.local else 'nBits'}"
    yield f"{indent}{bits} := {dialect.bits_of.format(value)};"
    halves = (f"{bits}.%W1", f"{bits}.%W0")
    if not dialect.local:
        halves = (f"DWORD_TO_WORD(SHR({bits}, 16))", f"DWORD_TO_WORD({bits} AND 16#FFFF)")
    yield from (f"{indent}{target}[{place}] := {half};" for place, half in zip(places, halves, strict=True))
    if each.count > 1:
        yield "END_FOR;" if dialect.local else "END_FOR"


def _cases(texts: dict[int, str], name: str, dialect: _Dialect) -> str:
    result = dialect.text.format(name)
    return "\n".join(f"{dialect.case}{number}: {result}'{_quote(text)}';" for number, text in texts.items())


def _quote(text: str) -> str:
    return text.replace("$", "$$").replace("'", "$'")
