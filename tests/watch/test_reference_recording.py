"""The rig's reference recording: what is kept as one, by whom, and what never is."""

import json
import os
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner, Result

from gateway.cli.main import command
from gateway.numbered_documents.selection import Selection, SelectionState, write_selection
from gateway.processes import exit_codes
from gateway.processes.durable_file import lock_directory, make_directory
from gateway.recording import Recorder, read_header
from gateway.service.running_rig.recording.recorded_row import COLUMNS
from gateway.watch import reference_recording
from gateway.watch.reference_recording import (
    FirstGoodRecording,
    keep_reference_recording,
    read_reference_recording,
    reference_path,
    why_no_reference,
)


def record(
    state: Path, lasts_s: float = 40.0, *, calibration: int = 2, swing_v: float = 1.0, fault: float = 0.0
) -> Path:
    """A recording of 20 rows a second, begun a minute from now and not written to any more."""
    header = {"rig": "demo", "calibration": calibration, "started_utc": _utc(time.time() + 60.0)}
    recorder = Recorder(state / "recordings", header, COLUMNS)
    for time_s in np.arange(0.0, lasts_s, 0.05):
        row = {"time_s": time_s, "command_v": 2.0 + swing_v * np.sin(time_s), "force_n": 17.0, "fault_code": fault}
        recorder.append(tuple(float(row.get(name, 0.0)) for name in COLUMNS))
    recorder.close()
    os.utime(recorder.path, (0.0, 0.0))
    return recorder.path


def _utc(at_s: float) -> str:
    return time.strftime("%Y-%m-%dT%H:%M:%S.000Z", time.gmtime(at_s))


def use_calibration(state: Path, number: int) -> None:
    make_directory(state / "calibrations")
    with lock_directory(state / "calibrations") as descriptor:
        write_selection(state / "calibrations", descriptor, SelectionState(active=Selection(number)))


def reference(state: Path, *words: object) -> Result:
    return CliRunner().invoke(command, ["recordings", "reference", *map(str, words), "--state", str(state)])


def test_a_chosen_recording_outlives_the_recording(tmp_path):
    path = record(tmp_path)
    told = reference(tmp_path, 1)
    assert told.exit_code == 0 and "reference: 0001.fgr, chosen" in told.output
    content = path.read_bytes()
    path.unlink()
    known = read_reference_recording(tmp_path)
    assert known is not None and reference_path(tmp_path, known).read_bytes() == content
    assert json.loads(reference(tmp_path, "--json").output)["reference"]["is_chosen"]


def test_another_choice_takes_the_first_ones_place(tmp_path):
    record(tmp_path), record(tmp_path, swing_v=1.5)
    reference(tmp_path, 1)
    reference(tmp_path, 2)
    known = read_reference_recording(tmp_path)
    assert known is not None and known.name == "0002.fgr"
    assert sorted(path.name for path in (tmp_path / "reference").iterdir()) == [known.file, "reference.json"]
    assert "any more" in reference(tmp_path, "--none").output
    assert read_reference_recording(tmp_path) is None


@pytest.mark.parametrize(
    ("facts", "why"),
    [({"lasts_s": 10.0}, "shorter"), ({"swing_v": 0.01}, "hardly moves"), ({"fault": 202.0}, "a fault stood")],
)
def test_what_does_not_show_the_machine_is_no_reference(tmp_path, facts, why):
    assert why in why_no_reference(record(tmp_path, **facts))
    refused = reference(tmp_path, 1)
    assert refused.exit_code == exit_codes.DATA and "E523" in refused.output
    assert read_reference_recording(tmp_path) is None


def test_a_reference_that_may_be_another_machines_is_taken_and_told(tmp_path):
    """The watch compares this machine with it from then on; a table of anybody's was taken without a word."""
    own = record(tmp_path)
    assert reference(tmp_path, 1).stderr == ""
    rows = [f"{at / 20:.2f},{2.0 + np.sin(at / 20):.3f},17.0" for at in range(800)]
    foreign = tmp_path / "foreign.csv"
    foreign.write_text("\n".join(["time_s,command_v,force_n", *rows]))
    told = reference(tmp_path, foreign)
    assert told.exit_code == 0 and "reference: foreign.csv, chosen" in told.stdout
    assert "foreign.csv does not say which rig it is of" in told.stderr and "reference --none" in told.stderr
    foreign.write_text("\n".join(["# rig: irc5-cell", "time_s,command_v,force_n", *rows]))
    assert "foreign.csv is of rig irc5-cell, and this is demo" in reference(tmp_path, foreign).stderr
    assert read_header(own)["rig"] == "demo"


