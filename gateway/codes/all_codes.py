"""Every code with its explanation, for `explain` and for messages at the terminal; works offline."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

from gateway.codes.alarms import ALARMS
from gateway.codes.errors import ERRORS
from gateway.codes.explanation import Explanation
from gateway.codes.face_errors import FACE_ERRORS
from gateway.codes.faults import FaultCode
from gateway.codes.machine_errors import MACHINE_ERRORS
from gateway.codes.notices import NOTICES
from gateway.codes.page_errors import PAGE_ERRORS
from gateway.codes.refusals import SPECIAL_REFUSALS, RefusalReason
from gateway.codes.warning_bits import WarningBit

_THEN_RESET: Final = "Then reset with setpoint 0."


@dataclass(frozen=True, slots=True)
class CatalogueEntry:
    """An explanation in the form that `explain --json` prints. name: of the fault, warning bit or refusal in the registers."""

    code: str
    title: str
    seen: str
    probably: str
    do: str
    name: str = ""


def find_codes(word: str) -> tuple[CatalogueEntry, ...]:
    """Return what a code (`e110`) or a name in the registers stands for (`over-force`; `NOT_FINITE`: a fault and a refusal)."""
    key = word.strip().upper().replace("-", "_")
    return tuple(entry for entry in CATALOGUE.values() if key in (entry.code, entry.name))


def _describe(explanation: Explanation, name: str = "", exception: int = 0) -> CatalogueEntry:
    answered = f" Exception {exception:02X}." if exception and explanation.code.startswith("W") else ""
    texts = (explanation.title, explanation.seen + answered, explanation.probably, explanation.do)
    return CatalogueEntry(explanation.code, *texts, name)


def _describe_fault(fault: FaultCode) -> CatalogueEntry:
    """A fault latches, so that whatever is done about it ends with the reset."""
    entry = _describe(fault.explanation, fault.name)
    return entry if "reset" in entry.do else replace(entry, do=f"{entry.do} {_THEN_RESET}")


def _entries() -> Iterator[CatalogueEntry]:
    yield from map(_describe, (*MACHINE_ERRORS, *ERRORS, *FACE_ERRORS, *PAGE_ERRORS))
    yield from (_describe(reason.explanation, reason.name, reason.exception) for reason in RefusalReason)
    yield from (_describe(special.explanation, exception=special.reason.exception) for special in SPECIAL_REFUSALS)
    yield from map(_describe, NOTICES)
    yield from map(_describe_fault, FaultCode)
    yield from (_describe(bit.explanation, str(bit.name)) for bit in WarningBit)
    yield from map(_describe, ALARMS)


CATALOGUE: Final = {
    entry.code: entry
    for entry in sorted(_entries(), key=lambda entry: ("EWA".find(entry.code[:1]), entry.code))
    if entry.code
}
"""Code -> entry, E then W then A."""
