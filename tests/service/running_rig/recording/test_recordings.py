"""Recordings of a running rig: what a user says of one stands in it, and one with a time ends by itself."""

import errno
import os
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from gateway.codes.faults import FaultCode
from gateway.control import CalibrationInUse, Controller
from gateway.devices.messages import ForceSample, Quality
from gateway.profiles.recordings_section import Retention
from gateway.recording import list_recordings, read_recording, recording_paths
from gateway.recording.label import RecordingLabel, label_of
from gateway.recording.recorder import sync_recording
from gateway.recording.tables.column_names import CALIBRATION
from gateway.service.running_rig.lines.output_line import LineState
from gateway.service.running_rig.recording.recorded_row import COLUMNS, row_of
from gateway.service.running_rig.recording.recordings import LONGEST_S, RUN_COLUMNS, Recordings
from gateway.service.running_rig.recording.run_recording import HANGS_S
from gateway.service.running_rig.recording.wanted_recording import WantedRecording
from tests.control.bench import bsfm
from tests.disk.at_once import AtOnce
from tests.service.kept_log import Log
from tests.service.rigs import demo


@pytest.fixture
def recordings(tmp_path: Path) -> Recordings:
    return Recordings(tmp_path / "recordings", demo(), Log(), AtOnce())


def test_a_row_is_in_the_units_of_its_columns() -> None:
    """Seconds since the voltage went out, kilopascals, volts and newtons: each where its column is."""
    sample = ForceSample(1.0, 12.5, Quality.UNSTABLE, time_s=1000.25)
    decision = Controller(demo().control, CalibrationInUse(bsfm(), 1)).safe_output(FaultCode.NONE)
    decision = decision._replace(voltage_v=3.0, force_measured_n=12.0, force_applied_n=11.0, trim_v=-0.25)
    row = dict(zip(COLUMNS, row_of(0.25, sample, decision, LineState(210_000.0, 2.5, 1000.0)), strict=True))
    expected = {"time_s": 0.25, "pressure_kpa": 210.0, "sent_v": 2.5, "sent_age_s": 0.25, "quality": 1.0}
    expected |= {"command_v": 3.0, "force_n": 12.0, "applied_n": 11.0, "trim_v": -0.25}
    assert {name: row[name] for name in expected} == expected


def test_name_and_note_stand_in_the_header_and_only_where_they_were_given(
    recordings: Recordings, tmp_path: Path
) -> None:
    recordings.start(RecordingLabel("before repair", "new seals tomorrow"))
    recordings.stop()
    recordings.start()
    recordings.stop()
    named, plain = list_recordings(tmp_path)
    assert label_of(named.header) == RecordingLabel("before repair", "new seals tomorrow")
    assert not {"name", "note"} & set(plain.header)


def test_a_recording_names_the_calibration_that_is_in_use_now(recordings: Recordings, tmp_path: Path) -> None:
    recordings.calibration = replace(demo().calibration, number=7, noise_n=0.25)
    recordings.start()
    recordings.stop()
    header = list_recordings(tmp_path)[0].header
    assert (header["calibration"], header["calibration_noise_n"]) == (7, 0.25)


def test_a_recording_with_a_time_ends_by_the_loops_clock(recordings: Recordings) -> None:
    wanted: list[WantedRecording | None] = []
    recordings.on_wanted = wanted.append
    recordings.start(for_s=2.0)
    assert [one and one.began_in.endswith("0001.fgr") for one in wanted] == [True], "or the next process knew of none"
    recordings.flush(100.0)
    recordings.flush(101.99)
    assert recordings.status()["recording"] and wanted[-1]
    recordings.flush(102.0)
    assert recordings.status() == {"recording": None} and wanted[-1] is None
    assert [line for line in recordings._log if "ends after 2 s" in line]


