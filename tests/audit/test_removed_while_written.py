"""An audit that somebody removes, moves or replaces under the gateway: it goes on where it is found, and both say so."""

import errno
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from gateway.audit import audit_file
from gateway.audit.audit_file import AuditFile, audit_files
from gateway.audit.audit_reader import read_audit, verify_audit
from tests.audit.appending import append


def newest(state: Path) -> Path:
    return audit_files(state / "audit")[-1]


def remove_folder(state: Path) -> None:
    shutil.rmtree(state / "audit")


def remove_file(state: Path) -> None:
    newest(state).unlink()


def rotate_file(state: Path) -> None:
    newest(state).rename(newest(state).with_suffix(".jsonl.1"))


def edit_file(state: Path) -> None:
    """Most editors write another file and give it the name."""
    text = newest(state).read_bytes()
    newest(state).unlink()
    newest_again = state / "audit" / "000000000001.jsonl"
    newest_again.with_suffix(".new").write_bytes(text.replace(b'"old": 1', b'"old": 2'))
    newest_again.with_suffix(".new").rename(newest_again)


@pytest.fixture
def written(tmp_path: Path) -> AuditFile:
    file = AuditFile(tmp_path, 1 << 20)
    append(file, [{"what": "start"}, {"what": "force_setpoint", "old": 1}])
    return file


def whats(state: Path) -> list[str]:
    return [str(fields["what"]) for fields in read_audit(state)]


@pytest.mark.parametrize("how", [remove_folder, remove_file, rotate_file, edit_file])
def test_what_is_written_later_is_found(tmp_path: Path, written: AuditFile, how: Callable[[Path], None]) -> None:
    """Until its next start the gateway wrote into a file that nobody could open any more, and told nobody."""
    how(tmp_path)
    (told,) = append(written, [{"what": "enable"}])
    assert told.startswith("A352") and "up to 2 " in told
    assert whats(tmp_path)[-2:] == ["chain broken", "enable"]
    assert append(written, [{"what": "disable"}]) == ()
    written.close()
    verdict = verify_audit(tmp_path)
    assert verdict.broken, "what is gone does not look as if it had never been"
    again = AuditFile(tmp_path, 1 << 20)
    assert append(again, [{"what": "start"}]) == (), "and the next start finds the end as it was left"
    again.close()
    assert whats(tmp_path)[-3:] == ["enable", "disable", "start"]


def test_nothing_that_moves_the_file_back_is_an_alteration(tmp_path: Path, written: AuditFile) -> None:
    newest(tmp_path).rename(tmp_path / "aside")
    (tmp_path / "aside").rename(tmp_path / "audit" / "000000000001.jsonl")
    assert append(written, [{"what": "enable"}]) == ()
    written.close()
    assert verify_audit(tmp_path).broken is None


def test_a_disk_that_refuses_meanwhile_hides_nothing(
    tmp_path: Path, written: AuditFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    remove_folder(tmp_path)
    with monkeypatch.context() as patched:
        patched.setattr(audit_file.os, "fsync", refuse)
        for _ in range(2):
            with pytest.raises(OSError, match="No space"):
                append(written, [{"what": "enable"}])
    (told,) = append(written, [{"what": "enable"}])
    written.close()
    assert told.startswith("A352") and whats(tmp_path) == ["chain broken", "enable"]


def test_a_state_directory_that_was_moved_away_is_not_begun_anew(tmp_path: Path) -> None:
    """Whoever moved it may want to move it back."""
    state = tmp_path / "state"
    file = AuditFile(state, 1 << 20)
    append(file, [{"what": "start"}])
    state.rename(tmp_path / "elsewhere")
    with pytest.raises(FileNotFoundError):
        append(file, [{"what": "enable"}])
    assert not state.exists()
    (tmp_path / "elsewhere").rename(state)
    assert append(file, [{"what": "enable"}]) == ()
    file.close()
    assert whats(state) == ["start", "enable"]


def test_what_was_removed_is_told_by_the_first_line_that_the_disk_takes(
    tmp_path: Path, written: AuditFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Removed and full at once, as by somebody who makes room: the batch comes again, and what goes before it does, too."""
    remove_file(tmp_path)
    with monkeypatch.context() as full:
        full.setattr(audit_file.os, "write", lambda *_: (_ for _ in ()).throw(OSError(errno.ENOSPC, "full")))
        with pytest.raises(OSError, match="full"):
            append(written, [{"what": "enable"}])
    (told,) = append(written, [{"what": "enable"}])
    written.close()
    assert told.startswith("A352") and whats(tmp_path)[-2:] == ["chain broken", "enable"]


def test_what_a_power_cut_may_take_is_synced_before_anybody_relies_on_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A head that is renamed before its bytes are on the disk may be empty then, and a new file may have no name."""
    synced: list[str] = []
    sync, replace = os.fsync, Path.replace

    def note(descriptor: int) -> None:
        synced.append(Path(f"/proc/self/fd/{descriptor}").readlink().name)
        sync(descriptor)

    def note_replace(path: Path, target: Path) -> Path:
        synced.append(f"{path.name} -> {target.name}")
        return replace(path, target)

    monkeypatch.setattr(os, "fsync", note)
    monkeypatch.setattr(Path, "replace", note_replace)
    file = AuditFile(tmp_path, longest_bytes=1)
    append(file, [{"what": "start"}])
    began = synced.copy()
    synced.clear()
    append(file, [{"what": "enable"}])
    file.close()
    head = ["head.new", "head.new -> head"]
    assert began == [tmp_path.name, *head, "audit", "audit", "000000000001.jsonl", *head]
    assert synced == ["000000000001.jsonl", "audit", "000000000002.jsonl", *head], "and each new file's name"
