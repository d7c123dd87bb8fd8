"""Who judges the audit sees each line that was changed, or is missing."""

from collections.abc import Callable
from pathlib import Path

import pytest

from gateway.audit.chain import ChainEnd, seal_line
from tests.simulation.judges.audit_judge import judge_audit

OWNER = "10.0.0.1"
AUDIT = tuple(
    {"what": what, "result": "accepted", "peer": f"{OWNER}:40001", "new": 1.0} for what in ("start", "enable")
)


@pytest.mark.parametrize(
    ("spoil", "seen"),
    [
        (lambda lines: lines, []),
        (lambda lines: lines[:1], [f"audit: {OWNER} has enabled, and no line of the last 20 says so"]),
        (lambda lines: lines[1:], ["audit: line 2 stands behind line 0"]),
        (lambda lines: [lines[0].replace(b"start", b"stars"), lines[1]], ["audit: line 1 was changed"]),
        (lambda lines: [lines[0], lines[1].replace(b"40001", b"40002")], ["audit: line 2 was changed"]),
    ],
)
def test_an_audit_that_was_touched_is_seen(
    spoil: Callable[[list[bytes]], list[bytes]], seen: list[str], tmp_path: Path
) -> None:
    (tmp_path / "audit").mkdir()
    lines, end = list[bytes](), ChainEnd()
    for fields in AUDIT:
        line, end = seal_line(fields, end)
        lines.append(line)
    (tmp_path / "audit" / "1.jsonl").write_bytes(b"".join(spoil(lines)))
    assert list(judge_audit(tmp_path, OWNER)) == seen
