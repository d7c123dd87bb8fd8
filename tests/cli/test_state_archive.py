"""An archive by itself: on the disk before it has its name, its content before it is the state, and checked both ways."""

import errno
import io
import os
import stat
import tarfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from gateway.cli import state_archive
from gateway.cli.state_archive import ArchiveError, names_in, pack_state, unpack_state
from gateway.processes.durable_file import lock_directory
from gateway.processes.state_directory import place_of_restore


def archive_of(path: Path, manifest: bytes, *names: str) -> Path:
    with tarfile.open(path, "w:gz") as archive:
        for name, data in (("backup.json", manifest), *((name, b"x") for name in names)):
            info = tarfile.TarInfo(name)
            info.size = len(data)
            archive.addfile(info, io.BytesIO(data))
    return path


@pytest.fixture
def state(tmp_path: Path) -> Path:
    (tmp_path / "state" / "calibrations").mkdir(parents=True)
    (tmp_path / "state" / "calibrations" / "0001.yaml").write_text("name: one\n")
    return tmp_path / "state"


def test_a_backup_is_on_the_disk_before_it_has_its_name(
    state: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target, synced = tmp_path / "b.tar.gz", list[tuple[str, bool]]()

    def note(descriptor: int) -> None:
        synced.append(("folder" if stat.S_ISDIR(os.fstat(descriptor).st_mode) else "file", target.exists()))

    monkeypatch.setattr(os, "fsync", note)
    pack_state(state, target)
    assert synced == [("file", False), ("folder", True)]


def test_what_a_killed_restore_has_left_goes_with_the_next_one(state: Path, tmp_path: Path) -> None:
    """A whole state stayed behind each, and nobody's list showed it."""
    pack_state(state, tmp_path / "b.tar.gz")
    left = tmp_path / f".{state.name}.restored" / "state" / "recordings"
    left.mkdir(parents=True)
    (left / "0009.fgr").write_bytes(b"half of it")
    before = unpack_state(tmp_path / "b.tar.gz", state)
    assert before is not None
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(["b.tar.gz", state.name, before.name])
    assert not (state / "recordings").exists()


def test_two_restores_at_once_mix_nothing(state: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pack_state(state, tmp_path / "b.tar.gz")
    monkeypatch.setattr("gateway.processes.durable_file._WRITER_BOUND_S", 0.0)
    at_work = tmp_path / f".{state.name}.restored"
    at_work.mkdir()
    with lock_directory(at_work), pytest.raises(OSError, match="locked"):
        unpack_state(tmp_path / "b.tar.gz", state)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([at_work.name, "b.tar.gz", state.name])


def test_a_restore_whose_place_another_has_taken_before_it_held_it_leaves_it_alone(
    state: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pack_state(state, tmp_path / "b.tar.gz")

    @contextmanager
    def lock_late(place: Path) -> Iterator[int]:
        with lock_directory(place) as descriptor:
            place.rmdir()  # by the other one, which has made it anew
            place.mkdir()
            (place / "state").mkdir()
            yield descriptor

    monkeypatch.setattr(state_archive, "lock_directory", lock_late)
    with pytest.raises(OSError, match="another restore is at work"):
        unpack_state(tmp_path / "b.tar.gz", state)
    assert (place_of_restore(state) / "state").exists()
    assert (state / "calibrations").is_dir()


def test_what_is_restored_is_on_the_disk_before_it_is_the_state(
    state: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pack_state(state, tmp_path / "b.tar.gz")
    fresh, synced = tmp_path / "new", list[tuple[str, bool]]()
    monkeypatch.setattr(state_archive, "sync_path", lambda path: synced.append((path.name, fresh.exists())))
    unpack_state(tmp_path / "b.tar.gz", fresh)
    names = ["calibrations", "0001.yaml", "state"]
    assert synced == [*((name, False) for name in (*names, tmp_path.name)), (tmp_path.name, True)]


@pytest.mark.parametrize("manifest", [b'{"format": 2}', b'{"format": "1"}', b'{"format": []}'])
def test_an_archive_of_another_form_is_not_guessed_at(tmp_path: Path, manifest: bytes) -> None:
    source = archive_of(tmp_path / "b.tar.gz", manifest, "state/0001.yaml")
    with pytest.raises(ArchiveError, match="this version reads 1"):
        unpack_state(source, tmp_path / "new")
    assert os.listdir(tmp_path) == ["b.tar.gz"]  # noqa: PTH208


def test_who_unpacks_need_not_have_looked_before(tmp_path: Path) -> None:
    source = archive_of(tmp_path / "b.tar.gz", b'{"format": 1}', "state/good", "state/../../evil")
    with pytest.raises(ArchiveError, match="which no backup does"):
        unpack_state(source, tmp_path / "new")
    assert os.listdir(tmp_path) == ["b.tar.gz"]  # noqa: PTH208


def test_a_backup_that_fails_leaves_nothing_beside_its_name(
    state: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(state_archive.os, "fsync", fail)
    with pytest.raises(OSError, match="No space"):
        pack_state(state, tmp_path / "b.tar.gz")
    assert os.listdir(tmp_path) == ["state"]  # noqa: PTH208


def test_a_file_that_goes_while_it_is_packed_costs_itself_alone(
    state: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Event files get their next names, and recordings are pruned, while a gateway runs."""
    files = state_archive._files
    monkeypatch.setattr(state_archive, "_files", lambda folder: [*files(folder), folder / "events-7.jsonl"])
    assert pack_state(state, tmp_path / "b.tar.gz") == names_in(tmp_path / "b.tar.gz") == ["calibrations/0001.yaml"]


def test_a_link_stays_behind_or_the_backup_would_be_none(state: Path, tmp_path: Path) -> None:
    """Restoring refuses an archive with a link as a whole."""
    (tmp_path / "elsewhere").write_text("x")
    (state / "link").symlink_to(tmp_path / "elsewhere")
    (state / "folder").symlink_to(tmp_path)
    pack_state(state, tmp_path / "b.tar.gz")
    assert names_in(tmp_path / "b.tar.gz") == ["calibrations/0001.yaml"]


def test_only_the_gateway_s_own_files_are_left_out(state: Path, tmp_path: Path) -> None:
    for folder in (state, state / "calibrations"):
        (folder / "lock").touch()
        (folder / "running").touch()
    assert pack_state(state, tmp_path / "b.tar.gz")[1:] == ["calibrations/lock", "calibrations/running"]


def test_a_restore_that_is_refused_leaves_an_empty_directory_where_it_was(
    state: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pack_state(state, tmp_path / "b.tar.gz")
    (empty := tmp_path / "empty").mkdir()

    def refuse(*_: object) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    with monkeypatch.context() as failing:
        failing.setattr(os, "rename", refuse)
        with pytest.raises(OSError, match="Input/output"):
            unpack_state(tmp_path / "b.tar.gz", empty)
    assert empty.is_dir()
    assert unpack_state(tmp_path / "b.tar.gz", empty) is None
    assert (empty / "calibrations" / "0001.yaml").read_text() == "name: one\n"


def test_an_empty_state_comes_back_empty(tmp_path: Path) -> None:
    (tmp_path / "state").mkdir()
    (tmp_path / "new").mkdir()
    pack_state(tmp_path / "state", tmp_path / "b.tar.gz")
    assert unpack_state(tmp_path / "b.tar.gz", tmp_path / "new") is None
    assert sorted(os.listdir(tmp_path)) == ["b.tar.gz", "new", "state"]  # noqa: PTH208


def test_each_restore_keeps_what_was_there(state: Path, tmp_path: Path) -> None:
    pack_state(state, tmp_path / "b.tar.gz")
    kept = []
    for text in ("one", "two", "three"):
        (state / "mine.txt").write_text(text)
        kept.append(unpack_state(tmp_path / "b.tar.gz", state))
    assert [(folder / "mine.txt").read_text() for folder in kept if folder] == ["one", "two", "three"]


def test_what_was_there_is_there_again_where_the_disk_refuses_the_last_step(
    state: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rename = Path.rename

    def refuse(path: Path, target: Path) -> Path:
        if path.name == "state" and path.parent.name.startswith(".state."):
            raise OSError(5, "Input/output error", str(path))
        return rename(path, target)

    pack_state(state, tmp_path / "b.tar.gz")
    (state / "mine.txt").write_text("mine")
    monkeypatch.setattr(Path, "rename", refuse)
    with pytest.raises(OSError, match="Input/output"):
        unpack_state(tmp_path / "b.tar.gz", state)
    assert (state / "mine.txt").read_text() == "mine"
    assert sorted(os.listdir(tmp_path)) == ["b.tar.gz", "state"]  # noqa: PTH208


@pytest.mark.parametrize(("said", "restored"), [(0, 0o600), (0o640, 0o640), (0o666, 0o644), (0o6777, 0o744)])
def test_its_owner_may_read_what_is_restored_and_nobody_else_write_it_whatever_the_archive_says(
    tmp_path: Path, said: int, restored: int
) -> None:
    source = tmp_path / "b.tar.gz"
    with tarfile.open(source, "w:gz") as archive:
        for name, data, mode in (("backup.json", b'{"format": 1}', 0o600), ("state/shut", b"x", said)):
            info = tarfile.TarInfo(name)
            info.size, info.mode = len(data), mode
            archive.addfile(info, io.BytesIO(data))
    unpack_state(source, tmp_path / "new")
    assert (tmp_path / "new" / "shut").stat().st_mode & 0o7777 == restored
    assert (tmp_path / "new").stat().st_mode & 0o777 == 0o700


def test_damage_that_only_the_checksum_at_the_end_shows_is_found_before_anything_is_replaced(
    state: Path, tmp_path: Path
) -> None:
    pack_state(state, source := tmp_path / "b.tar.gz")
    data = bytearray(source.read_bytes())
    data[-8] ^= 1
    source.write_bytes(data)
    (state / "mine.txt").write_text("mine")
    with pytest.raises(ArchiveError, match="damaged"):
        unpack_state(source, state)
    assert (state / "mine.txt").read_text() == "mine"
    assert sorted(os.listdir(tmp_path)) == ["b.tar.gz", "state"]  # noqa: PTH208


@pytest.mark.parametrize("name", ["state/.", "state/..", "state/lock", "state/control.sock"])
def test_a_name_that_no_backup_has_is_refused(tmp_path: Path, name: str) -> None:
    source = archive_of(tmp_path / "b.tar.gz", b'{"format": 1}', name)
    with pytest.raises(ArchiveError, match="which no backup does"):
        names_in(source)


@pytest.mark.parametrize("was_there", [True, False])
def test_what_root_restores_is_whose_it_was(
    state: Path, tmp_path: Path, was_there: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A service could not open its state behind a restore by its administrator, and did not start."""
    archive, given, real = tmp_path / "b.tar.gz", list[tuple[str, int, int]](), Path.stat
    pack_state(state, archive)
    theirs = state if was_there else tmp_path / "service"

    def stat(path: Path, **options: bool) -> os.stat_result:
        found = real(path, **options)
        return os.stat_result((*found[:4], 501, 502, *found[6:])) if path == theirs else found

    monkeypatch.setattr(Path, "stat", stat)
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    monkeypatch.setattr(os, "chown", lambda path, user, group, **_: given.append((path.name, user, group)))
    (tmp_path / "service").mkdir()
    unpack_state(archive, state if was_there else theirs / "cell")
    assert given == [(name, 501, 502) for name in ("calibrations", "0001.yaml", "state")]


def test_a_file_that_is_replaced_while_it_is_packed_is_whole(
    state: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A gateway puts a calibration in use, or a list of recordings is kept, between measuring the file and opening it."""
    target, real = state / "calibrations" / "0001.yaml", tarfile.TarFile.gettarinfo

    def measure(archive: tarfile.TarFile, *words: object, **named: object) -> tarfile.TarInfo:
        found = real(archive, *words, **named)  # type: ignore[arg-type]
        if found.name.endswith("0001.yaml"):
            (tmp_path / "fresh").write_text("1")
            (tmp_path / "fresh").replace(target)
        return found

    monkeypatch.setattr(tarfile.TarFile, "gettarinfo", measure)
    pack_state(state, tmp_path / "b.tar.gz")
    unpack_state(tmp_path / "b.tar.gz", tmp_path / "again")
    assert (tmp_path / "again" / "calibrations" / "0001.yaml").read_text() == "name: one\n"


def test_a_file_of_two_names_is_restored_as_both(state: Path, tmp_path: Path) -> None:
    """The archive had the second as a link, and was refused as a whole on the day that it was needed."""
    os.link(state / "calibrations" / "0001.yaml", state / "calibrations" / "copy.yaml")
    pack_state(state, tmp_path / "b.tar.gz")
    unpack_state(tmp_path / "b.tar.gz", tmp_path / "again")
    for name in ("0001.yaml", "copy.yaml"):
        assert (tmp_path / "again" / "calibrations" / name).read_text() == "name: one\n"


def test_a_clock_that_is_far_ahead_keeps_nobody_from_a_backup(
    state: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To 2126: gzip has room for a time until 2106."""
    monkeypatch.setattr("time.time", lambda: 4.95e9)
    packed = pack_state(state, tmp_path / "b.tar.gz")
    assert packed == ["calibrations/0001.yaml"]
    assert names_in(tmp_path / "b.tar.gz") == packed
