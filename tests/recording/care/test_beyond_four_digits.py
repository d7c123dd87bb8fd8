"""The ten-thousandth recording: its name, 10000, stands before 9998."""

import os
from pathlib import Path

from gateway.profiles.recordings_section import Retention
from gateway.recording import recording_paths
from gateway.recording.care.keeping import choose_prunable
from gateway.web.tabs.diagnosis_job import kept_diagnoses

NOW_S = 1_700_000_000.0
NUMBERS = (9998, 9999, 10000, 10001)


def test_what_ended_at_the_same_time_goes_by_its_number(tmp_path: Path) -> None:
    """As all do whose time is still to come, for the clock was set back."""
    (tmp_path / "recordings").mkdir()
    for number in NUMBERS:
        path = tmp_path / "recordings" / f"{number:04d}.fgr"
        path.write_bytes(bytes(100))
        os.utime(path, (NOW_S + 86400.0, NOW_S + 86400.0))
    gone = choose_prunable(recording_paths(tmp_path), Retention(bytes=200), "", NOW_S)
    assert [one.path.stem for one in gone] == ["9998", "9999"]


def test_kept_diagnoses_are_shown_from_the_newest_recording_on(tmp_path: Path) -> None:
    (tmp_path / "diagnoses").mkdir()
    for number in NUMBERS:
        for suffix in ("json", "html"):
            (tmp_path / "diagnoses" / f"{number:04d}.{suffix}").write_text("{}")
    assert [one["recording"] for one in kept_diagnoses(tmp_path)] == [10001, 10000, 9999, 9998]
