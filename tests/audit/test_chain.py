"""Nobody alters the audit unseen, and a kill or a power cut is not called tampering."""

import errno
import json
import os
import random
import signal
import subprocess
import sys
from hashlib import sha256
from pathlib import Path

import pytest
from click.testing import CliRunner

from gateway.audit.audit_file import AuditFile, audit_files, read_head
from gateway.audit.audit_reader import read_audit, verify_audit
from gateway.audit.chain import BrokenLine, ChainEnd, check_link, open_line, seal_line
from gateway.cli.main import command
from tests.audit.appending import append

LINES = 14
FILE_BYTES = 1200  # so that the lines are in several files


def records(count: int, first: int = 1) -> list[dict]:
    return [
        {"what": "force_setpoint", "old": k, "new": k + 1.5, "peer": "10.0.0.5:4711"}
        for k in range(first, first + count)
    ]


def files_of(state: Path) -> list[Path]:
    return audit_files(state / "audit")


def test_an_audit_holds_across_its_files(state: Path) -> None:
    verdict = verify_audit(state)
    assert (verdict.lines, verdict.end.number, verdict.broken, verdict.notes) == (LINES, LINES, None, ())
    assert len(files_of(state)) >= 3
    assert [record["old"] for record in read_audit(state)] == list(range(1, LINES + 1))
    assert files_of(state)[0].stat().st_mode & 0o777 == 0o600


def test_any_byte_that_is_changed_is_found_where_it_is(state: Path) -> None:
    rng = random.Random(13)
    for path in files_of(state):
        data = path.read_bytes()
        for place in [0, len(data) - 1, *(rng.randrange(len(data)) for _ in range(60))]:
            changed = bytearray(data)
            changed[place] ^= 1 << rng.randrange(8)
            path.write_bytes(changed)
            broken = verify_audit(state).broken
            assert broken, (path.name, place)
            assert broken.file == path.name or data[place : place + 1] == b"\n"
            assert broken.line in (0, data[:place].count(b"\n") + 1) or data[place : place + 1] == b"\n"
        path.write_bytes(data)
    assert not verify_audit(state).broken


@pytest.mark.parametrize("line", range(LINES))
def test_any_line_that_is_removed_is_missed(state: Path, line: int) -> None:
    path, lines, place = find_line(state, line)
    path.write_bytes(b"".join(lines[:place] + lines[place + 1 :]))
    assert verify_audit(state).broken


@pytest.mark.parametrize("line", range(LINES - 1))
def test_lines_that_are_swapped_and_lines_that_are_doubled_are_found(state: Path, line: int) -> None:
    path, lines, place = find_line(state, line)
    doubled = [*lines[: place + 1], *lines[place:]]
    for other in [doubled] + ([swap(lines, place)] if place + 1 < len(lines) else []):
        path.write_bytes(b"".join(other))
        assert verify_audit(state).broken


@pytest.mark.parametrize("place", [0, 1, -1])
def test_a_file_that_is_removed_is_missed(state: Path, place: int) -> None:
    files_of(state)[place].unlink()
    assert verify_audit(state).broken


def test_a_tail_that_is_written_anew_is_found_by_the_head(state: Path) -> None:
    """The chain itself holds: only the head knows another last line."""
    replace_last_line(state)
    broken = verify_audit(state).broken
    assert broken and "written anew" in broken.text


def replace_last_line(state: Path) -> None:
    """Put another line where the last one was, as who knows how would."""
    path, lines, place = find_line(state, LINES - 1)
    _, before = open_line(lines[place - 1].rstrip(b"\n"))
    path.write_bytes(b"".join([*lines[:place], seal_line({"what": "force_setpoint", "new": 0.0}, before)[0]]))


def test_a_missing_head_is_told(state: Path) -> None:
    (state / "audit" / "head").unlink()
    broken = verify_audit(state).broken
    assert broken and (broken.file, broken.line) == ("head", 0)


