"""What a start finds of an audit: what was altered is told and stays to be seen, what the disk withholds is asked for again."""

import errno
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gateway.audit.audit_file import AuditFile, audit_files
from gateway.audit.audit_reader import read_audit, verify_audit
from gateway.audit.chain import NO_HASH
from tests.audit.appending import append
from tests.audit.test_chain import FILE_BYTES, LINES, files_of, find_line, records, replace_last_line
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
        append(file, [{"what": "start"}])
        file.close()
    told = [fields["text"] for fields in read_audit(state) if fields["what"] == "chain broken"]
    assert [text[:4] for text in told] == ["A352"]
    assert verify_audit(state).broken


def test_behind_a_last_line_that_was_altered_the_numbers_go_on_and_no_hash_vouches_for_it(state: Path) -> None:
    newest = audit_files(state / "audit")[-1]
    newest.write_bytes(newest.read_bytes()[:-20] + b"0" * 19 + b"\n")
    file = AuditFile(state, 1 << 20)
    append(file, [{"what": "start"}])
    file.close()
    behind = [json.loads(line) for line in newest.read_bytes().splitlines()[-2:]]
    assert [(each["n"], each["what"]) for each in behind] == [(LINES + 1, "chain broken"), (LINES + 2, "start")]
    assert behind[0]["prev"] == NO_HASH


def test_a_head_that_is_damaged_alone_is_no_line_that_was_replaced(state: Path) -> None:
    """The line of the next start continues none, and says why."""
    (state / "audit" / "head").write_text("{")
    file = AuditFile(state, 1 << 20)
    append(file, [{"what": "start"}])
    file.close()
    broken = verify_audit(state).broken
    assert broken and broken.line and "no head that can be read" in broken.text and "replaced" not in broken.text


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
                append(file, [{"what": "start"}])
        else:
            append(file, [{"what": "start"}])  # an old head promises less than there is
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
        for call in ("open", "listdir", "scandir"):  # a folder is read by the one, or from Python 3.13 on by the other
            patched.setattr(os, call, refusing(getattr(os, call)))
        with pytest.raises(PermissionError):
            append(AuditFile(state, FILE_BYTES), [{"what": "start"}])
    file = AuditFile(state, FILE_BYTES)
    assert append(file, [{"what": "start"}]) == ()
    file.close()
    assert not verify_audit(state).broken


def test_a_writer_killed_between_a_new_file_and_its_first_line_leaves_the_chain_whole(state: Path) -> None:
    """The end of the chain is in the file before then."""
    (state / "audit" / f"{LINES + 1:012d}.jsonl").touch()
    file = AuditFile(state, FILE_BYTES)
    assert append(file, records(1, LINES + 1)) == ()
    file.close()
    verdict = verify_audit(state)
    assert (verdict.broken, verdict.end.number) == (None, LINES + 1)


def test_of_a_long_torn_line_the_beginning_is_quoted(state: Path) -> None:
    """Quoted whole, a megabyte made a line that is longer than any that is read back."""
    with files_of(state)[-1].open("ab") as stream:
        stream.write(b"x" * (1 << 20))
    file = AuditFile(state, 1 << 24)
    append(file, [{"what": "enable"}])
    file.close()
    torn = next(record for record in read_audit(state) if record["what"] == "torn line")
    assert torn["torn"] == 400 * "x" and str(1 << 20) in torn["text"] and not verify_audit(state).broken


def test_a_writer_that_is_closed_twice_closes_nobody_else_s_file(tmp_path: Path) -> None:
    file = AuditFile(tmp_path)
    append(file, records(1))
    file.close()
    with (tmp_path / "other").open("wb") as other:  # the number is given again
        file.close()
        assert other.write(b"kept") == 4


@pytest.mark.parametrize("removed", [1, 2, 5])
def test_lines_removed_at_the_end_are_told_at_the_next_start_once(tmp_path: Path, removed: int) -> None:
    file = AuditFile(tmp_path)
    append(file, records(LINES))
    file.close()
    path, lines, _ = find_line(tmp_path, 0)
    path.write_bytes(b"".join(lines[:-removed]))
    file = AuditFile(tmp_path)
    told = [append(file, records(1, LINES + k)) for k in range(3)]
    file.close()
    assert [len(each) for each in told] == [1, 0, 0]
    assert told[0][0].startswith("A352 ") and "lines at its end were removed" in told[0][0]
    assert verify_audit(tmp_path).broken


def test_a_next_file_that_the_disk_refuses_costs_no_line_and_doubles_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What was written is written: a batch that is called failed would be put down again."""
    file, real_open = AuditFile(tmp_path, FILE_BYTES), os.open
    append(file, records(1))

    def refuse(path: Any, flags: int, *more: Any, **others: Any) -> int:
        if flags & os.O_APPEND:
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        return real_open(path, flags, *more, **others)

    with monkeypatch.context() as full:
        full.setattr(os, "open", refuse)
        for record in records(LINES, 2):
            append(file, [record])
    append(file, records(1, LINES + 2))
    file.close()
    assert [record["old"] for record in read_audit(tmp_path)] == list(range(1, LINES + 3))
    assert not verify_audit(tmp_path).broken
    assert [len(path.read_bytes()) > FILE_BYTES for path in audit_files(tmp_path / "audit")] == [True, False]


def test_a_start_behind_files_that_a_broken_disk_has_emptied_goes_on_behind_the_last_line_that_is_left(
    state: Path,
) -> None:
    """Two empty ones, and no start found the end of the chain: nothing was kept any more."""
    *whole, last, newest = audit_files(state / "audit")
    end = [json.loads(line)["n"] for path in whole for line in path.read_bytes().splitlines()][-1]
    for path in (last, newest):
        path.write_bytes(b"")
    file = AuditFile(state, 1 << 20)
    assert [text[:4] for text in append(file, [{"what": "start"}])] == ["A352"]
    file.close()
    told = [fields for fields in read_audit(state) if fields["n"] > end]
    assert [each["what"] for each in told] == ["chain broken", "start"]
    assert verify_audit(state).broken
