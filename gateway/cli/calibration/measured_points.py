"""The measured points that a stored calibration was made from, where its recording is still there and says the same."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from gateway.bsfm import Calibration
from gateway.plain_file import is_file
from gateway.processes.state_directory import RECORDINGS

if TYPE_CHECKING:
    from gateway.bsfm.ladder.check import CheckedLadder


@dataclass(frozen=True, slots=True)
class MeasuredPoints:
    """A ladder and its partial reversals, or why there are none to show."""

    checked: "CheckedLadder | None"
    why: str = ""

    def describe(self, letter: str, models: tuple[Calibration, Calibration]) -> str:
        """Return how far A and B are off at these points, each with the memory of its own reversals; empty without points.
        letter: of the calibration that was made from them."""
        if self.checked is None:
            return ""
        from gateway.bsfm.fit.model_error import Error, measured_error_n

        first, second = (Error.of(measured_error_n(each.model(), self.checked)) for each in models)
        return (
            f"At the {first.points} points that {letter} was made from, A is off by {first.rms_n:.3f} N RMS and B by "
            f"{second.rms_n:.3f} N RMS"
        )


def measured_points(calibration: Calibration, state: Path) -> MeasuredPoints:
    """Return the points whose hash the calibration carries. state: the directory that its recordings may be in."""
    if not calibration.data_sha256:
        return MeasuredPoints(None, "it names no data that it was made from")
    file = _recording_of(calibration, state)
    if file is None:
        return MeasuredPoints(None, f"its recording is not here ({calibration.source or 'not named'})")
    from gateway.bsfm.ladder.ladder_error import LadderError
    from gateway.recording.errors import RecordingError
    from gateway.service.fitting.ladder_fit import data_sha256
    from gateway.service.fitting.ladder_source import RigContext, check_source, read_source

    try:
        checked = check_source(read_source(file), RigContext(state=state))
    except (LadderError, RecordingError, OSError, ValueError) as error:
        return MeasuredPoints(None, f"{file} cannot be read as it was: {error}")
    if data_sha256(checked) != calibration.data_sha256:
        return MeasuredPoints(None, f"{file} holds other data than it was made from")
    return MeasuredPoints(checked)


def _recording_of(calibration: Calibration, state: Path) -> Path | None:
    """The file that the source names, `recording NAME: ...`: among the gateway's recordings, else in this directory."""
    name = calibration.source.removeprefix("recording ").partition(":")[0]
    if not name or Path(name).name != name:
        return None
    candidates = (state / RECORDINGS / name, Path(name))
    return next((path for path in candidates if is_file(path)), None)