def test_a_line_cut_anywhere_is_told_apart_from_tampering_and_the_chain_goes_on(state: Path) -> None:
    """As a killed writer or a power cut leaves it: the head does not know that line yet."""
    path = files_of(state)[-1]
    before, head = path.read_bytes(), (state / "audit" / "head").read_bytes()
    file = AuditFile(state, 1 << 20)
    append(file, [{"what": "enable"}])
    file.close()
    written = path.read_bytes()
    for cut in range(len(before) + 1, len(written), 7):
        path.write_bytes(written[:cut])
        (state / "audit" / "head").write_bytes(head)
        verdict = verify_audit(state)
        assert not verdict.broken and "incomplete line" in verdict.notes[0]
        file = AuditFile(state, 1 << 20)
        append(file, [{"what": "disable"}])
        file.close()
        assert not verify_audit(state).broken
        last_two = [record["what"] for record in read_audit(state)][-2:]
        assert last_two == ["torn line", "disable"]
        path.write_bytes(before)


def test_half_a_line_that_a_full_disk_took_and_kept_is_gone_before_the_next(
    state: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, write, room = AuditFile(state, 10 * FILE_BYTES), os.write, [20]
    append(file, records(1, 15))

    def fill(descriptor: int, data: bytes) -> int:
        if not room:
            raise OSError(errno.ENOSPC, "full")
        return write(descriptor, data[: room.pop()])

    def refuse(descriptor: int, length: int) -> None:
        raise OSError(errno.EIO, "broken")

    with monkeypatch.context() as full:
        full.setattr(os, "write", fill)
        full.setattr(os, "ftruncate", refuse)
        with pytest.raises(OSError, match="full"):
            append(file, records(1, 16))
    append(file, records(1, 16))
    file.close()
    assert (verify_audit(state).broken, verify_audit(state).end.number) == (None, 16)


def test_lines_cut_off_at_the_end_are_tampering_and_a_new_start_hides_nothing(state: Path) -> None:
    path, lines, place = find_line(state, LINES - 1)
    path.write_bytes(b"".join(lines[:place]))
    assert "the end was removed" in verify_audit(state).broken.text  # type: ignore[union-attr]
    file = AuditFile(state, 1 << 20)
    append(file, [{"what": "enable"}])
    file.close()
    assert verify_audit(state).broken
    assert any(str(record.get("text", "")).startswith("A352 ") for record in read_audit(state))


def test_old_files_go_and_the_chain_says_so(tmp_path: Path) -> None:
    file = AuditFile(tmp_path, FILE_BYTES, kept=3)
    for record in records(40):
        append(file, [record])
    file.close()
    verdict = verify_audit(tmp_path)
    assert len(files_of(tmp_path)) == 3 and not verdict.broken
    assert verdict.lines < verdict.end.number
    files_of(tmp_path)[0].unlink()
    assert verify_audit(tmp_path).broken, "what is removed by hand is not what was dropped"


def test_an_old_file_stays_until_the_line_that_says_so_is_on_the_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a disk that is full just then: gone first, it would be missed for ever, and taken for tampering."""
    file, write = AuditFile(tmp_path, FILE_BYTES, kept=3), os.write

    def refuse(descriptor: int, data: bytes) -> int:
        if b'"what": "dropped"' in data:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(descriptor, data)

    monkeypatch.setattr("gateway.audit.audit_file.os.write", refuse)
    for record in records(20):
        append(file, [record])
    assert len(files_of(tmp_path)) > 3 and verify_audit(tmp_path).broken is None
    monkeypatch.undo()
    for record in records(20, 21):
        append(file, [record])
    file.close()
    assert len(files_of(tmp_path)) == 3 and verify_audit(tmp_path).broken is None


def test_a_full_audit_with_an_altered_old_file_goes_on_and_keeps_it(tmp_path: Path) -> None:
    file = AuditFile(tmp_path, FILE_BYTES, kept=3)
    for record in records(LINES):
        append(file, [record])
    oldest = files_of(tmp_path)[0]
    oldest.write_bytes(oldest.read_bytes()[:-5] + b"\n")
    for record in records(30):
        append(file, [record])
    file.close()
    assert oldest.exists()
    assert len(list(read_audit(tmp_path))) >= 8


@pytest.mark.parametrize(
    "body", [b"[1", b'{"n": "x"', b'{"what": "dropped"', b'{"n": 1, "prev": "", "what": "dropped"']
)
def test_a_line_with_a_good_hash_that_says_nothing_is_a_break_and_no_crash(tmp_path: Path, body: bytes) -> None:
    (tmp_path / "audit").mkdir()
    own = sha256(body + b"}").hexdigest().encode()
    (tmp_path / "audit" / "000000000001.jsonl").write_bytes(body + b', "sha256": "' + own + b'"}\n')
    assert verify_audit(tmp_path).broken
    file = AuditFile(tmp_path)
    append(file, records(1))
    file.close()
    assert [record for record in read_audit(tmp_path) if record.get("old") == 1]


def test_a_writer_that_is_killed_leaves_a_chain(tmp_path: Path) -> None:
    program = (
        "import sys; from pathlib import Path; from gateway.audit.audit_file import AuditFile\n"
        "file = AuditFile(Path(sys.argv[1]), 2000)\n"
        "for k in range(100000):\n    record = [{'what': 'force_setpoint', 'new': k}]\n"
        "    if not (written := file.write(record)):\n        file.sync(place)\n        written = file.write(record)\n"
        "    place = written.place\n    print(k, flush=True)\n"
    )
    writer = subprocess.Popen([sys.executable, "-c", program, str(tmp_path)], stdout=subprocess.PIPE, text=True)
    assert writer.stdout
    told = [writer.stdout.readline() for _ in range(25)]
    os.kill(writer.pid, signal.SIGKILL)
    told += writer.stdout.readlines()
    writer.stdout.close()
    writer.wait()
    verdict = verify_audit(tmp_path)
    assert not verdict.broken
    assert verdict.lines >= len([line for line in told if line.endswith("\n")])


def test_the_verbs_show_and_verify(state: Path) -> None:
    run = CliRunner().invoke
    good = run(command, ["audit", "verify", "--state", str(state)])
    assert good.exit_code == 0 and good.output.startswith("14 lines hold, up to line 14, sha256 ")
    shown = run(command, ["audit", "show", "--json", "--peer", "10.0.0.5", "--state", str(state)])
    assert [json.loads(line)["n"] for line in shown.output.splitlines()] == list(range(1, LINES + 1))
    assert "2 -> 3.5" in run(command, ["audit", "show", "--state", str(state)]).output
    path, lines, place = find_line(state, 5)
    path.write_bytes(b"".join([*lines[:place], lines[place].replace(b"10.0.0.5", b"10.0.0.6"), *lines[place + 1 :]]))
    bad = run(command, ["audit", "verify", "--state", str(state)])
    assert bad.exit_code == 1
    assert bad.stderr.startswith(f"E170 {path.name} line {place + 1} was changed: its own hash does not fit")


def test_a_number_that_no_json_has_makes_no_line() -> None:
    """Python reads its own NaN again, and nobody else would."""
    with pytest.raises(ValueError, match="JSON"):
        seal_line({"what": "force_setpoint", "new": float("nan")}, ChainEnd())


def test_a_folder_without_an_audit_is_told_and_no_internal_error(tmp_path: Path) -> None:
    (tmp_path / "audit").mkdir()
    told = CliRunner().invoke(command, ["audit", "verify", "--state", str(tmp_path)])
    assert (told.exit_code, "no audit there yet" in told.stderr) == (65, True)


def find_line(state: Path, number: int) -> tuple[Path, list[bytes], int]:
    """The file of a line (from 0), all its lines, and its place among them."""
    for path in files_of(state):
        lines = path.read_bytes().splitlines(keepends=True)
        if number < len(lines):
            return path, lines, number
        number -= len(lines)
    raise LookupError(number)


def swap(lines: list[bytes], place: int) -> list[bytes]:
    return [*lines[:place], lines[place + 1], lines[place], *lines[place + 2 :]]


def test_a_head_of_nothing_but_brackets_keeps_no_audit_from_being_stored(tmp_path: Path) -> None:
    (tmp_path / "audit").mkdir()
    (tmp_path / "audit" / "head").write_text("[" * 50_000)
    assert read_head(tmp_path / "audit") is None


@pytest.mark.parametrize(("number", "told"), [(9, "line 6 is missing"), (5, "wrong place"), (2, "wrong place")])
def test_a_line_that_does_not_follow_says_what_is_missing(number: int, told: str) -> None:
    with pytest.raises(BrokenLine, match=f"has number {number} after 5: .*{told}"):
        check_link({"n": number, "prev": "x"}, ChainEnd(5, "x"))
