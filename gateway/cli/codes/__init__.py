"""The catalogue behind `explain`: every code that a message may begin with, offline.

E: around the gateway (ports, network, files). W: a master's request was refused. A: the rig. Which fault, warning bit or
refusal reason has which code stands beside the texts, and a test compares with gateway.registers.words.
"""

from typing import Final

from gateway.cli.codes import alarms, errors, refusals
from gateway.cli.codes.alarms import FAULT_CODES, WARNING_CODES
from gateway.cli.codes.entry import Entry
from gateway.cli.codes.refusals import REFUSAL_CODES

CATALOGUE: Final = {
    entry.code: entry
    for entry in sorted(
        (*errors.ENTRIES, *refusals.ENTRIES, *alarms.FAULTS, *alarms.WARNINGS, *alarms.OTHERS),
        key=lambda entry: ("EWA".index(entry.code[0]), entry.code),
    )
}
"""Code -> entry, E then W then A."""


def find(word: str) -> tuple[Entry, ...]:
    """What a code (`e110`) stands for, or a name in the registers (`over-force`, `NOT_FINITE`: a fault and a refusal)."""
    key = word.strip().upper().replace("-", "_")
    return tuple(entry for entry in CATALOGUE.values() if key in (entry.code, entry.name))


__all__ = ["CATALOGUE", "FAULT_CODES", "REFUSAL_CODES", "WARNING_CODES", "Entry", "find"]
