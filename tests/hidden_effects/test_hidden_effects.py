"""Effects are hidden in recordings of a rig that is not the twin, and must be found; nothing must be found in nothing.

The push gate asks nine, drawn from a printed seed (another: HIDDEN_EFFECTS_SEED); --long asks for every effect twenty
times, 300 nulls, and twos and threes, and leaves its lines in HIDDEN_EFFECTS_RESULTS (else beside the test's own files).
Anybody gets the same answers from `tools/hidden_effects --gate`. The bars of a sample are wider than those of
gateway/diagnosis/RATES.md, which --long holds.
"""

import fcntl
import json
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from generator.recording import Wish
from judge.cases import Case, Plan, cases, gate_sample
from judge.engine import missing
from judge.running import run_one
from judge.table import HIDDEN, lied, table, with_failure

TOOL = Path(__file__).parents[2] / "tools" / "hidden_effects"
SEED = os.environ.get("HIDDEN_EFFECTS_SEED", "2026")
GATE_BOUND_S = 180.0
SAMPLE = len(gate_sample(int(SEED)))
Row = dict[str, Any]

pytestmark = pytest.mark.skipif(bool(missing()), reason=f"NO EFFECT IS HIDDEN FROM ANYBODY: {missing()}")


def run(results: Path, *words: str) -> list[Row]:
    """Rows of the tool with two processes; its own words go to the test's output. Fails where it failed."""
    command = [sys.executable, str(TOOL), "--jobs", "2", "--seed", SEED, "--results", str(results), *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    print(f"seed {SEED}\n{done.stdout}{done.stderr}")
    assert done.returncode in (0, 1), done.stderr
    return [json.loads(line) for line in results.read_text(encoding="utf-8").splitlines()]


def share(rows: Sequence[Row], kinds: Sequence[str], hit: Callable[[Row], bool]) -> float:
    asked = [with_failure(row) for row in rows if row["kind"] in kinds and "skipped" not in row]
    return sum(map(hit, asked)) / len(asked)


def answer(number: int, folder: Path, wait: bool = True) -> Row | None:
    """Row of the sample's recording, diagnosed once in a run whichever worker asks first.

    None where another worker is at it and nobody wants to wait. A worker that dies at it lets go of the lock.
    """
    row = folder / f"{number}.json"
    with (folder / f"{number}.lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return None
        if not row.exists():
            found = run_one(gate_sample(int(SEED))[number], "python")
            row.with_suffix(".part").write_text(json.dumps(found), encoding="utf-8")
            row.with_suffix(".part").rename(row)
        return dict(json.loads(row.read_text(encoding="utf-8")))


@pytest.fixture(scope="module")
def answers(run_folder: Path) -> Path:
    folder = run_folder / "hidden"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(scope="module")
def sample(answers: Path) -> list[Row]:
    """All of it: first what nobody has begun, then what others end."""
    numbers = range(len(gate_sample(int(SEED))))
    for number in numbers:
        answer(number, answers, wait=False)
    return [row for number in numbers if (row := answer(number, answers))]


@pytest.mark.parametrize("number", range(SAMPLE))
def test_a_recording_gets_an_answer(number: int, answers: Path) -> None:
    """Each for itself, so that all workers are at the sample."""
    row = answer(number, answers)
    print(f"seed {SEED}: {row}")
    assert row is not None and "failed" not in row


def test_every_recording_gets_an_answer_in_time(sample: list[Row]) -> None:
    assert len(sample) == SAMPLE and [row for row in sample if "failed" in row] == []
    assert sum(row.get("processor_s", 0.0) for row in sample) / 2.0 < GATE_BOUND_S


def test_hidden_effects_are_named(sample: list[Row]) -> None:
    assert share(sample, ["alone"], lambda row: row["right"]) >= 0.75, table(sample)


def test_nothing_is_blamed_without_a_doubt_that_is_not_there(sample: list[Row]) -> None:
    assert sum(row["wrong"] for row in sample if row["kind"] in HIDDEN and "wrong" in row) <= 1, table(sample)


def test_nothing_is_found_in_nothing(sample: list[Row]) -> None:
    assert share(sample, ["null"], lambda row: row["alarm"]) == 0.0, table(sample)


def test_a_cause_outside_the_catalogue_is_described_and_not_confirmed(sample: list[Row]) -> None:
    assert share(sample, ["outside"], lied) == 0.0, table(sample)
    assert share(sample, ["outside"], lambda row: row["described"]) >= 0.5, table(sample)


def test_lost_motion_is_no_leak_where_friction_could_hold_a_force_at_the_first_row() -> None:
    """Both show nothing in a rest; fitted as a start, lost motion gained nothing, and a leak was named without a doubt."""
    wish = Wish(("backlash",), 1.0, 3, duration_s=25.0, colour="white", columns=(), jitter=False)
    row = run_one(Case("alone", wish), "python")
    assert row["right"] and not row["wrong"], row


@pytest.mark.long
def test_the_tool_with_two_processes_writes_the_rows_of_one(tmp_path: Path) -> None:
    """With an engine that says nothing, so that only the harness is asked."""
    words = ("--engine", "silent", "--effects", "linear-drift,null", "--sizes", "1", "--table")
    timeless = [{k: v for k, v in row.items() if not k.endswith("_s")} for row in run(tmp_path / "rows.jsonl", *words)]
    asked = cases(Plan(("linear-drift", "null"), first_seed=int(SEED), sizes=(1.0,)))
    expected = [{k: v for k, v in run_one(case, "silent").items() if not k.endswith("_s")} for case in asked]
    assert sorted(timeless, key=str) == sorted(json.loads(json.dumps(expected)), key=str)


@pytest.mark.long
def test_rates_over_every_effect_hold_the_page_s_bars(tmp_path: Path) -> None:
    """Hours. The table that it prints is what gateway/diagnosis/RATES.md quotes."""
    results = Path(os.environ.get("HIDDEN_EFFECTS_RESULTS", str(tmp_path / "long.jsonl")))
    rows = run(results, "--long", "--table")
    assert [row for row in rows if "failed" in row] == []
    large = [row for row in rows if row["size"] >= 0.75]
    assert share(large, ["alone"], lambda row: row["right"]) >= 0.95
    assert share(rows, HIDDEN, lambda row: row["wrong"]) <= 0.02
    assert share(rows, ["two", "three"], lambda row: row["right"]) >= 0.90
    assert share(rows, ["null"], lambda row: row["alarm"]) <= 0.01
    assert share(rows, ["outside"], lied) <= 0.03
    assert share(rows, ["outside"], lambda row: row["described"]) >= 0.85
