"""Whether the audit on the disk holds after all that was done to disk and processes, and tells who has commanded last. Reads
the lines as an auditor with a text editor and sha256sum would; no code of the gateway is used here."""

import json
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path
from typing import Any

LAST_LINES = 20


def judge_audit(state: Path, enabled_by: str) -> Iterator[str]:
    """Say what does not hold. enabled_by: address of who has enabled a moment ago."""
    before, lines = {"n": 0, "sha256": 64 * "0"}, list[dict[str, Any]]()
    for line in _lines(state / "audit"):
        body, _, own = line.rpartition(b', "sha256": "')
        fields = json.loads(line)
        if sha256(body + b"}").hexdigest() != own.decode().removesuffix('"}'):
            yield f"audit: line {fields['n']} was changed"
        if (fields["n"], fields["prev"]) != (before["n"] + 1, before["sha256"]):
            yield f"audit: line {fields['n']} stands behind line {before['n']}"
        before = fields
        lines.append(fields)
    enables = [one for one in lines[-LAST_LINES:] if (one.get("what"), one.get("new")) == ("enable", 1.0)]
    if not any(enabled_by in str(one.get("peer")) and one.get("result") == "accepted" for one in enables):
        yield f"audit: {enabled_by} has enabled, and no line of the last {LAST_LINES} says so"


def _lines(folder: Path) -> Iterator[bytes]:
    for path in sorted(folder.glob("*.jsonl")):
        yield from path.read_bytes().splitlines()
