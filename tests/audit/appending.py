"""Lines that are written and synced, as the loop has it done, one after the other."""

from collections.abc import Iterable, Mapping
from typing import Any

from gateway.audit.audit_file import AuditFile


def append(file: AuditFile, records: Iterable[Mapping[str, Any]]) -> tuple[str, ...]:
    """Put these records at the end, durably; return what was found broken. What was refused before is not among them."""
    written = file.write(records, again=True)
    assert written
    file.sync(written.place)
    return written.found
