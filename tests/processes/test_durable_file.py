"""A file is whole on the disk before anybody finds it under its name, its owner's alone, and changed by one at a time."""

import errno
import os
import stat
from pathlib import Path

import pytest

from gateway.processes import durable_file
from gateway.processes.durable_file import (
    give_all_to_owner,
    lock_directory,
    make_directory,
    read_object,
    replacing_file,
    sync_path,
    write_durably,
)
from gateway.recording.care.keeping import is_being_recorded
from tests.other_kinds import never_waiting, put


def mode_of(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def test_a_text_has_its_name_once_it_is_on_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target, synced = tmp_path / "report.html", list[tuple[bool, str]]()
    target.write_text("old")

    def note(descriptor: int) -> None:
        synced.append((stat.S_ISDIR(os.fstat(descriptor).st_mode), target.read_text()))

    monkeypatch.setattr(os, "fsync", note)
    durable_file.replace_text(target, "new")
    assert synced == [(False, "old"), (True, "new")]
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.parametrize(
    "content", [b"", b"[]", b"3", b'"{}"', b"\xff\xfe", b"[" * 60_000, b'{"a":', b"null", b"\0" * 40]
)
def test_what_is_no_object_is_refused_as_one_kind_of_fault(tmp_path: Path, content: bytes) -> None:
    """Each reader had its own gaps: brackets ended the simulated rig and the watch, a list the list of recordings."""
    (tmp_path / "facts.json").write_bytes(content)
    with pytest.raises(ValueError, match=r"."):
        read_object(tmp_path / "facts.json")


def test_a_file_of_gigabytes_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "facts.json"
    path.touch()
    os.truncate(path, 3 << 30)
    with pytest.raises(OSError, match="no document has"):
        read_object(path)


@pytest.mark.usefixtures("generous_umask")
def test_what_is_made_is_for_its_owner_and_no_stranger(tmp_path: Path) -> None:
    folder = tmp_path / "state" / "calibrations"
    make_directory(folder)
    with lock_directory(folder) as descriptor:
        write_durably(descriptor, "0001.yaml", b"number: 1\n")
    assert [mode_of(path) for path in (folder.parent, folder)] == [0o700, 0o700]
    assert mode_of(folder / "0001.yaml") == 0o640


def test_a_disk_that_takes_half_has_taken_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It says so by what `write` returns, and by no error."""
    write = os.write
    monkeypatch.setattr(durable_file.os, "write", lambda descriptor, data: write(descriptor, data[: len(data) // 2]))
    with lock_directory(tmp_path) as descriptor, pytest.raises(OSError, match="No space left"):
        write_durably(descriptor, "0001.yaml", b"number: 1\n")
    assert list(tmp_path.iterdir()) == []


def test_who_would_change_something_does_not_go_on_without_the_lock_and_a_reader_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its holder may be stopped by Ctrl-Z, or hang in a disk, for good."""
    monkeypatch.setattr(durable_file, "_WRITER_BOUND_S", 0.0)
    monkeypatch.setattr(durable_file, "_READER_BOUND_S", 0.0)
    with lock_directory(tmp_path):
        with pytest.raises(OSError, match="another program has kept it locked") as refused, lock_directory(tmp_path):
            raise AssertionError("two change it at once")
        with lock_directory(tmp_path, shared=True):
            assert list(tmp_path.iterdir()) == []
    assert refused.value.errno == errno.EBUSY


def test_two_who_read_do_not_wait_for_each_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A start beside `calibration list`, or beside a reader that is stopped, would be two seconds later."""

    def wait(seconds: float) -> None:
        raise AssertionError("it waits")

    monkeypatch.setattr(durable_file.time, "sleep", wait)
    with lock_directory(tmp_path, shared=True) as one, lock_directory(tmp_path, shared=True) as other:
        assert one != other


def refused(*_: object, **__: object) -> None:
    raise OSError(errno.EIO, "Input/output error")


def test_what_its_folder_did_not_take_is_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Else a number that was refused would be found at the next start."""
    sync, syncs = os.fsync, iter([False, True])
    monkeypatch.setattr(durable_file.os, "fsync", lambda descriptor: refused() if next(syncs) else sync(descriptor))
    with lock_directory(tmp_path) as descriptor, pytest.raises(OSError, match="Input/output"):
        write_durably(descriptor, "0001.yaml", b"number: 1\n")
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_may_not_outlive_a_power_cut_is_not_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(durable_file, "sync_path", refused)
    with pytest.raises(OSError, match="Input/output"):
        make_directory(tmp_path / "calibrations")
    assert list(tmp_path.iterdir()) == []


def test_a_text_that_is_not_taken_leaves_nothing_beside_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "report.html").write_text("old")
    monkeypatch.setattr(os, "fsync", refused)
    with pytest.raises(OSError, match="Input/output"):
        durable_file.replace_text(tmp_path / "report.html", "new")
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("report.html", "old")]


def test_what_a_killed_writer_has_left_of_a_file_of_people_s_is_used_again(tmp_path: Path) -> None:
    target = tmp_path / "kept.tar.gz"
    for number in (0, 1):
        (tmp_path / f".kept.tar.gz.{number}.part").write_bytes(b"gigabytes, half of them")
    with replacing_file(target) as first, replacing_file(target) as second:
        first.write(b"one")
        second.write(b"another")
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("kept.tar.gz", b"one")]