def test_a_table_without_the_command_is_told_so_and_not_that_it_is_short(tmp_path):
    table = tmp_path / "force.csv"
    table.write_text(
        "\n".join(["time_s,pressure_kpa,force_n", *(f"{at / 20:.2f},{at % 300},17.0" for at in range(800))])
    )
    refused = reference(tmp_path, table)
    assert refused.exit_code == exit_codes.DATA and "has no command_v" in refused.output


def test_against_a_reference_that_is_not_there_says_how_to_make_one(tmp_path):
    path = record(tmp_path)
    told = CliRunner().invoke(command, ["diagnose", str(path), "--against", "reference", "--state", str(tmp_path)])
    assert told.exit_code == exit_codes.DATA
    assert "E403 no reference recording" in told.output and "recordings reference RECORDING" in told.output


def test_the_first_good_recording_after_a_calibration_came_into_use_is_kept(tmp_path):
    record(tmp_path, calibration=1), record(tmp_path, 10.0), record(tmp_path), record(tmp_path)
    assert FirstGoodRecording(tmp_path).keep(1.0e12) is None, "no calibration was taken into use"
    use_calibration(tmp_path, 2)
    kept = FirstGoodRecording(tmp_path).keep(1.0e12)
    assert kept is not None and (kept.name, kept.is_chosen) == ("0003.fgr", False)
    assert FirstGoodRecording(tmp_path).keep(1.0e12) is None, "there is one"
    use_calibration(tmp_path, 1)
    kept = FirstGoodRecording(tmp_path).keep(1.0e12)
    assert kept is not None and kept.name == "0001.fgr"


@pytest.mark.parametrize("zone", ["JST-9", "HST10"])
def test_the_zone_of_the_machine_says_nothing_of_when_it_was_recorded(tmp_path, monkeypatch, zone):
    """Hours east of Greenwich a recording would have begun before the calibration that it was made with came into use; hours
    west one of before would be the reference."""
    monkeypatch.setenv("TZ", zone)
    time.tzset()
    try:
        use_calibration(tmp_path, 2)
        path = record(tmp_path)
        assert reference_recording._begin_s(read_header(path)) == pytest.approx(time.time() + 60.0, abs=10.0)
        known = FirstGoodRecording(tmp_path).keep(time.time())
        assert known is not None and known.name == path.name
    finally:
        monkeypatch.undo()
        time.tzset()


def test_recordings_of_another_calibration_are_not_read_through(tmp_path, monkeypatch):
    """Each was, once: days of recordings went through the memory of the watch."""
    record(tmp_path, calibration=1), record(tmp_path, calibration=3), record(tmp_path)
    use_calibration(tmp_path, 2)
    read: list[str] = []
    whole = reference_recording.read_table
    monkeypatch.setattr(reference_recording, "read_table", lambda path: (read.append(path.name), whole(path))[1])
    kept = FirstGoodRecording(tmp_path).keep(1.0e12)
    assert kept is not None and read == ["0003.fgr"]


def test_what_a_user_has_chosen_stays(tmp_path):
    keep_reference_recording(tmp_path, record(tmp_path, calibration=1))
    record(tmp_path)
    use_calibration(tmp_path, 2)
    assert FirstGoodRecording(tmp_path).keep(1.0e12) is None


def test_a_recording_that_is_being_written_is_waited_for(tmp_path):
    use_calibration(tmp_path, 2)
    assert record(tmp_path).stat().st_mtime == 0.0
    record(tmp_path)
    assert FirstGoodRecording(tmp_path).keep(1.0) is None
    assert FirstGoodRecording(tmp_path).keep(10.0) is not None


def test_a_recording_from_while_the_clock_was_ahead_is_not_waited_for(tmp_path):
    """None was found for as long as the clock had been ahead, years, and nobody said so."""
    use_calibration(tmp_path, 2)
    ahead = record(tmp_path, 10.0)
    os.utime(ahead, (2.0e9, 2.0e9))
    record(tmp_path)
    kept = FirstGoodRecording(tmp_path).keep(1.9e9)
    assert kept is not None and kept.name == "0002.fgr"


def test_a_calibration_that_came_into_use_while_the_clock_was_ahead_finds_its_reference(tmp_path: Path) -> None:
    """None began behind that for as long as the clock had been ahead, years."""
    use_calibration(tmp_path, 2)
    (selection,) = (tmp_path / "calibrations").glob("active.*")
    os.utime(selection, (time.time() + 1e8, time.time() + 1e8))
    record(tmp_path, calibration=1)
    record(tmp_path)
    kept = FirstGoodRecording(tmp_path).keep(time.time())
    assert kept is not None and (kept.name, kept.calibration) == ("0002.fgr", 2)


