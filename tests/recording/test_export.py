"""A recording leaves the house as CSV or Parquet without losing a bit, and with its facts."""

import json
from pathlib import Path
from typing import IO

import numpy as np
import pyarrow.parquet as pq
import pytest

from gateway.recording import Recorder, Recording, export, export_csv, export_parquet, read_recording


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    header = {"rig": "demo", "calibration": 3, "rig_texts": {"demo.yaml": "name: demo\nseed: 7\n"}}
    recorder = Recorder(tmp_path, header, ("time_s", "command_v", "force_n", "state"))
    for row in range(50):
        recorder.append((row / 3, 0.1 * row, float("nan") if row == 7 else row**0.5, 3.0))
    recorder.close()
    return read_recording(recorder.path)


def read_csv(path: Path) -> tuple[dict[str, str], dict[str, list[float]]]:
    """By the contract's words alone: `#` lines, one header row, commas."""
    lines = path.read_text(encoding="utf-8").splitlines()
    facts = dict(line[2:].split(": ", 1) for line in lines if line.startswith("#"))
    names, *rows = [line.split(",") for line in lines if not line.startswith("#")]
    return facts, {name: [float(row[index]) for row in rows] for index, name in enumerate(names)}


def test_csv_gives_every_number_back(recording: Recording, tmp_path: Path) -> None:
    export_csv(recording, tmp_path / "out.csv")
    facts, columns = read_csv(tmp_path / "out.csv")
    assert list(columns) == ["time_s", "command_v", "force_n", "state"]
    for name, values in columns.items():
        np.testing.assert_array_equal(values, recording.columns[name])
    assert facts["rig"] == "demo"
    assert facts["calibration"] == "3"
    assert json.loads(facts["rig_texts"]) == recording.header["rig_texts"]
    assert "dropped" not in facts


def test_parquet_gives_every_number_and_fact_back(recording: Recording, tmp_path: Path) -> None:
    export_parquet(recording, tmp_path / "out.parquet")
    table = pq.read_table(tmp_path / "out.parquet")
    for name in recording.columns:
        np.testing.assert_array_equal(table[name].to_numpy(), recording.columns[name])
    facts = {key.decode(): json.loads(value) for key, value in table.schema.metadata.items()}
    assert facts == recording.header


def test_a_torn_tail_is_said_in_both(recording: Recording, tmp_path: Path) -> None:
    recording.path.write_bytes(recording.path.read_bytes() + b"FGB\x1ehalf")
    torn = read_recording(recording.path)
    assert torn.rows == 50
    export_csv(torn, tmp_path / "out.csv")
    export_parquet(torn, tmp_path / "out.parquet")
    assert "torn tail" in read_csv(tmp_path / "out.csv")[0]["dropped"]
    assert b"torn tail" in pq.read_schema(tmp_path / "out.parquet").metadata[b"dropped"]


def test_whoever_reads_an_export_meanwhile_reads_the_old_one_to_its_end(recording: Recording, tmp_path: Path) -> None:
    target = tmp_path / "out.csv"
    target.write_text("of before\n")
    with target.open() as reader:
        export_csv(recording, target)
        assert reader.read() == "of before\n"
    assert read_csv(target)[0]["rig"] == "demo"


def test_a_failed_export_leaves_nothing_behind(recording: Recording, tmp_path: Path) -> None:
    target = tmp_path / "out.csv"
    target.mkdir()
    with pytest.raises(OSError, match="directory"):
        export_csv(recording, target)
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []


def test_an_export_that_fails_halfway_leaves_what_was_there(
    recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "out.csv"
    target.write_text("of yesterday")

    def fail(of: Recording, stream: IO[bytes]) -> None:
        stream.write(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("gateway.recording.export.write_csv", fail)
    with pytest.raises(OSError, match="No space"):
        export_csv(recording, target)
    assert target.read_text() == "of yesterday"
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []


def test_a_note_of_several_lines_is_one_line_of_the_csv(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path, {"note": "new seals\n1,2,3,4", "name": "a\rb"}, ("time_s", "force_n"))
    recorder.append((0.0, 1.0))
    recorder.close()
    export_csv(read_recording(recorder.path), tmp_path / "out.csv")
    facts, columns = read_csv(tmp_path / "out.csv")
    assert (json.loads(facts["note"]), json.loads(facts["name"])) == ("new seals\n1,2,3,4", "a\rb")
    assert columns == {"time_s": [0.0], "force_n": [1.0]}


def test_a_recording_without_rows_exports_its_header(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path, {"rig": "demo"}, ("time_s", "force_n"))
    recorder.close()
    empty = read_recording(recorder.path)
    export_csv(empty, tmp_path / "out.csv")
    export_parquet(empty, tmp_path / "out.parquet")
    assert read_csv(tmp_path / "out.csv")[1] == {"time_s": [], "force_n": []}
    assert pq.read_table(tmp_path / "out.parquet").num_rows == 0


def test_without_pyarrow_a_csv_gives_every_number_back_too(
    recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(export, "is_installed", lambda name: False)
    export_csv(recording, tmp_path / "plain.csv")
    _, columns = read_csv(tmp_path / "plain.csv")
    assert list(columns) == list(recording.columns)
    for name, values in columns.items():
        np.testing.assert_array_equal(values, recording.columns[name])
