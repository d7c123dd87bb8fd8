"""RAPID: CONST num, TEST statements. Arrays count from 1, names have at most 32 characters, strings 80."""

from gateway.clients.exchange import STATUS_BITS, ExchangeTable
from gateway.clients.spellings.crc_table import crc_table
from gateway.registers.map.register_map import Register, span_of

PER_LINE = 4


def spell_rapid(table: ExchangeTable) -> dict[str, str]:
    """Return the lists of the RAPID module."""
    first, status_first = table.command_span[0], table.status_span[0]
    control = {f"FG_{name}": 1 << bit for bit, name in table.map.find("control_word").bits.items()}
    shown = {f"FG_{STATUS_BITS.get(name, name)}": 1 << bit for bit, name in table.map.find("status_word").bits.items()}
    commit = {f"FG_COMMIT_{name}": n for n, name in table.at("commit_status", "staging").values.items()}
    return {
        "command_zeros": _zeros(table.command_span[1]),
        "status_zeros": _zeros(table.status_span[1]),
        "set_zeros": _zeros(table.set_words),
        "command_constants": _constants({f"FG_C_{r.name}": r.address - first + 1 for r in table.command}),
        "status_constants": _constants({f"FG_S_{r.name}": r.address - status_first + 1 for r in table.status}),
        "set_constants": _constants({f"FG_M_{each.name}": each.offset + 1 for each in table.model_fields}),
        "bit_constants": "\n".join(map(_constants, (control, shown, commit))),
        "crc_table": _rows(crc_table(4)),
        "status_decoding": "\n".join(_decode(register, status_first) for register in table.status),
        "words_are_taken": _words_are_taken(table),
        "fault_cases": _cases(table.texts("fault_code")),
        "refusal_cases": _cases(table.texts("refusal_reason")),
        "warning_cases": _cases(table.texts("warning_word")),
        "failing_cases": _cases(table.texts("failing_reason")),
        "state_cases": _cases(table.texts("state")),
        "test_constants": _constants({f"FG_T_{name}": place + 1 for name, place in table.self_test_words.items()}),
        "test_zeros": _zeros(span_of(table.self_test)[1]),
        "test_result_cases": _cases(table.texts("self_test_result")),
        "verdict_cases": _cases(table.texts("self_test_noise")),
    }


def _zeros(count: int) -> str:
    """Return a list of zeros, broken into lines of twenty."""
    rows = [",".join("0" * min(20, count - k)) for k in range(0, count, 20)]
    return ",\n    ".join(rows)


def _constants(numbers: dict[str, int]) -> str:
    return "\n".join(f"  CONST num {name.upper()}:={number};" for name, number in numbers.items())


def _words_are_taken(table: ExchangeTable) -> str:
    """Return the rest of a condition: each word that T_ROB1 sets by its place is the one that the gateway holds."""
    first, count = table.command_span
    others = {table.at(name, "command").address for name in ("control_word", "force_setpoint", "heartbeat")}
    places = [k + 1 for k in range(count) if first + k not in others]
    return "\n".join(f"      AND Round(fgCommand{{{place}}})=nGood{{{place}}}" for place in places)


def _rows(numbers: list[int]) -> str:
    rows = [",".join(map(str, numbers[k : k + PER_LINE])) for k in range(0, len(numbers), PER_LINE)]
    return ",\n".join(f"    {row}" for row in rows)


def _cases(texts: dict[int, str]) -> str:
    return "\n".join(f'    CASE {number}:\n      RETURN "{text}";' for number, text in texts.items())


def _decode(register: Register, first: int) -> str:
    k = register.address - first + 1
    place = f"    fgStatus{{{k}}}:="
    if register.type == "float32":
        return f"{place}FgFloat({k});"
    if register.type == "int16":
        return f"{place}FgScaled(nWords{{{k}}},{register.counts_per_unit});"
    if register.words == 2:
        return f"{place}nWords{{{k}}};\n    fgStatus{{{k + 1}}}:=nWords{{{k + 1}}};"
    counts = register.counts_per_unit
    return f"{place}nWords{{{k}}};" if counts == 1 else f"{place}nWords{{{k}}}/{counts};"
