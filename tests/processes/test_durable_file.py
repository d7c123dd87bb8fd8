"""A file is whole on the disk before anybody finds it under its name."""

import os
from pathlib import Path

import pytest

from gateway.processes import durable_file
from gateway.processes.durable_file import read_object


def test_a_text_has_its_name_once_it_is_on_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target, synced = tmp_path / "report.html", list[tuple[bool, str]]()
    target.write_text("old")
    monkeypatch.setattr(durable_file, "sync_path", lambda path: synced.append((path.is_dir(), target.read_text())))
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
