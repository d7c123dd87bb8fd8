"""Ladders of calibrations that are in use, would come back or stand in a slot are measured data: no retention takes them."""

import os
import time
from pathlib import Path

import pytest

from gateway.calibrations.kept_ladders import kept_ladders
from gateway.calibrations.store import CalibrationStore
from gateway.profiles.recordings_section import Retention
from gateway.recording import recording_paths
from gateway.service.running_rig.recording.retention import RecordingRetention
from tests.calibrations.coefficients import calibration
from tests.recording.care.test_care import record


def made_from(store: CalibrationStore, mark: int, *sources: str) -> list[int]:
    return [store.add(calibration(mark + k, source=source)) for k, source in enumerate(sources)]


def test_the_ladders_of_what_is_in_use_of_the_one_before_and_of_slots_stay(tmp_path: Path) -> None:
    store = CalibrationStore(tmp_path)
    for _ in range(5):
        record(tmp_path, days_ago=1_000.0)
    ended_s = time.time() - 2 * 86400.0  # by which the clock is believed
    os.utime(record(tmp_path), (ended_s, ended_s))
    unused, slotted, before, used = made_from(store, 5, *(f"recording {k:04d}.fgr: 60 stairs" for k in (1, 2, 3, 4)))
    store.use(slotted, slot=2)
    store.use(before)
    store.use(used)
    assert unused and kept_ladders(tmp_path) == {"0002.fgr", "0003.fgr", "0004.fgr"}
    retention = RecordingRetention(tmp_path, Retention(days=30.0), lambda cause, sentence: None)  # type: ignore[arg-type]
    gone = retention._prune(0.0)
    retention.close()
    assert [one.path.name for one in gone] == ["0001.fgr", "0005.fgr"]
    assert [path.stem for path in recording_paths(tmp_path)] == ["0002", "0003", "0004", "0006"]


def test_the_parts_that_a_resumed_run_went_on_from_stay_with_it(tmp_path: Path) -> None:
    store = CalibrationStore(tmp_path)
    for continues in ([], [1], [], [1, 2]):
        record(tmp_path, continues=continues)
    (used,) = made_from(store, 5, "recording 0004.fgr: 60 stairs 0-8-0 V")
    store.use(used)
    assert kept_ladders(tmp_path) == {"0001.fgr", "0002.fgr", "0004.fgr"}


def test_the_last_ladder_stays_which_a_resumed_run_would_go_on_with(tmp_path: Path) -> None:
    """It was said to be kept, and had gone when somebody went on."""
    for header in (
        {"ladder": {"groups": 2}},
        {"ladder": {"groups": 3}},
        {"ladder": {"groups": 3}, "continues": [2]},
        {},
    ):
        record(tmp_path, **header)
    assert kept_ladders(tmp_path) == {"0002.fgr", "0003.fgr"}


@pytest.mark.parametrize(
    "source",
    ["", "an upload", "recording ladder.csv: 60 stairs", "recording ../0001.fgr: 60 stairs", 'recording "x": y'],
)
def test_what_names_no_recording_of_the_gateway_keeps_none(source: str, tmp_path: Path) -> None:
    store = CalibrationStore(tmp_path)
    record(tmp_path)
    store.use(*made_from(store, 5, source))
    assert kept_ladders(tmp_path) == frozenset()


@pytest.mark.parametrize("continues", [5, ["x"], None, {"a": 1}])
def test_damage_keeps_what_is_known_and_ends_nothing(continues: object, tmp_path: Path) -> None:
    store = CalibrationStore(tmp_path)
    record(tmp_path, continues=continues)
    first, second = made_from(store, 5, "recording 0001.fgr: 60 stairs", "recording 0001.fgr: 61 stairs")
    store.use(first)
    store.use(second)
    (tmp_path / "calibrations" / f"{second:04d}.yaml").write_bytes(b"\xff\xfe")
    assert kept_ladders(tmp_path) == {"0001.fgr"}
    (tmp_path / "recordings" / "0001.fgr").unlink()
    assert kept_ladders(tmp_path) == {"0001.fgr"}
    assert kept_ladders(tmp_path / "nowhere") == frozenset()
