"""C: enumerations, a struct for the status block, switch statements."""

from gateway.clients.exchange import STATUS_BITS, ExchangeTable, ModelField
from gateway.registers.map.register_map import Register

_TYPES = {"int16": "float", "float32": "float", "uint16": "uint16_t", "uint32": "uint32_t", "int32": "int32_t"}


def spell_c(table: ExchangeTable) -> dict[str, str]:
    """Return the lists of the C header."""
    first = table.command_span[0]
    return {
        "command_offsets": _enumerate({r.name: r.address - first for r in table.command}, "FG_"),
        "unsigned_words": f"0x{sum(1 << r.address - first for r in table.command if r.type == 'uint16'):04X}",
        "control_bits": _enumerate(
            {name: 1 << bit for bit, name in table.map.find("control_word").bits.items()}, "FG_"
        ),
        "status_bits": _enumerate(
            {STATUS_BITS.get(name, name): 1 << bit for bit, name in table.map.find("status_word").bits.items()}, "FG_"
        ),
        "states": _enumerate({name: number for number, name in table.map.find("state").values.items()}, "FG_STATE_"),
        "commit_states": _enumerate(
            {name: number for number, name in table.at("commit_status", "staging").values.items()}, "FG_COMMIT_"
        ),
        "status_fields": "\n".join(_declare(register) for register in table.status),
        "status_decoding": "\n".join(_decode(register, table.status_span[0]) for register in table.status),
        "model_to_words": "\n".join(_to_words(each) for each in table.model_fields),
        "model_from_words": "\n".join(_from_words(each) for each in table.model_fields),
        "fault_cases": _cases(table.texts("fault_code")),
        "refusal_cases": _cases(table.texts("refusal_reason")),
        "warning_cases": _cases(table.texts("warning_word")),
        "failing_cases": _cases(table.texts("failing_reason")),
        "state_cases": _cases(table.texts("state")),
        "test_offsets": _enumerate(table.self_test_words, "FG_TEST_"),
        "test_results": _enumerate(
            {name: number for number, name in table.at("self_test_result", "proof").values.items()}, "FG_RESULT_"
        ),
        "test_result_cases": _cases(table.texts("self_test_result")),
        "test_item_cases": _cases({place: name.replace("_", " ") for name, place in table.self_test_items.items()}),
        "verdict_cases": _cases(table.texts("self_test_noise")),
    }


def _enumerate(numbers: dict[str, int], prefix: str) -> str:
    return ",\n".join(f"    {prefix}{name.upper()} = {number}" for name, number in numbers.items())


def _cases(texts: dict[int, str]) -> str:
    return "\n".join(f'    case {number}: return "{text}";' for number, text in texts.items())


def _declare(register: Register) -> str:
    unit = f"   /* {register.unit} */" if register.unit else ""
    kind = "float" if register.type == "uint16" and register.counts_per_unit != 1 else _TYPES[register.type]
    return f"    {kind} {register.name};{unit}"


def _decode(register: Register, first: int) -> str:
    k, name, counts = register.address - first, register.name, register.counts_per_unit
    if register.type == "int16":
        return f"    s->{name} = fg_scaled(w[{k}], {counts}.0f);"
    if register.type in ("uint32", "int32"):
        return f"    s->{name} = ({_TYPES[register.type]})(((uint32_t)w[{k}] << 16) | w[{k + 1}]);"
    if register.type == "uint16" and counts != 1:
        return f"    s->{name} = w[{k}] / {counts}.0f;"
    return f"    s->{name} = fg_get_float(w + {k});" if register.type == "float32" else f"    s->{name} = w[{k}];"


def _to_words(each: ModelField) -> str:
    if each.type == "uint16":
        return f"    words[{each.offset}] = model->{each.name};"
    if each.count == 1:
        return f"    fg_put_float(words + {each.offset}, model->{each.name});"
    return f"    for (int k = 0; k < {each.count}; k++) fg_put_float(words + {each.offset} + 2 * k, model->{each.name}[k]);"


def _from_words(each: ModelField) -> str:
    if each.type == "uint16":
        return f"    model->{each.name} = words[{each.offset}];"
    if each.count == 1:
        return f"    model->{each.name} = fg_get_float(words + {each.offset});"
    return f"    for (int k = 0; k < {each.count}; k++) model->{each.name}[k] = fg_get_float(words + {each.offset} + 2 * k);"