def test_a_refused_recording_changes_nothing_of_the_one_that_waits_for_room(
    recordings: Recordings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It went on under the name of the refused one, and ended when that one would have."""

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as disk:
        disk.setattr("gateway.service.running_rig.recording.recordings.Recorder", full)
        assert recordings.try_start(WantedRecording()).result()
        with pytest.raises(OSError, match="No space"):
            recordings.start(RecordingLabel("short try", ""), for_s=5.0).result()
        assert "No space" in recordings.status()["waits"]
    recordings.flush(100.0)
    recordings.flush(200.0)
    recordings.flush(300.0)
    assert recordings.status()["recording"], "it was not asked to end"
    assert label_of(list_recordings(tmp_path)[0].header) == RecordingLabel("", "")
    recordings.stop()


def test_another_plant_takes_label_and_end_along(recordings: Recordings, tmp_path: Path) -> None:
    recordings.start(RecordingLabel("long one"), for_s=5.0)
    recordings.flush(10.0)
    recordings.use_plant(demo())
    recordings.flush(14.9)
    assert recordings.status()["recording"].endswith("0002.fgr")
    recordings.flush(15.0)
    assert recordings.status() == {"recording": None}
    assert [label_of(entry.header).name for entry in list_recordings(tmp_path)] == ["long one", "long one"]


def test_the_next_recording_has_no_end_of_the_one_before(recordings: Recordings) -> None:
    recordings.start(for_s=1.0)
    recordings.flush(0.0)
    recordings.stop()
    recordings.start()
    recordings.flush(50.0)
    assert recordings.status()["recording"]
    recordings.stop()


def test_one_that_goes_on_for_days_goes_on_in_another_file(recordings: Recordings, tmp_path: Path) -> None:
    recordings.start(RecordingLabel("for ever"))
    for day in range(4):
        for later_s in (0.0, 0.01):
            recordings.flush(1.0 + 1.01 * day * LONGEST_S + later_s)
    assert recordings.status()["recording"].endswith("0004.fgr")
    assert recordings.status()["began_in"].endswith("0001.fgr"), "whoever follows it knows it by that"
    assert {label_of(entry.header).name for entry in list_recordings(tmp_path)} == {"for ever"}
    assert len([line for line in recordings._log if "as long as one may be" in line]) == 3
    recordings.stop()


def test_each_row_says_the_calibration_that_was_in_use_for_it(recordings: Recordings, tmp_path: Path) -> None:
    decision = Controller(demo().control, CalibrationInUse(bsfm(), 1)).safe_output(FaultCode.NONE)
    recordings.start()
    for at_s, number in ((1000.0, 3), (1000.25, 3), (1000.5, 4)):
        recordings.calibration = replace(demo().calibration, number=number)
        recordings.append(ForceSample(1.0, 12.5, Quality.OK, time_s=at_s), decision, LineState(0.0, 0.0, 0.0))
    recordings.stop()
    (path,) = recording_paths(tmp_path)
    columns = read_recording(path).columns
    assert columns[CALIBRATION].tolist() == [3.0, 3.0, 4.0]
    assert columns["time_s"].tolist() == [0.0, 0.25, 0.5], "since its own first row"


def test_a_cell_that_is_silent_for_long_is_no_disk_that_hangs(recordings: Recordings) -> None:
    decision = Controller(demo().control, CalibrationInUse(bsfm(), 1)).safe_output(FaultCode.NONE)
    recordings.start()
    for at_s in (1.0, 2.0, 2.0 + 2.0 * HANGS_S):
        recordings.append(ForceSample(1.0, 12.5, Quality.OK, time_s=at_s), decision, LineState(0.0, 0.0, 0.0))
        recordings.flush(at_s)
        recordings.flush(at_s + 1.0)
    assert recordings.status()["rows"] == 3 and not [line for line in recordings._log if "E402" in line]
    recordings.stop()


def test_with_each_next_file_it_is_looked_at_once_what_there_is_no_room_for(tmp_path: Path) -> None:
    """An hour of samples is more than an eighth of what a small limit has room for."""
    limited = replace(demo(), retention=Retention(days=80.0))
    recordings, looked = Recordings(tmp_path / "recordings", limited, Log(), AtOnce()), []
    recordings._retention._worker = lambda work, done: looked.append(work)  # type: ignore[assignment]
    recordings.start()
    for at_s in (1.0, 2.0, 1.0 + LONGEST_S / 48.0, 1.0 + 1.1 * LONGEST_S, 2.0 + 1.1 * LONGEST_S):
        recordings.flush(at_s)
    recordings.stop()
    assert recordings.status()["recording"] is None and len(looked) == 3, (
        "at the start, after hours, with the next file"
    )


@pytest.mark.parametrize("limit", [Retention(days=1.0e-6), Retention(bytes=1_000_000)], ids=["days", "bytes"])
def test_limits_that_have_room_for_no_file_make_one_in_ten_seconds_and_not_one_a_tick(
    limit: Retention, tmp_path: Path
) -> None:
    """A hundred files a second, each with the texts of the rig, were the disk's end."""
    texts = {"rig.yaml": "#" * 200_000}
    recordings = Recordings(tmp_path / "recordings", replace(demo(), texts=texts, retention=limit), Log(), AtOnce())
    recordings._retention = SimpleNamespace(tick=lambda now_s: None, hasten=lambda: None)  # type: ignore[assignment]
    recordings.start()
    for tick in range(250):
        recordings.flush(0.1 * tick)
    assert recordings.status()["recording"].endswith("0003.fgr")
    recordings.stop()


def test_a_disk_that_takes_no_header_has_no_recording_and_says_so(
    recordings: Recordings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "write", lambda descriptor, data: 3)
    with pytest.raises(OSError, match="No space left"):
        recordings.start().result()
    monkeypatch.undo()
    assert recordings.status() == {"recording": None}
    assert list_recordings(tmp_path) == []
    assert recordings.start().result()["recording"].endswith("0001.fgr")
    recordings.stop()


def test_one_that_the_disk_ends_at_its_first_rows_waits_for_room(
    recordings: Recordings, monkeypatch: pytest.MonkeyPatch
) -> None:
    recordings.start().result()
    recordings._current._gathered.append((0.0,) * len(RUN_COLUMNS))
    with monkeypatch.context() as patch:
        patch.setattr(os, "write", lambda descriptor, data: 3)
        recordings.flush(5.0)
    assert recordings.status()["recording"] is None and "No space left" in recordings.status()["waits"]
    recordings.stop()


def test_one_that_a_full_disk_has_ended_goes_on_when_there_is_room(
    recordings: Recordings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Half a minute later, then after a minute, two ...; its name and its end are those of before."""
    recordings.start(RecordingLabel("long one"), for_s=7200.0)
    recordings.flush(0.0)
    real_write, is_full = os.write, [True]
    monkeypatch.setattr(os, "write", lambda descriptor, data: real_write(descriptor, data[:3] if is_full[0] else data))
    begin, tries = recordings._begin, []
    monkeypatch.setattr(recordings, "_begin", lambda opened: (tries.append(now_s), begin(opened)))
    recordings._current._gathered.append((0.0,) * len(RUN_COLUMNS))
    for now_s in range(300):
        recordings.flush(float(now_s))
    assert tries == [32, 93, 214]
    assert "E402" in recordings._log[0]
    assert recordings.status()["waits"], "said to whoever asks"
    assert list_recordings(tmp_path) == [], "no file for each try"
    is_full[0] = False
    for now_s in range(300, 2000):
        recordings.flush(float(now_s))
    assert recordings.status()["recording"]
    assert "it goes on: recording to" in recordings._log[-1]
    is_full[0] = True
    recordings._current._gathered.append((0.0,) * len(RUN_COLUMNS))
    for now_s in range(2000, 2040):
        recordings.flush(float(now_s))
    assert tries[-1] == 2031, "it went well for long enough: half a minute again"
    is_full[0] = False
    for now_s in range(2040, 2100):
        recordings.flush(float(now_s))
    recordings.flush(7201.0)
    assert recordings.status() == {"recording": None}
    assert [label_of(entry.header).name for entry in list_recordings(tmp_path)] == ["long one"]


def test_whoever_ends_one_that_waits_for_room_has_ended_it(
    recordings: Recordings, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(os, "write", lambda descriptor, data: 3)
        assert "No space left" in recordings.try_start(WantedRecording()).result()[0]
        recordings.flush(0.0)
    assert recordings.stop().result() == {"recording": None}
    recordings.flush(1000.0)
    assert recordings.status() == {"recording": None}


def test_what_the_last_batch_has_cost_is_said_to_whoever_ends_it(
    recordings: Recordings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recordings.start()
    recordings._current._gathered.append((0.0,) * len(RUN_COLUMNS))
    monkeypatch.setattr(os, "write", lambda descriptor, data: 3)
    ended = recordings.stop().result()
    assert ended["rows"] == 0
    assert ended["fault"].startswith("E402") and recordings._log == [ended["fault"]]


def test_whoever_begins_one_in_vain_leaves_it_waiting_for_room(
    recordings: Recordings, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(os, "write", lambda descriptor, data: 3)
        recordings.try_start(WantedRecording())
        with pytest.raises(OSError, match=r"recordings: No space left on device: the disk is full$"):
            recordings.start().result()
        recordings.flush(0.0)
    recordings.flush(1000.0)
    assert recordings.status()["recording"]
    recordings.stop()


def test_what_was_deleted_while_it_is_synced_need_not_outlive_a_power_cut(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def delete_first(path: Path) -> None:
        path.unlink(missing_ok=True)
        sync_recording(path)

    monkeypatch.setattr("gateway.service.running_rig.recording.run_recording.sync_recording", delete_first)
    log = Log()
    recordings = Recordings(tmp_path / "recordings", demo(), log, AtOnce())
    recordings.start()
    recordings.stop()
    assert not [line for line in log if "power cut" in line]
