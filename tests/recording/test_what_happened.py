"""What the list of recordings says of each."""

from pathlib import Path

from gateway.bsfm.ladder.plan import LABELS
from gateway.recording import Recorder
from gateway.recording.care.summaries import list_summaries
from gateway.registers.words import CalibrationPhase


def test_a_ladder_that_was_cut_says_how_far_it_has_climbed(tmp_path: Path) -> None:
    """It read like a whole one."""
    for last in (CalibrationPhase.LADDER, CalibrationPhase.FITTING):
        header = {"ladder": {"groups": 2, "step_v": 0.5, "stairs": 85}}
        recorder = Recorder(tmp_path / "recordings", header, ("time_s", *LABELS))
        for row in range(46):
            recorder.append((float(row), float(last if row == 45 else CalibrationPhase.LADDER), 0.0, float(row)))
        recorder.close()
    cut, whole = (summary["happened"] for summary in list_summaries(tmp_path))
    assert cut == "calibration ladder of 2 × 0.5 V stairs, 45 of 85 stairs climbed"
    assert whole == "calibration ladder of 2 × 0.5 V stairs"
