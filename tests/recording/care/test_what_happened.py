"""What the list of recordings says of each."""

from pathlib import Path

import pytest

from gateway.bsfm.ladder.plan import LABELS
from gateway.profiles.recordings_section import Retention
from gateway.recording import Recorder, recording_paths
from gateway.recording.care.keeping import choose_prunable
from gateway.recording.care.summaries import list_summaries
from gateway.registers.words import CalibrationPhase


@pytest.mark.parametrize(("groups", "words"), [(1, "1 group"), (2, "2 groups")])
def test_a_ladder_that_was_cut_says_how_far_it_has_climbed(tmp_path: Path, groups: int, words: str) -> None:
    """It read like a whole one; and `1 × 0.5 V stairs` like one stair."""
    for last in (CalibrationPhase.LADDER, CalibrationPhase.FITTING):
        header = {"ladder": {"groups": groups, "step_v": 0.5, "stairs": 85}}
        recorder = Recorder(tmp_path / "recordings", header, ("time_s", *LABELS))
        for row in range(46):
            recorder.append((float(row), float(last if row == 45 else CalibrationPhase.LADDER), 0.0, float(row)))
        recorder.close()
    cut, whole = (summary["happened"] for summary in list_summaries(tmp_path))
    assert cut == f"calibration ladder of {words} of 0.5 V stairs, 45 of 85 stairs climbed"
    assert whole == f"calibration ladder of {words} of 0.5 V stairs"


def test_a_recording_lasts_from_its_first_row_to_its_last(tmp_path: Path) -> None:
    """Times count from the start of the gateway: one of 2 s read like one of half a minute."""
    recorder = Recorder(tmp_path / "recordings", {}, ("time_s", "force_n"))
    for row in range(21):
        recorder.append((30.0 + 0.1 * row, 1.0))
    recorder.close()
    (summary,) = list_summaries(tmp_path)
    assert summary["duration_s"] == pytest.approx(2.0)


def test_of_two_limits_the_tighter_one_counts(tmp_path: Path) -> None:
    """What `service install` advises: bytes and days."""
    for _ in range(3):
        Recorder(tmp_path / "recordings", {}, ("time_s", "force_n")).close()
    paths = recording_paths(tmp_path)
    now_s = paths[-1].stat().st_mtime + 86_400.0
    size = paths[0].stat().st_size
    for limits, gone in (((2 * size, 30.0), paths[:1]), ((9 * size, 0.5), paths), ((9 * size, 30.0), [])):
        chosen = choose_prunable(paths, Retention(bytes=limits[0], days=limits[1]), "", now_s)
        assert [one.path for one in chosen] == gone
