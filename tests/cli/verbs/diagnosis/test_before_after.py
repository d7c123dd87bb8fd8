"""`diagnose --before A --after B`: the gain of a change in commanded force, told and as JSON, from files as users have them."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from gateway.cli.main import command
from gateway.processes import exit_codes

LEVELS_N = (5.0, 20.0, 10.0, 30.0, 15.0, 25.0, 8.0)


def table(path: Path, error_n: float, seed: int, *, header: str = "", setpoint: str = "setpoint_n") -> Path:
    """Seven held forces at 20 Hz, read `error_n` too high after each rise and too low after each fall."""
    rng = np.random.default_rng(seed)
    lines = [*([header] if header else []), f"time_s,command_v,force_n,{setpoint},state"]
    for index, wanted_n in enumerate(LEVELS_N):
        sign = 1.0 if index == 0 or wanted_n > LEVELS_N[index - 1] else -1.0
        for row in range(60):
            read_n = wanted_n + sign * error_n + rng.normal(0.0, 0.05)
            lines.append(f"{index * 3.0 + row * 0.05:.2f},{wanted_n / 8.0:.3f},{read_n:.4f},{wanted_n},3")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def diagnose(*words: object) -> Result:
    return CliRunner().invoke(command, ["diagnose", *map(str, words)])


def test_a_gain_is_told_with_its_interval(tmp_path):
    before, after = table(tmp_path / "a.csv", 0.8, 1), table(tmp_path / "b.csv", 0.3, 2)
    told = diagnose("--before", before, "--after", after, "--json", tmp_path / "out.json")
    assert told.exit_code == 0, told.output
    answer = (
        "The commanded force is held better: 0.80 N before, 0.31 N after, 0.49 N gained (95 % interval 0.48 .. 0.50 N)"
    )
    assert told.output.startswith(f"{answer}\n")
    assert "Compared where the same was asked of both: 100% and 100% of their rows" in told.output
    document = json.loads((tmp_path / "out.json").read_text())
    assert (document["format"], document["verdict"]) == (1, "better")
    low, high = document["force_error"]["ratio_ci95"]
    assert low <= document["force_error"]["ratio"] <= high < 1.0
    assert document["force_error"]["ratio"] == pytest.approx(0.38, abs=0.03)
    back = json.loads(diagnose("--before", after, "--after", before, "--json", "-").stdout)
    assert back["verdict"] == "worse"


def test_the_page_says_what_the_terminal_says_and_draws_both_runs(tmp_path):
    before, after, report = table(tmp_path / "a.csv", 0.8, 1), table(tmp_path / "b.csv", 0.3, 2), tmp_path / "out.html"
    told = diagnose("--before", before, "--after", after, "--report", report)
    assert told.exit_code == 0, told.output
    html = report.read_text(encoding="utf-8").replace("\N{NO-BREAK SPACE}", " ")
    answer = told.output.partition("\n")[0]
    assert f"<h1>{answer}</h1>" in html
    assert html.count('class="plot"') == 2 and html.count(">largest: ") == 2
    assert "<th>on the way</th>" in html and ">nan" not in html


def test_a_plant_that_bends_the_readings_cannot_be_judged_by_the_readings(tmp_path):
    """Through the bent cell of the plant in use the later run is better, as the cell was read before it is worse."""
    in_use = '# plant_in_use: {"number": 2, "cell": {"quadratic_per_n": 0.004}}'
    before, after = table(tmp_path / "a.csv", 0.3, 1), table(tmp_path / "b.csv", 0.3, 2, header=in_use)
    document = json.loads(diagnose("--before", before, "--after", after, "--json", "-").stdout)
    assert (document["verdict"], document["after"]["plant"]) == ("cannot be told", 2)
    assert "only a second load cell can tell" in document["force_error"]["why"]
    assert document["held"]["verdict"] == "cannot be told", "the same readings"


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--before", "a.csv"], "--before A and --after B go together"),
        (["--before", "a.csv", "--after", "b.csv", "--closed-loop"], "without closed_loop"),
        ([], "Missing argument 'RECORDING...'"),
    ],
)
def test_what_does_not_go_together_is_a_wrong_use(words, sentence):
    answer = diagnose(*words)
    assert (answer.exit_code, sentence in answer.output) == (exit_codes.USAGE, True), answer.output


def test_a_table_that_does_not_say_what_was_asked_is_no_run(tmp_path):
    told = diagnose(
        "--before", table(tmp_path / "a.csv", 0.8, 1, setpoint="other"), "--after", table(tmp_path / "b.csv", 0.3, 2)
    )
    assert (told.exit_code, "no column setpoint_n" in told.output) == (exit_codes.DATA, True), told.output


def spoilt(path: Path, *, keep: slice = slice(None), cell: tuple[int, int, str] | None = None, order: int = 1) -> Path:
    """The table with a part of its rows only, backwards, or with another cell (row, column, text)."""
    head, *rows = table(path, 0.3, 2).read_text(encoding="utf-8").splitlines()
    rows = rows[keep][::order]
    if cell:
        words = rows[cell[0]].split(",")
        rows[cell[0]] = ",".join([*words[: cell[1]], cell[2], *words[cell[1] + 1 :]])
    path.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"keep": slice(0)}, "other.csv: no rows"),
        ({"order": -1}, "other.csv:3, column time_s: 20.9 after 20.95: time runs backwards"),
    ],
)
def test_a_table_that_is_no_run_is_refused_by_the_row(tmp_path, changes, sentence):
    before, after = table(tmp_path / "a.csv", 0.8, 1), spoilt(tmp_path / "other.csv", **changes)
    told = diagnose("--before", before, "--after", after, "--report", tmp_path / "out.html")
    assert told.exit_code == exit_codes.DATA, told.output
    assert sentence in told.output
    assert not (tmp_path / "out.html").exists()


@pytest.mark.parametrize(("column", "value"), [(0, "nan"), (2, "1e308"), (2, "-inf"), (3, "inf"), (3, "nan")])
def test_a_value_that_is_none_costs_its_row(tmp_path, column, value):
    before, after = table(tmp_path / "a.csv", 0.8, 1), spoilt(tmp_path / "other.csv", cell=(70, column, value))
    told = diagnose("--before", before, "--after", after, "--report", tmp_path / "out.html")
    assert told.exit_code == 0, told.output
    assert "0.80 N before, 0.31 N after, 0.49 N gained" in told.output


def test_what_is_asked_stands_until_the_next_row_that_says_it(tmp_path):
    """Loggers that write a setpoint only where it changes."""
    before, after = table(tmp_path / "a.csv", 0.8, 1), table(tmp_path / "b.csv", 0.3, 2)
    whole = diagnose("--before", before, "--after", after).output
    for path in (before, after):
        head, *rows = path.read_text(encoding="utf-8").splitlines()
        words = [row.split(",") for row in rows]
        for k in range(len(rows) - 1, 0, -1):
            words[k][3] = "" if words[k][3] == words[k - 1][3] else words[k][3]
        path.write_text("\n".join([head, *map(",".join, words)]) + "\n", encoding="utf-8")
    assert diagnose("--before", before, "--after", after).output == whole
