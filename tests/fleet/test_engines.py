"""The same rows whoever computes them; a worker that dies takes none with it."""

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple, Self

import pytest

from gateway.fleet.engines import Compute, Engine, cluster, processes, run_serially
from gateway.fleet.tasks import Row, Task, find_tasks
from tests.fleet.workers import count_bytes, die_at_some

pytestmark = pytest.mark.usefixtures("tracker_process")


def folder_of(folder: Path, *texts: str) -> list[Task]:
    for number, text in enumerate(texts):
        place = folder / f"cell={number % 3}" / f"date=2026-11-{number + 1:02d}"
        place.mkdir(parents=True)
        (place / "press.csv").write_text(text)
    return find_tasks([f"{folder}/cell=*/date=*/*.csv"])


def rows_of(engine: Engine, compute: Compute, tasks: list[Task]) -> list[Row]:
    found = dict(engine(compute, tasks))
    assert len(found) == len(tasks)
    return [found[task] for task in tasks]


def test_cell_and_date_are_those_of_the_folders_and_the_order_is_that_of_the_paths(tmp_path: Path) -> None:
    tasks = folder_of(tmp_path, "a", "b", "c", "d")
    assert [(task.cell, task.date[-2:]) for task in tasks] == [("0", "01"), ("0", "04"), ("1", "02"), ("2", "03")]
    assert len({task.sha256 for task in tasks}) == 4


def test_a_link_that_leads_nowhere_is_a_recording_that_cannot_be_read(tmp_path: Path) -> None:
    """It was left out: of a store that was not mounted nothing was told."""
    tasks = folder_of(tmp_path, "a")
    (tmp_path / "cell=0" / "date=2026-11-01" / "away.csv").symlink_to(tmp_path / "not-mounted.csv")
    (tmp_path / "cell=0" / "date=2026-11-01" / "folder.csv").mkdir()
    (away, there) = find_tasks([f"{tmp_path}/cell=*/date=*/*.csv"])
    assert there == tasks[0] and (Path(away.path).name, away.sha256) == ("away.csv", "")
    (row,) = rows_of(run_serially, count_bytes, [away])
    assert (Path(row["file"]).name, row["error_code"]) == ("away.csv", "E403")
    assert "No such file" in row["error"]


def test_processes_give_the_rows_of_one_and_a_death_costs_none(tmp_path: Path) -> None:
    tasks = folder_of(tmp_path, "one", "two two", "unreadable", "once upon a time", "deadly", "six")
    told = rows_of(processes(2), die_at_some, tasks)
    by_file = {Path(row["file"]).read_text(): row for row in told}
    assert by_file.pop("deadly")["error_code"] == "E192"
    others = [task for task in tasks if Path(task.path).read_text() in by_file]
    assert [by_file[Path(task.path).read_text()] for task in others] == rows_of(run_serially, count_bytes, others)
    assert by_file["unreadable"]["error_code"] == "E403"
    assert by_file["once upon a time"]["value_n"] == 16.0
    beside_no_death = folder_of(tmp_path / "again", "unreadable")
    assert [row["error_code"] for row in rows_of(processes(1), count_bytes, beside_no_death)] == ["E403"]


def on_a_cluster(*words: str) -> str:
    """In a process of its own: distributed leaves threads and descriptors to the end of its process."""
    command = [sys.executable, str(Path(__file__).with_name("on_a_cluster.py")), *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()[-1]


class FakeDistributed:
    """Keeps futures by their keys, as a scheduler does: two of one key are one."""

    def __init__(self, failures: dict[str, Exception]) -> None:
        self._failures = failures

    loop = None

    def Client(self, address: str, **options: Any) -> Self:  # noqa: N802, its own name
        return self

    def __enter__(self) -> None:
        pass

    def __exit__(self, *error: object) -> None:
        pass

    def submit(self, compute_row: Any, compute: Compute, task: Task, *, key: str, retries: int) -> Any:
        failure = self._failures.get(Path(task.path).read_text())
        row = None if failure else compute_row(compute, task)
        return Future(key, SimpleNamespace(row=row, failure=failure))

    def as_completed(self, futures: list[Any], **options: Any) -> list[Any]:
        return futures


class Future(NamedTuple):
    key: str
    of: Any

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Future) and self.key == other.key

    def exception(self) -> Exception | None:
        found: Exception | None = self.of.failure
        return found

    def result(self) -> Row:
        row: Row = self.of.row
        return row


def test_on_a_cluster_each_copy_has_its_row_and_only_a_death_is_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A copy of a recording elsewhere is the same bytes; a worker of another version has computed nothing, and has not died."""
    tasks = folder_of(tmp_path, "same", "same", "deadly", "other version")
    failures = {"deadly": type("KilledWorker", (Exception,), {})("x"), "other version": ValueError("no such module")}
    monkeypatch.setattr("gateway.fleet.engines.import_library", lambda name: FakeDistributed(failures))
    rows = rows_of(cluster("tcp://10.0.0.5:8786"), count_bytes, tasks)
    told = {Path(row["file"]).parent.name[-2:]: (row["error_code"], row["error"][:17]) for row in rows}
    nothing = ("", "")
    assert told == {"01": nothing, "02": nothing, "03": ("E192", "the process that "), "04": ("E403", "no such module")}


@pytest.mark.long
def test_a_cluster_of_two_workers_gives_the_same_rows_and_outlives_one_of_them(tmp_path: Path) -> None:
    tasks = folder_of(tmp_path, "one", "two two", "unreadable", "once upon a time", "six")
    assert on_a_cluster(str(tmp_path)) == repr(rows_of(run_serially, count_bytes, tasks))


@pytest.mark.long
def test_a_scheduler_that_is_not_there_is_named(tmp_path: Path) -> None:
    assert "E191 no Dask scheduler answers on tcp://127.0.0.1:9" in on_a_cluster(str(tmp_path), "tcp://127.0.0.1:9")
