"""An archive by itself: on the disk before it has its name, its content before it is the state, and checked both ways."""

import io
import os
import tarfile
from pathlib import Path

import pytest

from gateway.cli import state_archive
from gateway.cli.state_archive import ArchiveError, pack, unpack


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
    monkeypatch.setattr(state_archive.os, "fsync", lambda descriptor: synced.append(("file", target.exists())))
    monkeypatch.setattr(state_archive, "sync_path", lambda path: synced.append((path.name, target.exists())))
    pack(state, target)
    assert synced == [("file", False), (tmp_path.name, True)]


def test_what_is_restored_is_on_the_disk_before_it_is_the_state(
    state: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pack(state, tmp_path / "b.tar.gz")
    fresh, synced = tmp_path / "new", list[tuple[str, bool]]()
    monkeypatch.setattr(state_archive, "sync_path", lambda path: synced.append((path.name, fresh.exists())))
    unpack(tmp_path / "b.tar.gz", fresh)
    names = ["calibrations", "0001.yaml", "state"]
    assert synced == [*((name, False) for name in names), (tmp_path.name, True)]


@pytest.mark.parametrize("manifest", [b'{"format": 2}', b'{"format": "1"}', b'{"format": []}'])
def test_an_archive_of_another_form_is_not_guessed_at(tmp_path: Path, manifest: bytes) -> None:
    source = archive_of(tmp_path / "b.tar.gz", manifest, "state/0001.yaml")
    with pytest.raises(ArchiveError, match="this version reads 1"):
        unpack(source, tmp_path / "new")
    assert os.listdir(tmp_path) == ["b.tar.gz"]  # noqa: PTH208


def test_who_unpacks_need_not_have_looked_before(tmp_path: Path) -> None:
    source = archive_of(tmp_path / "b.tar.gz", b'{"format": 1}', "state/good", "state/../../evil")
    with pytest.raises(ArchiveError, match="which no backup does"):
        unpack(source, tmp_path / "new")
    assert os.listdir(tmp_path) == ["b.tar.gz"]  # noqa: PTH208
