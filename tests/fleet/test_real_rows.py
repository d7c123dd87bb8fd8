"""The real diagnosis gives the same rows whoever computes it, bit for bit; the command is run as a user runs it."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.fleet.test_fleet import Wish, make, place, write_csv

COMMAND = [sys.executable, "-m", "gateway", "fleet", "diagnose"]


def recordings(folder: Path, cells: int, days: int) -> str:
    for cell in range(cells):
        for day in range(days):
            wish = Wish(
                ("creep",), 0.5 + day, 60 + 9 * cell + day, duration_s=30.0, colour="white", columns=(), jitter=False
            )
            write_csv(make(wish), place(folder, cell, day))
    return f"{folder}/cell=*/date=*/*.csv"


def rows_of(pattern: str, out: Path, *words: str) -> bytes:
    done = subprocess.run([*COMMAND, pattern, "-o", str(out), *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return (out / "rows.parquet").read_bytes()


@contextmanager
def dask_cluster(folder: Path) -> Iterator[str]:
    """A scheduler and two workers of one thread each, as an operator starts them; free ports."""
    file = folder / "scheduler.json"
    dask = [sys.executable, "-m", "dask"]
    started = [
        subprocess.Popen([*dask, *words], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for words in (
            ["scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(file)],
            ["worker", "--scheduler-file", str(file), "--nworkers", "2", "--nthreads", "1", "--no-dashboard"],
        )
    ]
    try:
        yield _address(file)
    finally:
        for each in reversed(started):
            each.terminate()
            each.wait(30)


def _address(file: Path) -> str:
    """The scheduler writes the file when it listens; a worker's own client waits for it in the same way."""
    code = "import sys; from distributed import Client; c = Client(scheduler_file=sys.argv[1]); c.wait_for_workers(2)"
    subprocess.run([sys.executable, "-c", code, str(file)], check=True, capture_output=True, timeout=60)
    return str(json.loads(file.read_text())["address"])


_WATCH = """
import os, sys

class Watch:
    def find_spec(self, name, path=None, target=None):
        if name == "numpy":
            print("threads", os.environ.get("OPENBLAS_NUM_THREADS"))

sys.meta_path.insert(0, Watch())
from gateway.cli.main import command
command()
"""


@pytest.mark.sampled
@pytest.mark.parametrize("verb", ["diagnose", "fit"])
def test_numpy_is_loaded_for_one_thread_as_in_workers(verb: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("x")
    words = [sys.executable, "-c", _WATCH, "fleet", verb, str(tmp_path / "a.csv"), "-o", str(tmp_path / "o")]
    done = subprocess.run(
        [*words, "--scheduler", "serial"],
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "2"},
    )
    assert done.returncode == 65, done.stderr
    assert done.stdout.splitlines()[0] == "threads 1"


@pytest.mark.long
def test_rows_are_the_same_bit_for_bit_serially_in_processes_and_on_a_cluster(tmp_path: Path) -> None:
    pattern = recordings(tmp_path, 2, 2)
    expected = rows_of(pattern, tmp_path / "serial", "--scheduler", "serial")
    assert rows_of(pattern, tmp_path / "processes") == expected
    with dask_cluster(tmp_path) as address:
        assert rows_of(pattern, tmp_path / "cluster", "--scheduler", address) == expected


@pytest.mark.long
def test_ctrl_c_keeps_what_is_finished_says_so_and_the_next_call_ends_with_the_same_rows(tmp_path: Path) -> None:
    pattern, out = recordings(tmp_path, 2, 3), tmp_path / "out"
    words = [*COMMAND, pattern, "-o", str(out), "--scheduler", "serial"]
    with subprocess.Popen(words, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True) as running:
        assert running.stderr is not None
        for _ in running.stderr:  # a line for each stage, from the first second on
            if (out / "rows.jsonl").exists() and (out / "rows.jsonl").read_text().count("\n") > 1:
                running.send_signal(signal.SIGINT)
                break
        said = running.stderr.read()
    assert running.returncode == -signal.SIGINT and "of 6 rows are kept; the same command goes on" in said
    assert sorted(each.name for each in out.iterdir()) == ["rows.jsonl"]
    done = subprocess.run([*words, "--json"], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["taken_over"] >= 1
    assert (out / "rows.parquet").read_bytes() == rows_of(pattern, tmp_path / "anew", "--scheduler", "serial")
