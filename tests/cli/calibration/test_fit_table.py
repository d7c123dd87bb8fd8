"""`fit` takes foreign tables: Parquet, and any CSV with --columns."""

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

ORDERS = ("--models", "psfm", "--orders", "1-2", "--no-report", "--json")


def ladder() -> dict[str, np.ndarray]:
    """10 Hz: two loops 3 N wide, 0 .. 6 V in steps of 0.5 V, 0.5 s each."""
    up = np.arange(0.0, 6.01, 0.5)
    stairs = np.append(np.tile(np.concatenate([up, up[-2::-1]]), 2), 0.0)
    force, forces = 0.0, []
    for volts in stairs:
        force = float(np.clip(force, 8.0 * volts - 1.5, 8.0 * volts + 1.5))
        forces += [force] * 5
    force_n = np.array(forces) + np.random.default_rng(7).normal(0.0, 0.05, len(forces))
    return {"time_s": np.arange(len(forces)) * 0.1, "command_v": np.repeat(stairs, 5), "force_n": force_n}


def fit_and_read_choice(call, *words: object) -> dict:
    answer = call("fit", *words, *ORDERS)
    assert answer.exit_code == 0, answer.output
    return json.loads(answer.stdout)["chosen"]


@pytest.fixture
def headless(tmp_path: Path) -> Path:
    """Milliseconds, kilogram-force, millivolts; tabs and decimal commas; no header."""
    table = ladder()
    path = tmp_path / "headless.txt"
    rows = zip(table["time_s"] * 1e3, table["force_n"] / 9.80665, table["command_v"] * 1e3, strict=True)
    path.write_text("".join("\t".join(f"{value:.6f}".replace(".", ",") for value in row) + "\n" for row in rows))
    return path


def test_parquet_and_mapped_tables_give_the_fit_of_the_plain_one(headless: Path, tmp_path: Path, call) -> None:
    plain = tmp_path / "plain.csv"
    plain.write_text(
        "time_s,command_v,force_n\n"
        + "".join(f"{t:.6f},{v:.6f},{f:.6f}\n" for t, v, f in zip(*ladder().values(), strict=True))
    )
    pq.write_table(pa.table(ladder()), tmp_path / "ladder.parquet")
    mapping = tmp_path / "logger.yaml"
    mapping.write_text("time_s: 1:ms\nforce_n: 2:kgf\ncommand_v: 3:mv\n")
    expected = fit_and_read_choice(call, plain)["rms_n"]
    for words in (
        [tmp_path / "ladder.parquet"],
        [headless, "--columns", "time_s=1:ms,force_n=2:kgf,command_v=3:mv"],
        [headless, "--columns", mapping],
    ):
        assert fit_and_read_choice(call, *words)["rms_n"] == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ((), "no header row"),
        (("--columns", "time_s=1:ms,force_n=9"), "the table has the columns 1 .. 3"),
        (("--columns", "time_s=1:bar"), "'bar' is no unit for time_s"),
        (("--columns", "nowhere.yaml"), "nowhere.yaml cannot be read"),
    ],
)
def test_a_mapping_that_does_not_fit_the_table_is_told(
    columns: tuple[str, ...], words: str, headless: Path, call
) -> None:
    answer = call("fit", headless, *columns, *ORDERS)
    assert answer.exit_code == 65
    assert answer.output.startswith("E403")
    assert words in answer.output
