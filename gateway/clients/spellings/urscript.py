"""URScript: global names, if statements; no exclusive or, so the CRC goes by tables of two bits."""

from gateway.clients.exchange import REQUESTED, STATUS_BITS, ExchangeTable
from gateway.clients.spellings.crc_table import crc_table
from gateway.registers.map.register_map import span_of


def spell_urscript(table: ExchangeTable) -> dict[str, str]:
    """Return the lists of the script."""
    first, status_first = table.command_span[0], table.status_span[0]
    control = {name: 1 << bit for bit, name in table.map.find("control_word").bits.items()}
    shown = {STATUS_BITS.get(name, name): 1 << bit for bit, name in table.map.find("status_word").bits.items()}
    commit = {f"commit_{name}": number for number, name in table.at("commit_status", "staging").values.items()}
    named = {name: table.at(name, "status").address for name in ("status_word", "force_measured", "fault_code")}
    named |= {name: table.at(name, "command").address for name in ("control_word", "force_setpoint", "heartbeat")}
    part_a, part_b, part_c = table.parts
    words, tail = table.command_span[1], table.at("target_slot", "staging").address
    tail_words = tail - table.at("length", "staging").address + 1
    return {
        "command_constants": _globals({f"FG_C_{r.name}": r.address - first for r in table.command}),
        "status_constants": _globals({f"FG_S_{r.name}": r.address - status_first for r in table.status}),
        "set_constants": _globals({f"FG_M_{each.name}": each.offset for each in table.model_fields}),
        "bit_constants": "".join(
            _globals({f"FG_{name}": mask for name, mask in each.items()}) for each in (control, shown, commit)
        ),
        "command_zeros": _zeros(words),
        "status_unread": _unread(table),
        "answer_zeros": _zeros(2 * table.status_span[1] + 3),
        "part_a_zeros": _zeros(part_a),
        "part_b_zeros": _zeros(part_b),
        "part_c_zeros": _zeros(part_c),
        "crc_table": ", ".join(str(value >> 2 * k & 3) for value in crc_table(2) for k in range(16)),
        "force_measured_counts": str(table.at("force_measured", "status").counts_per_unit),
        "force_requested_counts": str(table.at(REQUESTED, "status").counts_per_unit),
        "status_bytes": str(2 * table.status_span[1]),
        "tail_pdu": str(6 + 2 * tail_words),
        "tail_bytes": str(2 * tail_words),
        "counts_of_12_n": str(12 * table.at("force_setpoint", "command").counts_per_unit),
        **{f"at_{name}": str(address) for name, address in named.items()},
        "fault_cases": _cases(table.texts("fault_code"), "code"),
        "refusal_cases": _cases(table.texts("refusal_reason"), "reason"),
        "warning_cases": _cases(table.texts("warning_word"), "bit"),
        "failing_cases": _cases(table.texts("failing_reason"), "reason"),
        "state_cases": _cases(table.texts("state"), "number"),
        **_spell_self_test(table),
    }


def _spell_self_test(table: ExchangeTable) -> dict[str, str]:
    words = span_of(table.self_test)[1]
    return {
        "test_constants": _globals({f"FG_T_{name}": place for name, place in table.self_test_words.items()}),
        "test_zeros": _zeros(words),
        "test_bytes": str(2 * words),
        "test_result_cases": _cases(table.texts("self_test_result"), "result"),
        "verdict_cases": _cases(table.texts("self_test_noise"), "verdict"),
    }


def _globals(numbers: dict[str, int]) -> str:
    return "".join(f"global {name.upper()} = {number}\n" for name, number in numbers.items())


def _zeros(count: int) -> str:
    return ", ".join("0" * count)


def _unread(table: ExchangeTable) -> str:
    """Return the words of a status that was not read yet: none of them is a force."""
    words = ["0"] * table.status_span[1]
    words[table.at("force_measured", "status").address - table.status_span[0]] = str(0x8000)
    return ", ".join(words)


def _cases(texts: dict[int, str], name: str) -> str:
    lines = []
    for k, (number, text) in enumerate(texts.items()):
        lines += [f"  {'elif' if k else 'if'} {name} == {number}:", f'    return "{text}"']
    return "\n".join([*lines, "  end"])