def test_what_the_second_of_two_killed_writers_has_left_goes_with_the_next_file(tmp_path: Path) -> None:
    """It stayed until two wrote at once again. What belongs to another file, or to who is at it now, stays."""
    for name in (".kept.1.part", ".kept.7.part", ".kept.x.1.part", ".kept.x.part"):
        (tmp_path / name).write_bytes(b"half of it")
    with replacing_file(tmp_path / "kept") as slow:
        with replacing_file(tmp_path / "kept") as quick:
            slow.write(b"slow")
            quick.write(b"quick")
        assert (tmp_path / "kept").read_bytes() == b"quick"
    found = sorted((path.name, path.read_bytes()) for path in tmp_path.iterdir())
    assert found == [(".kept.x.1.part", b"half of it"), (".kept.x.part", b"half of it"), ("kept", b"slow")]


def test_two_that_write_one_file_at_once_mix_nothing(tmp_path: Path) -> None:
    """Each `report` had the same name beside it."""
    target = tmp_path / "support.tar.gz"
    slow = replacing_file(target)
    stream = slow.__enter__()
    stream.write(b"slow " * 9000)
    with replacing_file(target) as quick:
        quick.write(b"quick")
    assert target.read_bytes() == b"quick"
    stream.write(b"end")
    slow.__exit__(None, None, None)
    assert target.read_bytes() == b"slow " * 9000 + b"end"
    assert list(tmp_path.iterdir()) == [target]


def test_no_link_is_followed_to_a_file_of_somebody_s(tmp_path: Path) -> None:
    (tmp_path / "precious").write_text("kept")
    (tmp_path / ".report.html.0.part").symlink_to(tmp_path / "precious")
    with pytest.raises(OSError, match="symbolic links"):
        durable_file.replace_text(tmp_path / "report.html", "new")
    assert (tmp_path / "precious").read_text() == "kept"


def test_what_a_killed_writer_has_left_is_no_part_of_the_next_file(tmp_path: Path) -> None:
    (tmp_path / "0001.yaml.new").write_bytes(b"number: 1\npoints: a longer file\n")
    with lock_directory(tmp_path) as descriptor:
        write_durably(descriptor, "0001.yaml", b"number: 1\n")
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("0001.yaml", b"number: 1\n")]


@pytest.fixture
def given(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, int]]:
    """To whom files were given by root, which we play: all of ours are its own, and a folder another user's."""
    real, given = os.fstat, list[tuple[int, int]]()

    def fstat(descriptor: int) -> os.stat_result:
        found = real(descriptor)
        owner = (501, 502) if stat.S_ISDIR(found.st_mode) and not given else (0, 0)
        return os.stat_result((*found[:4], *owner, *found[6:]))

    monkeypatch.setattr(os, "geteuid", lambda: 0)
    monkeypatch.setattr(durable_file.os, "fstat", fstat)
    monkeypatch.setattr(durable_file.os, "fchown", lambda descriptor, *owner: given.append(owner))
    return given


def test_what_root_writes_for_a_service_is_the_service_s(tmp_path: Path, given: list[tuple[int, int]]) -> None:
    """A calibration that an administrator had put in use could not be read by the service, which went on with another."""
    with lock_directory(tmp_path) as descriptor:
        write_durably(descriptor, "active.000002", b"x")
    assert given == [(501, 502)]


def test_what_a_link_leads_to_is_given_to_nobody(tmp_path: Path, given: list[tuple[int, int]]) -> None:
    (tmp_path / "elsewhere").write_bytes(b"")
    (tmp_path / "active.000002.new").symlink_to(tmp_path / "elsewhere")
    with lock_directory(tmp_path) as descriptor:
        write_durably(descriptor, "active.000002", b"x")
    assert given == []


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a folder away")
def test_a_folder_that_root_makes_is_that_of_whose_state_it_is_in(tmp_path: Path) -> None:
    os.chown(tmp_path, 501, 502)
    make_directory(tmp_path / "reference")
    with lock_directory(tmp_path / "reference") as descriptor:
        write_durably(descriptor, "reference.json", b"{}")
    for path in (tmp_path / "reference", tmp_path / "reference" / "reference.json"):
        assert (path.stat().st_uid, path.stat().st_gid) == (501, 502)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a folder away")
def test_all_that_root_has_left_in_a_folder_of_somebody_is_theirs_and_nothing_else_is(tmp_path: Path) -> None:
    state, elsewhere = tmp_path / "state", tmp_path / "elsewhere"
    (state / "recordings").mkdir(parents=True)
    for path in (elsewhere, state / "events.jsonl", state / "recordings" / "0001.fgr", state / "second-name"):
        path.write_bytes(b"")
    (state / "link").symlink_to(elsewhere)
    (state / "second-name").unlink()
    (state / "second-name").hardlink_to(elsewhere)
    give_all_to_owner(state)
    assert state.stat().st_uid == (state / "events.jsonl").stat().st_uid == 0, "root's own stays root's"
    os.chown(state, 501, 502)
    give_all_to_owner(state)
    given = [path for path in state.rglob("*") if (path.lstat().st_uid, path.lstat().st_gid) == (501, 502)]
    assert sorted(path.name for path in given) == ["0001.fgr", "events.jsonl", "recordings"]
    assert elsewhere.stat().st_uid == 0
    (state / "of another rig").mkdir()
    give_all_to_owner(state / "of another rig")
    assert (state / "of another rig").stat().st_uid == 501
    give_all_to_owner(tmp_path / "none" / "none")


def test_a_pipe_in_place_of_what_is_synced_or_asked_is_not_waited_for(tmp_path: Path) -> None:
    """The thread that syncs would have hung with it, and the gateway's end."""
    pipe = put("a pipe", tmp_path / "0001.fgr")
    with never_waiting():
        with pytest.raises(OSError, match="Invalid argument"):
            sync_path(pipe)
        assert not is_being_recorded(pipe)
