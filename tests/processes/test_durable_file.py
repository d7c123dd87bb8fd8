"""A file is whole on the disk before anybody finds it under its name."""

from pathlib import Path

import pytest

from gateway.processes import durable_file


def test_a_text_has_its_name_once_it_is_on_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target, synced = tmp_path / "report.html", list[tuple[bool, str]]()
    target.write_text("old")
    monkeypatch.setattr(durable_file, "sync_path", lambda path: synced.append((path.is_dir(), target.read_text())))
    durable_file.replace_text(target, "new")
    assert synced == [(False, "old"), (True, "new")]
    assert list(tmp_path.iterdir()) == [target]
