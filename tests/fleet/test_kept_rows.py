"""What is finished stays, and only for the same question and the same file."""

import os
from pathlib import Path

import pytest

from gateway.fleet.kept_rows import KeptRows
from gateway.fleet.tasks import Task

TASKS = [Task("a.csv", "1", "2026-11-01", "aa"), Task("b.csv", "1", "2026-11-02", "bb")]
QUESTION = {"verb": "diagnose", "rig": "x"}


def kept(path: Path, question: dict[str, str] | None = None) -> KeptRows:
    return KeptRows(path, question or QUESTION)


def fill(path: Path, *tasks: Task, error_code: str = "") -> None:
    with kept(path) as rows:
        for task in tasks:
            rows.keep({**task.head, "error_code": error_code})


def test_a_row_is_kept_for_its_file_as_it_was_and_for_its_question(tmp_path: Path) -> None:
    fill(tmp_path / "rows.jsonl", TASKS[0])
    assert list(kept(tmp_path / "rows.jsonl").known(TASKS)) == [TASKS[0]]
    changed = Task("a.csv", "1", "2026-11-01", "other bytes")
    assert kept(tmp_path / "rows.jsonl").known([changed]) == {}
    assert kept(tmp_path / "rows.jsonl", QUESTION | {"rig": "y"}).known(TASKS) == {}


def test_an_error_is_tried_again(tmp_path: Path) -> None:
    fill(tmp_path / "rows.jsonl", TASKS[0], error_code="E192")
    assert kept(tmp_path / "rows.jsonl").known(TASKS) == {}


def test_wherever_the_file_is_cut_whole_rows_are_read_and_written_behind(tmp_path: Path) -> None:
    file = tmp_path / "rows.jsonl"
    fill(file, *TASKS)
    whole = file.read_bytes()
    for length in range(len(whole)):
        file.write_bytes(whole[:length])
        known = kept(file).known(TASKS)
        assert list(known) == TASKS[: max(0, whole[:length].count(b"\n") - 1)]
        fill(file, *(task for task in TASKS if task not in known))
        assert list(kept(file).known(TASKS)) == TASKS


def test_a_line_that_is_no_row_is_passed_over(tmp_path: Path) -> None:
    """Of a file that somebody has edited: the verb ended with an internal error."""
    file = tmp_path / "rows.jsonl"
    fill(file, TASKS[0])
    with file.open("a") as stream:
        stream.write('3\n[]\n"a"\nnull\n{"a": 1}\n')
    fill(file, TASKS[1])
    assert list(kept(file).known(TASKS)) == TASKS


def test_what_is_kept_is_on_the_disk_before_it_counts_as_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A power cut takes what was written and not synced: hours of work, also where the file is only begun again."""
    file, on_disk, replaced = tmp_path / "rows.jsonl", dict[int, bytes](), list[bool]()
    sync, replace = os.fsync, Path.replace

    def note_sync(descriptor: int) -> None:
        sync(descriptor)
        if (name := Path(f"/proc/self/fd/{descriptor}")).is_file():
            on_disk[os.fstat(descriptor).st_ino] = name.read_bytes()

    def note_replace(beside: Path, target: Path) -> Path:
        replaced.append(on_disk.get(beside.stat().st_ino) == beside.read_bytes())
        return replace(beside, target)

    monkeypatch.setattr(os, "fsync", note_sync)
    monkeypatch.setattr(Path, "replace", note_replace)
    for task in TASKS:
        with kept(file) as rows:
            rows.keep({**task.head, "error_code": ""})
            assert on_disk.get(file.stat().st_ino) == file.read_bytes()
    assert replaced == [True, True]
