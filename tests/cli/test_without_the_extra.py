"""Without the extra `analysis` everything that holds a force works, and what needs it says so by a code."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import gateway
from gateway import extras
from gateway.recording import Recorder, read_recording, read_table
from tests.cli.lean import call_lean, lean_environment
from tests.cli.verbs.calibration.test_fit import ORDERS, ladder_rows, written

NEEDS = "E160 this needs more than is installed: {} is not installed; pip install 'force-gateway[analysis]' brings it"


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """Recording 1 of a state directory, with numbers that only all their digits give back."""
    recorder = Recorder(tmp_path / "state" / "recordings", {"rig": "demo"}, ("time_s", "command_v", "force_n"))
    for row in range(50):
        recorder.append((row / 3, 0.1 * row, float("nan") if row == 7 else row**0.5))
    recorder.close()
    return recorder.path


def test_what_needs_the_extra_says_so_and_nothing_else_does(recording: Path, tmp_path: Path) -> None:
    parquet = tmp_path / "rows.parquet"
    pq.write_table(pa.table({"time_s": [0.0], "force_n": [0.0], "command_v": [0.0]}), parquet)
    ladder = written(tmp_path / "ladder.csv", ladder_rows())
    state = ("--state", tmp_path / "state")
    lean = call_lean(
        tmp_path,
        ("diagnose", recording, "--report", tmp_path / "report.html"),
        ("simulate", recording),
        ("recordings", "export", 1, "--parquet", *state),
        ("fit", parquet),
        ("recordings", "export", 1, "-o", tmp_path / "rows.csv", *state),
        ("fit", ladder, *ORDERS, "--no-report"),
        ("check", "demo"),
        ("effects",),
    )
    for (exit_code, _, stderr), library in zip(lean, ("numba", "numba", "pyarrow", "pyarrow"), strict=False):
        *_progress, said = stderr.strip().splitlines()  # where the machine is busy
        assert (exit_code, said.removeprefix("Error: ")) == (69, NEEDS.format(library))
    assert [exit_code for exit_code, _, _ in lean[4:]] == [0] * 4, lean[4:]
    assert "E160 the residual watch is off: numba is not installed" in lean[6][1]
    assert not list(tmp_path.glob("report.html")) + list(tmp_path.glob("*.parquet.*"))
    exported, columns = read_table(tmp_path / "rows.csv"), read_recording(recording).columns
    for name, values in columns.items():
        np.testing.assert_array_equal(exported.columns[name], values)


def test_the_check_of_a_whole_installation_says_nothing_of_it(call) -> None:
    assert "E160" not in call("check", "demo").output


def test_a_library_that_is_there_and_breaks_is_told_by_its_error(monkeypatch) -> None:
    def break_off(name: str) -> None:
        raise ImportError("numpy.core failed")

    monkeypatch.setattr(extras, "import_module", break_off)
    with pytest.raises(extras.MissingExtraError, match=r"E160 .* numba does not load \(numpy.core failed\)"):
        extras.import_library("numba")


def test_what_runs_without_the_extra_is_this_tree(tmp_path: Path) -> None:
    """And not a gateway that was installed beside it, of another day."""
    asked = [sys.executable, "-c", "import gateway; print(gateway.__file__)"]
    found = subprocess.run(
        asked, env=lean_environment(tmp_path), cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert found.stdout.strip() == gateway.__file__
