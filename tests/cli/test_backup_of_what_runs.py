"""A backup of what is written meanwhile, and a restore to where the state is by a link."""

import tarfile
from pathlib import Path
from typing import Any

import pytest

from gateway.audit.audit_file import AuditFile
from gateway.audit.audit_reader import verify_audit
from gateway.cli import state_archive
from gateway.cli.state_archive import pack_state, unpack_state
from tests.audit.appending import append


@pytest.mark.parametrize("name", ["head", "audit", "000000000001.jsonl"])
def test_an_audit_that_goes_on_in_another_file_while_it_is_packed_is_whole(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its files were listed before its head was read, which then named a line of one that was not among them."""
    state, add = tmp_path / "state", state_archive._add
    audit = AuditFile(state, longest_bytes=1)
    append(audit, [{"what": "enable"}])

    def rotates(archive: tarfile.TarFile, path: Path, called: str) -> Any:
        for _ in range(2 if path.name == name else 0):
            append(audit, [{"what": "disable"}])
        add(archive, path, called)

    monkeypatch.setattr(state_archive, "_add", rotates)
    pack_state(state, tmp_path / "b.tar.gz")
    audit.close()
    unpack_state(tmp_path / "b.tar.gz", tmp_path / "restored")
    verdict = verify_audit(tmp_path / "restored")
    assert verdict.broken is None and verdict.lines >= 1


def test_an_audit_that_grows_while_it_is_packed_is_not_taken_for_one_whose_end_was_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its head was packed behind its lines, and named some that had come between: the next start told of manipulation."""
    state, add = tmp_path / "state", state_archive._add
    audit = AuditFile(state)
    append(audit, [{"what": "enable"}])

    def grows(archive: tarfile.TarFile, path: Path, name: str) -> Any:
        add(archive, path, name)
        append(audit, [{"what": "disable"}])

    monkeypatch.setattr(state_archive, "_add", grows)
    pack_state(state, tmp_path / "b.tar.gz")
    audit.close()
    unpack_state(tmp_path / "b.tar.gz", tmp_path / "restored")
    verdict = verify_audit(tmp_path / "restored")
    assert verdict.broken is None and verdict.lines >= 1
    restarted = AuditFile(tmp_path / "restored")
    assert append(restarted, [{"what": "start"}]) == ()
    restarted.close()


def test_a_state_that_is_elsewhere_by_a_link_is_restored_there(tmp_path: Path) -> None:
    """The link was renamed, and the state was on the disk that it had been moved away from."""
    disk, state = tmp_path / "disk" / "cell", tmp_path / "state" / "cell"
    for folder in (disk, state.parent):
        folder.mkdir(parents=True)
    state.symlink_to(disk)
    (disk / "events.jsonl").write_text("before\n")
    pack_state(state, tmp_path / "b.tar.gz")
    (disk / "events.jsonl").write_text("after\n")
    kept = unpack_state(tmp_path / "b.tar.gz", state)
    assert state.is_symlink() and (disk / "events.jsonl").read_text() == "before\n"
    assert kept == disk.with_name("cell.before-restore-1") and (kept / "events.jsonl").read_text() == "after\n"
    assert [path.name for path in state.parent.iterdir()] == ["cell"], "nothing on the other disk"
