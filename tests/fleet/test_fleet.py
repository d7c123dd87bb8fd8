"""The verb as a whole, on recordings of a rig that is not the twin."""

import json
import shutil
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

HIDDEN = Path(__file__).parents[1] / "hidden_effects"
sys.path[:0] = [str(HIDDEN)]

from generator.recording import Wish, make, write_csv  # noqa: E402

from gateway.cli.main import command  # noqa: E402


def gateway(*words: str | Path) -> Result:
    return CliRunner().invoke(command, [*map(str, words)])


def place(folder: Path, cell: int, day: int) -> Path:
    found = folder / f"cell={cell}" / f"date=2026-11-{day + 1:02d}"
    found.mkdir(parents=True)
    return found


def test_a_broken_file_is_a_row_and_the_second_call_computes_only_that(tmp_path: Path) -> None:
    import pyarrow.parquet

    wish = Wish((), 1.0, 11, duration_s=20.0, colour="white", columns=(), jitter=False, noise_n=0.1, family="smooth")
    first = write_csv(make(wish), place(tmp_path, 1, 0))
    shutil.copy(__file__, place(tmp_path, 1, 1) / "x.csv")
    pattern = f"{tmp_path}/cell=*/date=*/*.csv"
    words = ("fleet", "diagnose", pattern, "--scheduler", "serial", "-o", tmp_path / "out", "--json")
    done = gateway(*words)
    assert done.exit_code == 65, done.stderr
    answer = json.loads(done.stdout)
    assert (answer["recordings"], answer["errors"], answer["taken_over"]) == (2, 1, 0)
    rows = pyarrow.parquet.read_table(tmp_path / "out/rows.parquet", partitioning=None).to_pylist()
    assert [row["error_code"] for row in rows] == ["", "E403"]
    assert rows[0]["file"] == str(first) and rows[0]["rms_before_n"] == pytest.approx(0.1, rel=0.3)
    assert json.loads(gateway(*words).stdout)["taken_over"] == 1
    assert "<h1>No cell has 4 days" in (tmp_path / "out/report.html").read_text()


@pytest.mark.parametrize(("folder", "is_told"), [("date=2026-11-01", False), ("date=23.11.2026", True), ("", True)])
def test_recordings_that_no_trend_counts_for_want_of_a_day_are_told(tmp_path: Path, folder: str, is_told: bool) -> None:
    """Each cell had 0 days, however many recordings it had."""
    wish = Wish((), 1.0, 11, duration_s=20.0, colour="white", columns=(), jitter=False, noise_n=0.1, family="smooth")
    place = tmp_path / "in" / "cell=1" / folder
    place.mkdir(parents=True)
    file = write_csv(make(wish), place)
    done = gateway("fleet", "diagnose", f"{tmp_path}/in/**/*.csv", "--scheduler", "serial", "-o", tmp_path / "out")
    assert done.exit_code == 0, done.stderr
    told = f"no trend counts 1 recording: in no folder date=YYYY-MM-DD ({file})"
    assert (told in done.stderr) is is_told


def test_a_pattern_without_a_file_and_a_scheduler_without_a_scheme_are_refused(tmp_path: Path) -> None:
    nothing = gateway("fleet", "fit", f"{tmp_path}/*.csv")
    assert nothing.exit_code == 65 and "E190" in nothing.stderr
    (tmp_path / "a.csv").write_text("x")
    wrong = gateway("fleet", "fit", f"{tmp_path}/*.csv", "--scheduler", "dask")
    assert wrong.exit_code == 2 and "tcp://HOST:PORT" in wrong.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv"]


def test_files_of_before_are_no_recordings_and_those_of_others_are_not_written_over(tmp_path: Path) -> None:
    """A pattern with ** found rows, days and cells of the run before: three recordings that could not be read."""
    shutil.copy(__file__, tmp_path / "x.csv")
    words = ("fleet", "fit", f"{tmp_path}/**/*.*", "--scheduler", "serial", "-o", tmp_path / "out", "--json")
    assert [json.loads(gateway(*words).stdout)["recordings"] for _ in range(2)] == [1, 1]
    mine = tmp_path / "mine" / "report.html"
    mine.parent.mkdir()
    mine.write_text("precious")
    refused = gateway("fleet", "fit", str(tmp_path / "x.csv"), "--scheduler", "serial", "-o", mine.parent)
    assert refused.exit_code == 1 and refused.stderr.startswith(f"E405 {mine}"), refused.output
    assert mine.read_text() == "precious"


@pytest.mark.long
def test_the_cell_whose_pad_creeps_more_each_day_is_found_and_its_cause_named(tmp_path: Path) -> None:
    """The real diagnosis, in processes: two minutes."""
    for cell in range(4):
        for day in range(6):
            grows = cell == 2 and day
            effects, size = (("creep",), 0.8 * day) if grows else ((), 1.0)
            steady = {"duration_s": 30.0, "noise_n": 0.1, "columns": (), "jitter": False, "colour": "white"}
            wish = Wish(effects, size, 1000 + cell, family="lugre", **steady)
            write_csv(make(wish), place(tmp_path, cell, day))
    done = gateway("fleet", "diagnose", f"{tmp_path}/cell=*/date=*/*.csv", "-o", tmp_path / "out", "--json")
    assert done.exit_code == 0, done.stderr
    cells = json.loads(done.stdout)["cells"]
    assert [(one["cell"], one["cause"]) for one in cells if one["drifts"]] == [("2", "creep")]
