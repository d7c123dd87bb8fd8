"""Python: tuples and dictionaries."""

import json

from gateway.clients.exchange import ExchangeTable
from gateway.registers.map.register_map import Register


def spell_python(table: ExchangeTable) -> dict[str, str]:
    """Return the lists of the Python module."""
    first, status_first = table.command_span[0], table.status_span[0]
    shown = table.map.find("status_word").bits.items()
    return {
        "command_table": "\n".join(_command(register, first) for register in table.command),
        "control_bits": _numbered({name: 1 << bit for bit, name in table.map.find("control_word").bits.items()}),
        "status_bits": _numbered({name: 1 << bit for bit, name in shown}),
        "status_table": "\n".join(
            f'    ("{r.name}", {r.address - status_first}, "{r.type}", {r.counts_per_unit}),' for r in table.status
        ),
        "model_table": "\n".join(f'    ("{m.name}", {m.offset}, {m.count}, "{m.type}"),' for m in table.model_fields),
        "states": _texts(table.texts("state")),
        "faults": _texts(table.texts("fault_code")),
        "refusals": _texts(table.texts("refusal_reason")),
        "warnings": _texts(table.texts("warning_word")),
        "commit_states": _texts(table.texts("commit_status")),
        "failing": _texts(table.texts("failing_reason")),
        "test_table": "\n".join(f'    ("{name}", {place}),' for name, place in table.self_test_words.items()),
        "test_results": _texts(table.texts("self_test_result")),
        "test_verdicts": _texts(table.texts("self_test_noise")),
    }


def _command(register: Register, first: int) -> str:
    counts, least, most = register.counts_per_unit, register.minimum or 0, register.maximum or 0
    return f'    "{register.name}": ({register.address - first}, {counts}, {least:g}, {most:g}),'


def _numbered(numbers: dict[str, int]) -> str:
    return "\n".join(f"    {json.dumps(name)}: 0x{number:04X}," for name, number in numbers.items())


def _texts(texts: dict[int, str]) -> str:
    return "\n".join(f"    {number}: {json.dumps(text)}," for number, text in texts.items())
