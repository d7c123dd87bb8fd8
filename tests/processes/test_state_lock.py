"""A state directory has one user at a time, whatever a hand does to its files meanwhile."""

import errno
import fcntl
import os
from pathlib import Path

import pytest

from gateway.processes import state_lock
from gateway.processes.state_lock import NAME, hold_state_lock


def test_one_at_a_time_and_the_next_one_behind_it(tmp_path: Path) -> None:
    with hold_state_lock(tmp_path) as first:
        with hold_state_lock(tmp_path) as second:
            assert (first, second) == (True, False)
        with hold_state_lock(tmp_path) as third:
            assert not third, "who has not got it gives nothing back"
    with hold_state_lock(tmp_path) as fourth:
        assert fourth


@pytest.mark.parametrize("spoil", [Path.unlink, lambda path: path.rename(path.with_name("moved"))])
def test_a_lock_file_that_is_deleted_or_moved_lets_nobody_else_in(tmp_path: Path, spoil: object) -> None:
    with hold_state_lock(tmp_path) as first:
        spoil(tmp_path / NAME)  # type: ignore[operator]
        with hold_state_lock(tmp_path) as second:
            assert (first, second) == (True, False)


def test_a_file_system_that_locks_no_directories_locks_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flock, calls = fcntl.flock, []

    def refuse_directory(descriptor: int, how: int) -> None:
        calls.append(descriptor)
        if len(calls) % 2 == 0:
            raise OSError(errno.ENOLCK, "No locks available")
        flock(descriptor, how)

    monkeypatch.setattr(fcntl, "flock", refuse_directory)
    with hold_state_lock(tmp_path) as first:
        calls.clear()
        with hold_state_lock(tmp_path) as second:
            assert (first, second) == (True, False)
    monkeypatch.setattr(fcntl, "flock", lambda descriptor, how: refuse_file())
    with pytest.raises(OSError, match="No locks"), hold_state_lock(tmp_path):
        pass


def refuse_file() -> None:
    raise OSError(errno.ENOLCK, "No locks available")


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a folder away")
def test_the_lock_that_an_administrator_leaves_behind_is_the_service_s(tmp_path: Path) -> None:
    """Where root's files are nobody else's (umask 077) a gateway did not start behind a change that root had made."""
    os.chown(tmp_path, 501, 502)
    before = os.umask(0o077)
    try:
        with hold_state_lock(tmp_path) as is_ours:
            assert is_ours
    finally:
        os.umask(before)
    assert (tmp_path / NAME).stat().st_uid == 501


def test_a_disk_that_has_become_read_only_has_the_lock_s_file_still(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is no reason not to control; and where there is no file, there is no lock."""

    def refuse(path: Path, flags: int = os.O_RDONLY, mode: int = 0) -> int:
        if flags & os.O_WRONLY:
            raise OSError(errno.EROFS, "read-only")
        return os.open(path, flags)

    monkeypatch.setattr(state_lock, "open_plain", refuse)
    with pytest.raises(OSError, match="read-only"), hold_state_lock(tmp_path):
        pass
    (tmp_path / NAME).touch()
    with hold_state_lock(tmp_path) as is_ours, hold_state_lock(tmp_path) as is_theirs:
        assert is_ours and not is_theirs