def test_a_recording_from_before_the_calibration_came_into_use_is_none(tmp_path):
    record(tmp_path)
    use_calibration(tmp_path, 2)
    used_s = time.time() + 1e5
    os.utime(tmp_path / "calibrations" / "active.000001", (used_s, used_s))
    assert FirstGoodRecording(tmp_path).keep(used_s + 1e5) is None


@pytest.mark.parametrize(("name", "spoilt"), [("file", 3), ("file", None), ("file", "\0"), ("name", None)])
def test_a_note_whose_names_are_none_is_no_reference(tmp_path, name, spoilt):
    """The watch ended over it at each start, and no recording was pruned."""
    keep_reference_recording(tmp_path, record(tmp_path))
    note = tmp_path / "reference" / "reference.json"
    note.write_text(json.dumps(json.loads(note.read_text()) | {name: spoilt}))
    assert read_reference_recording(tmp_path) is None


def test_a_damaged_note_is_no_reference(tmp_path):
    keep_reference_recording(tmp_path, record(tmp_path))
    (tmp_path / "reference" / "reference.json").write_text("{")
    assert read_reference_recording(tmp_path) is None


def test_the_copy_is_on_the_disk_before_anything_says_that_it_is_the_reference(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A power cut between the two would else take the new one and the one before."""
    recording, done = tmp_path / "0007.fgr", list[str]()
    recording.write_bytes(b"rows")
    monkeypatch.setattr(reference_recording, "replace_durably", lambda descriptor, name, data: done.append(name))
    kept = keep_reference_recording(tmp_path, recording)
    assert done == [kept.file, "reference.json"] and kept.name == "0007.fgr"


def test_a_rig_that_has_gone_back_to_its_own_calibration_finds_no_reference(tmp_path: Path) -> None:
    """Nobody has said of that one that the machine is as it should be; kept, it would pass for a user's choice."""
    record(tmp_path, calibration=0), record(tmp_path)
    use_calibration(tmp_path, 2)
    with lock_directory(tmp_path / "calibrations") as descriptor:
        write_selection(tmp_path / "calibrations", descriptor, SelectionState(active=Selection(None)))
    assert FirstGoodRecording(tmp_path).keep(1.0e12) is None


def test_an_earlier_recording_that_is_being_written_is_waited_for_though_a_later_one_is_good(tmp_path: Path) -> None:
    """Two gateways, or a clock that went back: the first good one is the earlier."""
    use_calibration(tmp_path, 2)
    first = record(tmp_path)
    record(tmp_path)
    os.utime(first, (1000.0, 1000.0))
    assert FirstGoodRecording(tmp_path).keep(1001.0) is None
    kept = FirstGoodRecording(tmp_path).keep(2000.0)
    assert kept is not None and kept.name == first.name


@pytest.mark.parametrize(
    ("command_v", "lasts_s", "why"),
    [
        ([0.0, 1.0, 0.0, 1.0, 0.0, 1.0], 30.0, ""),
        ([0.0, 1.0, 0.0, 1.0, 0.0], 30.0, "hardly moves"),
        ([0.0, 1.0, 0.0, 1.0, 0.0, 1.0], 29.9, "shorter than 30 s"),
        ([0.0, 0.3, 0.0, 0.3, 0.0, 0.3], 30.0, "hardly moves"),
        ([1.0], 30.0, "shorter than 30 s"),
        ([], 30.0, "shorter than 30 s"),
    ],
)
def test_a_machine_is_described_by_half_a_minute_of_moves(command_v: list[float], lasts_s: float, why: str) -> None:
    time_s = 7.0 + np.linspace(0.0, lasts_s, len(command_v))
    recording = SimpleNamespace(columns={"time_s": time_s, "command_v": np.array(command_v)})
    told = reference_recording._why_it_says_little(recording)  # type: ignore[arg-type]
    assert why in told and bool(told) == bool(why)


def test_each_recording_is_read_once_for_each_calibration(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record(tmp_path, calibration=1), record(tmp_path, calibration=1)
    read = list[Path]()
    monkeypatch.setattr(reference_recording, "_is_first_good", lambda path, *_: read.append(path) and False)
    search = FirstGoodRecording(tmp_path)
    for number, reads in ((2, 2), (2, 2), (3, 4), (2, 4)):
        use_calibration(tmp_path, number)
        assert search.keep(1.0e12) is None
        assert len(read) == reads


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a folder away")
def test_a_reference_that_an_administrator_chooses_is_the_service_s(tmp_path: Path) -> None:
    """Where root's files are nobody else's (umask 077) the watch could not read it, and left it out."""
    os.chown(tmp_path, 501, 502)
    before = os.umask(0o077)
    try:
        reference = keep_reference_recording(tmp_path, record(tmp_path))
    finally:
        os.umask(before)
    assert reference_path(tmp_path, reference).stat().st_uid == 501
