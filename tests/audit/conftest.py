"""A state directory with an audit of several files."""

from pathlib import Path

import pytest

from gateway.audit.audit_file import AuditFile
from tests.audit.appending import append
from tests.audit.test_chain import FILE_BYTES, LINES, records


@pytest.fixture
def state(tmp_path: Path) -> Path:
    file = AuditFile(tmp_path, FILE_BYTES)
    for record in records(LINES):
        append(file, [record])
    file.close()
    return tmp_path
