"""What the reader of an audit calls tampering, and what it does not: pieces of lines, other names, another past, growth."""

import json
import os
from hashlib import sha256
from pathlib import Path

import pytest
from click.testing import CliRunner

from gateway.audit import audit_reader
from gateway.audit.audit_file import AuditFile
from gateway.audit.audit_reader import read_audit, verify_audit
from gateway.audit.chain import open_line, seal_line
from gateway.cli.main import command
from tests.audit.appending import append
from tests.audit.test_chain import FILE_BYTES, LINES, files_of, records
from tests.disk.failing_disks import FailingDisk
from tests.disk.watched_disk import watching


def test_a_piece_of_a_line_is_a_note_at_the_end_of_the_last_file_only(state: Path) -> None:
    """In the middle no kill leaves one, although the chain goes on around it."""
    for path in files_of(state):
        data = path.read_bytes()
        path.write_bytes(data + b'{"n": 5, "prev"')
        verdict = verify_audit(state)
        assert (verdict.broken is None, len(verdict.notes)) == (
            (True, 1) if path == files_of(state)[-1] else (False, 0)
        )
        path.write_bytes(data)


def test_an_audit_that_grows_while_it_is_verified_holds(state: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A next file, whose lines the new head knows, begun between two looks."""
    file = AuditFile(state, FILE_BYTES)
    listing = audit_reader.audit_files

    def list_late(folder: Path) -> list[Path]:
        found = listing(folder)
        for record in records(LINES, LINES + 1):
            append(file, [record])
        return found

    monkeypatch.setattr(audit_reader, "audit_files", list_late)
    assert verify_audit(state).broken is None
    file.close()


def test_an_audit_that_begins_while_it_is_verified_holds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its head was looked for before it was there, its lines afterwards."""
    file, looking = AuditFile(tmp_path, FILE_BYTES), audit_reader.read_head

    def look_early(folder: Path) -> object:
        found = looking(folder)
        append(file, records(1))
        return found

    monkeypatch.setattr(audit_reader, "read_head", look_early)
    assert verify_audit(tmp_path).broken is None
    file.close()


def test_an_audit_whose_head_has_named_a_line_of_a_file_that_went_meanwhile_holds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, looking = AuditFile(tmp_path, 500, 2), audit_reader.read_head

    def look_early(folder: Path) -> object:
        found = looking(folder)
        for record in records(12):
            append(file, [record])
        return found

    append(file, records(1))
    monkeypatch.setattr(audit_reader, "read_head", look_early)
    assert verify_audit(tmp_path).broken is None
    file.close()


def test_the_oldest_file_may_go_while_an_audit_is_read_and_no_other_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = AuditFile(tmp_path, 500, 2)
    for record in records(12):
        append(file, [record])
    file.close()
    first, *rest = files_of(tmp_path)
    before, behind = first.with_name("000000000001.jsonl"), first.with_name("000000000099.jsonl")
    monkeypatch.setattr(audit_reader, "audit_files", lambda folder: [before, first, *rest])
    assert verify_audit(tmp_path).broken is None
    assert [record["old"] for record in read_audit(tmp_path) if "old" in record][-1] == 12
    monkeypatch.setattr(audit_reader, "audit_files", lambda folder: [first, *rest, behind])
    broken = verify_audit(tmp_path).broken
    assert broken and (broken.file, broken.text) == (behind.name, "is gone, or leads nowhere")


def test_a_head_that_the_disk_does_not_give_is_not_called_removed(state: Path) -> None:
    with watching(FailingDisk(state, "once", 1)), pytest.raises(OSError, match="Input/output error"):
        verify_audit(state)


@pytest.mark.parametrize("away", [1, -1])
def test_a_file_under_another_number_is_found(state: Path, away: int) -> None:
    path = files_of(state)[1]
    path.rename(path.with_name(f"{int(path.stem) + away:012d}.jsonl"))
    broken = verify_audit(state).broken
    assert broken and "its file is named by" in broken.text


def test_no_line_holds_before_the_first_one_where_that_is_the_break(state: Path) -> None:
    """`audit verify` said that the lines before it hold, and meant those behind it."""
    first, *_ = files_of(state)
    first.unlink()
    verdict = verify_audit(state)
    assert verdict.broken and "no line says that those before it were dropped" in verdict.broken.text
    assert (verdict.broken.line, verdict.lines, verdict.end.number) == (1, 0, 0)


def test_a_first_line_that_is_gone_with_its_file_is_missed(tmp_path: Path) -> None:
    """Of files of one line each: nothing is damaged in what is left, and its numbers go on."""
    file = AuditFile(tmp_path, longest_bytes=1)
    for record in records(3):
        append(file, [record])
    file.close()
    assert verify_audit(tmp_path).broken is None
    files_of(tmp_path)[0].unlink()
    broken = verify_audit(tmp_path).broken
    assert broken and "is number 2, and no line says that those before it were dropped" in broken.text


def test_a_missing_line_is_called_missing_and_one_that_names_none_before_it_replaced(state: Path) -> None:
    """Its number tells where to look for it; a line without the hash before it would vouch for whatever stood there."""
    path = files_of(state)[0]
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:1] + lines[2:]))
    broken = verify_audit(state).broken
    assert broken and (broken.line, broken.text) == (2, "has number 3 after 1: line 2 is missing")
    fields, _ = open_line(lines[1].rstrip())
    body = json.dumps({name: fields[name] for name in fields if name != "prev"})
    seal = sha256(body.encode()).hexdigest()
    path.write_bytes(lines[0] + f'{body[:-1]}, "sha256": "{seal}"}}\n'.encode() + b"".join(lines[2:]))
    broken = verify_audit(state).broken
    assert broken and (broken.line, broken.text) == (2, "does not continue the line before it: that one was replaced")


def test_a_chain_that_is_written_anew_behind_what_was_dropped_is_found(tmp_path: Path) -> None:
    """Its lines hold, and its head too: only the hash of what was dropped tells."""
    file = AuditFile(tmp_path, FILE_BYTES, kept=3)
    for record in records(40):
        append(file, [record])
    file.close()
    end = None
    for path in files_of(tmp_path):
        anew = b""
        for line in path.read_bytes().splitlines():
            fields, own = open_line(line)
            end = end or own._replace(number=own.number - 1, sha256="f" * 64)
            written, end = seal_line({name: fields[name] for name in fields if name not in ("n", "prev")}, end)
            anew += written
        path.write_bytes(anew)
    assert end
    (tmp_path / "audit" / "head").write_text(json.dumps({"n": end.number, "sha256": end.sha256}))
    broken = verify_audit(tmp_path).broken
    assert broken and "no line says that those before it were dropped" in broken.text


@pytest.mark.parametrize(
    ("kind", "what"),
    [("file", "a file"), ("pipe", "a pipe"), ("link", "a link to what is not there")],
)
def test_what_stands_in_the_place_of_the_audit_is_named(tmp_path: Path, kind: str, what: str) -> None:
    """Its gateway writes none there, and "none yet" had its reader wait for one."""
    place = tmp_path / "audit"
    {"file": place.touch, "pipe": lambda: os.mkfifo(place), "link": lambda: place.symlink_to("away")}[kind]()
    for verb in ("show", "verify"):
        told = CliRunner().invoke(command, ["audit", verb, "--state", str(tmp_path)])
        assert told.exit_code == 65
        assert told.stderr.startswith(f"E106 {place}: it is {what}, and no directory")
