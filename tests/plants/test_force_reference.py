"""The run before a plant: which recording is it, how is its force read, and what is left of it that is kept."""

import json
from math import inf, isnan, nan
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gateway.control import CellMap
from gateway.diagnosis.force_error import rms_n
from gateway.plants.force_reference import find_reference, keep_reference, read_reference
from gateway.plants.recorded_force import read_recorded_force
from gateway.plants.recorded_number import header_in_use
from gateway.recording import Recorder, RecordingError, read_recording

COLUMNS = ("time_s", "setpoint_n", "force_n", "command_v")
STRAIGHTENED = {"quadratic_per_n": 2.0e-3, "zero_n": 0.4}
CELL = CellMap(**STRAIGHTENED)


def record(state: Path, off_n: float, plant: int = 0, seconds: float = 60.0, columns=COLUMNS, cell=None) -> Path:
    """20 N that are held so far off."""
    header = {"rig": "demo", "plant_in_use": {"number": plant, "compensated": [], "cell": cell}}
    recorder = Recorder(state / "recordings", header, columns)
    for time_s in np.arange(0.0, seconds, 0.05):
        row = {"time_s": time_s, "setpoint_n": 20.0, "force_n": 20.0 + off_n, "command_v": 3.0, "sent_v": 2.9}
        recorder.append(tuple(row[name] for name in columns))
    recorder.close()
    return recorder.path


def test_the_reference_is_the_newest_run_without_the_plant_that_tells_enough(tmp_path: Path) -> None:
    record(tmp_path, 0.2)
    before = record(tmp_path, 0.5, plant=2)
    record(tmp_path, 0.9, plant=3)
    record(tmp_path, 0.1, seconds=3.0)
    record(tmp_path, 0.1, columns=("time_s", "force_n"))
    found = find_reference(tmp_path, 3, None)
    assert found and (found.plant, found.plant_before, found.recording) == (3, 2, before.name)
    assert rms_n(found.blocks) == pytest.approx(0.5)


def test_what_is_long_ago_was_another_machine(tmp_path: Path) -> None:
    record(tmp_path, 0.2)
    for _ in range(8):
        record(tmp_path, 0.9, plant=3, seconds=1.0)
    assert find_reference(tmp_path, 3, None) is None
    assert find_reference(tmp_path, 4, None) is None


def test_what_is_long_ago_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A year of recordings was, before a plant came into use: longer than the page waits for it."""
    paths = [record(tmp_path, 0.9, plant=3, seconds=1.0) for _ in range(10)]
    read: list[str] = []
    whole = Path.read_bytes

    def note(path: Path) -> bytes:
        read.append(path.name)
        return whole(path)

    with monkeypatch.context() as patched:
        patched.setattr(Path, "read_bytes", note)
        assert find_reference(tmp_path, 3, None) is None
    assert read == [path.name for path in reversed(paths[2:])]


def test_a_reference_is_of_its_plant_alone_until_there_is_none(tmp_path: Path) -> None:
    record(tmp_path, 0.5)
    found = find_reference(tmp_path, 3, None)
    keep_reference(tmp_path, found)
    assert read_reference(tmp_path, 3) == found
    assert read_reference(tmp_path, 4) is None
    keep_reference(tmp_path, None)
    assert read_reference(tmp_path, 3) is None
    keep_reference(tmp_path, None)


@pytest.mark.parametrize(
    "spoilt", ["", "[]", "{}", '{"plant": 3, "recording": "0001.fgr", "plant_before": 0, "blocks": [{"rows": 1}]}']
)
def test_a_damaged_reference_is_none(tmp_path: Path, spoilt: str) -> None:
    record(tmp_path, 0.5)
    keep_reference(tmp_path, find_reference(tmp_path, 3, None))
    (tmp_path / "plants" / "reference.json").write_text(spoilt)
    assert read_reference(tmp_path, 3) is None


def test_a_force_is_judged_as_the_plants_own_cell_reads_it(tmp_path: Path) -> None:
    straightened = read_recorded_force(read_recording(record(tmp_path, 0.2, cell=STRAIGHTENED)))
    plain = read_recorded_force(read_recording(record(tmp_path, 0.2)))
    assert (straightened.cell, plain.cell) == (CELL, None)
    assert rms_n(straightened.blocks(CELL)) == rms_n(plain.blocks(None)) == pytest.approx(0.2)
    assert rms_n(straightened.blocks(None)) == pytest.approx(abs(CELL.reading_n(20.2, nan, 3.0) - 20.0))
    assert rms_n(plain.blocks(CELL)) == pytest.approx(abs(CELL.force_n(20.2, nan, 3.0) - 20.0))


def test_the_voltage_is_what_went_out_else_what_was_asked_else_unknown(tmp_path: Path) -> None:
    runs = [
        read_recorded_force(read_recording(record(tmp_path, 0.2, columns=(*COLUMNS, "sent_v")[:n]))) for n in (5, 4, 3)
    ]
    assert [run.voltage_v[0] for run in runs[:2]] == [2.9, 3.0]
    assert isnan(runs[2].voltage_v[0]) and runs[2].voltage_v.size == runs[2].force.time_s.size


@pytest.mark.parametrize(
    ("said", "read"),
    [
        ({"number": 3}, {"number": 3}),
        (json.dumps({"number": 3}), {"number": 3}),
        ("{", {}),
        ("[3]", {}),
        ([3], {}),
        (None, {}),
    ],
)
def test_a_header_says_which_plant_was_in_use_or_nothing(said: object, read: dict[str, int]) -> None:
    assert header_in_use({"plant_in_use": said}) == read
    assert header_in_use({}) == {}


@pytest.mark.parametrize(
    "said",
    [
        {"number": "x"},
        {"number": [1]},
        {"number": 1.5},
        {"number": 1, "cell": {"foo": 1.0}},
        {"number": 1, "cell": [1, 2]},
        {"number": 1, "cell": {"quadratic_per_n": "a"}},
        {"number": 1, "cell": {"quadratic_per_n": None}},
        {"number": 1, "cell": {"zero_n": inf}},
        {"number": 1, "cell": {"zero_n": -inf}},
        {"number": 1, "cell": {"zero_n": 10**400}},
    ],
)
def test_a_plant_in_use_that_no_gateway_writes_is_a_sentence_and_no_internal_error(said: dict[str, Any]) -> None:
    for written in (said, json.dumps(said)):
        with pytest.raises(RecordingError, match="of plant_in_use what no gateway writes"):
            header_in_use({"plant_in_use": written})


@pytest.mark.parametrize(
    ("name", "spoilt"), [("squares_n2", "much"), ("squares_n2", nan), ("rows", 0), ("from_n", None), ("to_n", [1])]
)
def test_a_reference_whose_numbers_are_none_is_none(tmp_path: Path, name: str, spoilt: object) -> None:
    """The watch ended over it at each start, until it was given up, and with it what it says of the machine."""
    record(tmp_path, 0.5)
    keep_reference(tmp_path, find_reference(tmp_path, 3, None))
    file = tmp_path / "plants" / "reference.json"
    facts = json.loads(file.read_text())
    facts["blocks"][0][name] = spoilt
    file.write_text(json.dumps(facts))
    assert read_reference(tmp_path, 3) is None
