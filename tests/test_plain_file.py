"""Whatever stands where a plain file belongs is refused at once, by what it is, and neither made, changed nor waited for."""

import os
import stat
from collections.abc import Callable
from pathlib import Path

import pytest

from gateway import plain_file
from gateway.plain_file import (
    check_plain,
    exists,
    is_directory,
    is_file,
    open_plain,
    open_plain_stream,
    other_kind,
    read_plain,
)
from gateway.profiles.find import locate
from tests.other_kinds import MAKERS, never_waiting, put

DOORS: dict[str, Callable[[Path], object]] = {
    "check": check_plain,
    "read": read_plain,
    "stream": open_plain_stream,
    "append": lambda path: open_plain(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT),
    "anew": lambda path: open_plain(path, os.O_WRONLY | os.O_TRUNC | os.O_CREAT),
}


@pytest.mark.parametrize("door", DOORS)
@pytest.mark.parametrize("kind", MAKERS)
def test_what_is_no_plain_file_is_refused_by_its_kind_and_place(door: str, kind: str, tmp_path: Path) -> None:
    path = put(kind, tmp_path / "file")
    with never_waiting(), pytest.raises(OSError, match=kind) as refused:
        DOORS[door](path)
    assert refused.value.filename == str(path)
    assert isinstance(refused.value, IsADirectoryError) == (kind == "a directory")
    assert other_kind(path) == kind


def test_what_the_kernel_shows_as_a_file_is_none() -> None:
    """Whoever named /proc/kmsg waited for the next line of the kernel's log."""
    path = Path("/proc/self/status")
    for door in DOORS.values():
        with pytest.raises(OSError, match="a part of /proc"):
            door(path)
    assert other_kind(path) == "a part of /proc" and other_kind(__file__) == ""
    with pytest.raises(FileNotFoundError, match="is a part of /proc, and no rig file"):
        locate("rig", str(path))


def test_where_nothing_is_mounted_at_proc_a_file_is_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a bare chroot /proc is a folder on the disk of all files: each of them was refused, and no gateway began."""
    monkeypatch.setattr(plain_file, "_PROC", str(tmp_path))
    monkeypatch.setattr(plain_file, "_device_of_proc", plain_file._device_of_proc.__wrapped__)
    path = tmp_path / "file"
    path.write_bytes(b"1")
    assert read_plain(path) == b"1" and other_kind(path) == ""


@pytest.mark.parametrize("kind", MAKERS)
def test_what_takes_a_files_place_behind_its_check_is_refused_and_let_go(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"whole")
    opened, count = os.open, len(list(Path("/proc/self/fd").iterdir()))

    def exchange(name: Path, flags: int, *rest: int, **where: int | None) -> int:
        put(kind, path)
        return opened(name, flags, *rest, **where)

    monkeypatch.setattr(os, "open", exchange)
    with never_waiting(), pytest.raises(OSError, match=f"{kind}|No such device"):
        open_plain(path)
    assert len(list(Path("/proc/self/fd").iterdir())) == count


def test_a_plain_file_is_read_written_and_made_as_ever(tmp_path: Path) -> None:
    path = tmp_path / "file"
    with pytest.raises(FileNotFoundError):
        read_plain(path)
    descriptor = open_plain(path, os.O_WRONLY | os.O_CREAT, 0o640)
    os.write(descriptor, b"whole")
    assert not os.get_inheritable(descriptor)
    os.close(descriptor)
    assert stat.S_IMODE(path.stat().st_mode) & ~0o640 == 0
    assert read_plain(path) == b"whole"
    assert other_kind(path) == ""
    check_plain(path)


def test_a_name_in_an_open_folder_is_opened_there(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"whole")
    folder = os.open(tmp_path, os.O_RDONLY | os.O_DIRECTORY)
    descriptor = open_plain("file", directory=folder)
    assert os.read(descriptor, 9) == b"whole"
    os.close(descriptor)
    os.close(folder)


def test_what_has_a_name_is_told_by_its_kind_and_nothing_is_there_for_a_name_of_none(tmp_path: Path) -> None:
    file, round_about = tmp_path / "rig.yaml", tmp_path / "round"
    file.touch()
    round_about.symlink_to(round_about)
    asked = {tmp_path: (True, True, False), file: (True, False, True)}
    nothing = (tmp_path / "gone", file / "below", round_about, Path("a\0b"))
    asked |= dict.fromkeys(nothing, (False, False, False))
    assert {path: (exists(path), is_directory(path), is_file(path)) for path in asked} == asked


@pytest.mark.parametrize("ask", [exists, is_directory, is_file])
def test_where_a_disk_does_not_say_nobody_says_no(ask: Callable[[Path], bool], tmp_path: Path) -> None:
    """pathlib does, from Python 3.14 on: a run that may press still would be taken for one that has ended."""
    with pytest.raises(OSError, match="too long"):
        ask(tmp_path / ("x" * 300))
