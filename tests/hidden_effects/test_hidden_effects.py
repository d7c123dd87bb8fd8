"""Effects are hidden in recordings of a rig that is not the twin, and must be found; nothing must be found in nothing.

The push gate asks nineteen, drawn from a printed seed (another: HIDDEN_EFFECTS_SEED); --long asks for every effect twenty
times, 300 nulls, and twos and threes, and leaves its lines in HIDDEN_EFFECTS_RESULTS (else beside the test's own files).
Both run `tools/hidden_effects`, as anybody can. The bars of a sample are wider than those of DIAGNOSIS, which --long holds.
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from judge.engine import missing
from judge.table import HIDDEN, lied, table, with_failure

TOOL = Path(__file__).parents[2] / "tools" / "hidden_effects"
SEED = os.environ.get("HIDDEN_EFFECTS_SEED", "2026")
GATE_BOUND_S = 180.0
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


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> list[Row]:
    return run(tmp_path_factory.mktemp("hidden") / "gate.jsonl", "--gate")


def test_every_recording_gets_an_answer_in_time(sample: list[Row]) -> None:
    assert [row for row in sample if "failed" in row] == []
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


@pytest.mark.long
def test_rates_over_every_effect_hold_the_page_s_bars(tmp_path: Path) -> None:
    """Hours. The table that it prints is what README quotes."""
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
