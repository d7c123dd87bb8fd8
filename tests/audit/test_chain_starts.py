"""What a start finds of an audit: what was altered is told and stays to be seen, what the disk withholds is asked for again."""

import errno
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gateway.audit.audit_file import AuditFile
from gateway.audit.audit_reader import read_audit, verify_audit
from tests.audit.test_chain import FILE_BYTES, LINES, find_line, replace_last_line
from tests.other_kinds import MAKERS, never_waiting, put


@pytest.mark.parametrize("is_rewritten", [False, True])
def test_a_start_covers_up_no_head_that_is_gone_or_names_another_line(state: Path, is_rewritten: bool) -> None:
    """The first batch wrote a new head, and the audit held again."""
    if is_rewritten:
        replace_last_line(state)
    else:
        path, lines, place = find_line(state, LINES - 1)
        path.write_bytes(b"".join(lines[:place]))
        (state / "audit" / "head").unlink()
    for _ in range(2):
        file = AuditFile(state, 1 << 20)
        file.append([{"what": "start"}])
        file.close()
    told = [fields["text"] for fields in read_audit(state) if fields["what"] == "chain broken"]
    assert [text[:4] for text in told] == ["A352"]
    assert verify_audit(state).broken


@pytest.mark.parametrize("kind", MAKERS)
@pytest.mark.parametrize("name", ["newest", "head", "head.new"])
def test_no_audit_waits_for_what_is_no_file(state: Path, name: str, kind: str) -> None:
    """Its thread stood for ever, and nobody was told that nothing was kept."""
    newest = max(path for path in (state / "audit").iterdir() if path.suffix == ".jsonl")
    file = AuditFile(state, 1 << 20)
    put(kind, newest if name == "newest" else state / "audit" / name)
    with never_waiting():
        if name == "newest":
            with pytest.raises(OSError, match=f"it is {kind}"):
                file.append([{"what": "start"}])
        else:
            file.append([{"what": "start"}])  # an old head promises less than there is
    file.close()


@pytest.mark.parametrize("name", ["audit", "audit/head"])
def test_what_the_disk_does_not_give_now_is_neither_gone_nor_altered(
    state: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A folder that may not be read looked like an empty one, and a head that may not like one that was removed."""

    def refusing(call: Callable[..., Any]) -> Callable[..., Any]:
        def refuse(path: Any, *options: Any, **more: Any) -> Any:
            if Path(path) == state / name:
                raise PermissionError(errno.EACCES, "Permission denied", str(path))
            return call(path, *options, **more)

        return refuse

    with monkeypatch.context() as patched:
        for call in ("open", "listdir"):
            patched.setattr(os, call, refusing(getattr(os, call)))
        with pytest.raises(PermissionError):
            AuditFile(state, FILE_BYTES).append([{"what": "start"}])
    file = AuditFile(state, FILE_BYTES)
    assert file.append([{"what": "start"}]) == ()
    file.close()
    assert not verify_audit(state).broken
