"""Which calibrations were in use in a recording, and from when on: its header tells the first alone."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from gateway.recording.reader import Recording
from gateway.recording.tables.column_names import CALIBRATION, DERIVED

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_MOST_TOLD: Final = 3


@dataclass(frozen=True, slots=True)
class CalibrationUsed:
    """number: 0 the rig's own; from_s: since the first row."""

    number: int
    from_s: float


def numbers_by_row(recording: Recording) -> "NDArray[np.float64] | None":
    """Return the number in use of each row; None where the recording does not tell it row by row."""
    columns = recording.columns
    return columns[CALIBRATION] if CALIBRATION in columns and set(DERIVED) <= set(columns) else None


def later_calibrations(recording: Recording) -> list[CalibrationUsed]:
    """Return each change to another calibration amid the recording, in the order of time."""
    import numpy as np

    numbers = numbers_by_row(recording)
    if numbers is None or "time_s" not in recording.columns:
        return []
    known = np.flatnonzero(np.isfinite(numbers))
    changed = known[1:][np.diff(numbers[known]) != 0.0]
    time_s = recording.columns["time_s"]
    return [CalibrationUsed(int(numbers[row]), float(time_s[row] - time_s[0])) for row in changed]


def tell_changes(recording: Recording) -> str:
    """Return the changes in a few words; empty where there was none."""
    later = later_calibrations(recording)
    told = [f"calibration {one.number} from {one.from_s:.2f} s on" for one in later[:_MOST_TOLD]]
    left = len(later) - len(told)
    return ", ".join([*told, f"{left} more changes of calibration"] if left else told)
