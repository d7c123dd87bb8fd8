"""The recordings of a state directory for the page: the list, whole files in other forms, and a picture.

Everything here reads from the disk and runs in worker threads. An entry is read again only when its file has changed.
"""

import threading
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final

from gateway.codes.faults import FaultCode
from gateway.recording import Recording, find_recording, read_entry, read_recording, recording_paths
from gateway.recording.errors import RecordingError
from gateway.web.tabs.answers import NOT_FOUND, TabRefusedError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from gateway.reports.svg_chart import Chart

_LEAST_ROWS: Final = 2  # to say something of
FORMS: Final = ("csv", "parquet")
_DRAWN: Final = 700
"""Places along a curve; each shows the lowest and the highest value there."""


def recording_path(state: Path, number: int) -> Path:
    """Return the file of a number. TabRefusedError where there is none."""
    try:
        return find_recording(state, number)
    except RecordingError as error:
        raise TabRefusedError(f"E403 {error}", NOT_FOUND) from None


def recording_facts(state: Path) -> list[dict[str, Any]]:
    """Return every recording, the newest first."""
    rows = []
    for path in reversed(recording_paths(state)):
        status = path.stat()
        rows.append(_facts(path, status.st_mtime_ns, status.st_size))
    return rows


@lru_cache(maxsize=4096)
def _facts(path: Path, changed_ns: int, size_bytes: int) -> dict[str, Any]:
    """Return what the list says of one file, as it was when it was changed last and had this size."""
    entry = read_entry(path)
    header = entry.header
    return {
        "number": entry.number,
        "file": entry.path.name,
        "started_utc": header.get("started_utc"),
        "calibration": header.get("calibration"),
        "happened": "" if entry.fault or entry.rows < _LEAST_ROWS else _happened(entry.path),
        "rows": entry.rows,
        "duration_s": entry.duration_s,
        "size_bytes": entry.size_bytes,
        "truncated": entry.truncated,
        "fault": entry.fault,
    }


def _happened(path: Path) -> str:
    """Return in a few words what a recording holds: what was run, how often it was asked for another force, what was measured,
    and which faults there were."""
    import numpy as np

    recording = read_recording(path)
    columns, words = recording.columns, [_what_ran(recording.header)]
    known = {name: values[np.isfinite(values)] for name, values in columns.items()}
    setpoints = known.get("setpoint_n", np.empty(0))
    changes = int((np.diff(setpoints) != 0.0).sum())
    if changes:
        words.append(f"{changes} {'change' if changes == 1 else 'changes'} of setpoint, up to {setpoints.max():.4g} N")
    force_n = known.get("force_n", np.empty(0))
    if len(force_n):
        words.append(f"{force_n.min():.1f} to {force_n.max():.1f} N measured")
    faults = sorted({int(code) for code in known.get("fault_code", ()) if code})
    words += [f"fault {_name_of_fault(code)}" for code in faults]
    return ", ".join(words)


def _what_ran(header: dict[str, Any]) -> str:
    if ladder := header.get("ladder"):
        return f"calibration ladder of {ladder.get('groups', '?')} × {ladder.get('step_v', 0.0):g} V stairs"
    if experiment := header.get("experiment"):
        return f"experiment {experiment.get('name', '')}".strip()
    return "run"


def _name_of_fault(code: int) -> str:
    try:
        return FaultCode(code).explanation.code
    except ValueError:
        return str(code)


@dataclass(frozen=True, slots=True)
class ExportedFile:
    """A recording in another form, in a folder that is to be removed when it was sent."""

    path: Path
    folder: TemporaryDirectory[str]


_one_at_a_time: Final = threading.Lock()


def export_recording(state: Path, number: int, form: str) -> ExportedFile:
    """Write a recording as CSV or Parquet into a folder of its own. One at a time: a long one takes memory."""
    from gateway.recording import export_csv, export_parquet

    source = recording_path(state, number)
    with _one_at_a_time:
        recording = _read(source)
        folder = TemporaryDirectory(prefix="force-gateway-export-")
        target = Path(folder.name) / f"{recording.header.get('rig', 'recording')}-{number:04d}.{form}"
        try:
            (export_parquet if form == "parquet" else export_csv)(recording, target)
        except BaseException:
            folder.cleanup()
            raise
    return ExportedFile(target, folder)


def draw_recording(state: Path, number: int) -> str:
    """Return a page with two drawings: forces and the voltage against time."""
    from gateway.reports import frame
    from gateway.reports.figures import drawing, figure

    with _one_at_a_time:
        recording = _read(recording_path(state, number))
    if recording.rows < _LEAST_ROWS:
        raise TabRefusedError(f"recording {number} has {recording.rows} rows: nothing to draw")
    charts = [(title, _chart(recording, title, label, names)) for title, label, names in _PANELS]
    figures = "".join(figure(title, drawing(chart), "", "full") for title, chart in charts if chart)
    header, time_s = recording.header, recording.columns["time_s"]
    head = frame.Head(
        kind="Recording",
        answer=f"Recording {number}: {time_s[-1] - time_s[0]:.1f}\u00a0s, {recording.rows}\u00a0rows",
        facts=(f"rig {header.get('rig')}", f"started {header.get('started_utc')}", *recording.notes),
    )
    return frame.page(head, [figures], {"recording": recording.path.name, "calibration": header.get("calibration")})


def _chart(recording: Recording, title: str, label: str, names: "Sequence[tuple[str, str, str]]") -> "Chart | None":
    """Return the curves of a panel; None where no value is known."""
    from gateway.reports.axis import Axis, spread
    from gateway.reports.svg_chart import Chart

    time_s = recording.columns["time_s"]
    known = [
        (_thinned(time_s, recording.columns[name]), style, words)
        for name, style, words in names
        if name in recording.columns
    ]
    values = [value for (_, ys), _, _ in known for value in ys]
    if not values:
        return None
    across = Axis(float(time_s[0]), max(float(time_s[-1]), float(time_s[0]) + 1e-3), "time (s)")
    chart = Chart(across, Axis(*spread(values), label), title, width=1200)
    for (xs, ys), style, words in known:
        if xs:
            chart.line(xs, ys, style, words)
    return chart


_PANELS: Final = (
    ("Force", "force (N)", (("setpoint_n", "before", "setpoint"), ("force_n", "after", "measured"))),
    ("Command", "command (V)", (("command_v", "bsfm", "command"),)),
)


def _thinned(time_s: "NDArray[np.float64]", values: "NDArray[np.float64]") -> tuple[list[float], list[float]]:
    """Return a curve in few points that looks the same: of each stretch its lowest and its highest value, in order of time."""
    import numpy as np

    known = np.flatnonzero(np.isfinite(values))
    if len(known) <= 2 * _DRAWN:
        return time_s[known].tolist(), values[known].tolist()
    kept: list[int] = []
    for part in np.array_split(known, _DRAWN):
        low, high = int(part[values[part].argmin()]), int(part[values[part].argmax()])
        kept += [low, high] if low < high else [high, low]
    return time_s[kept].tolist(), values[kept].tolist()


def _read(path: Path) -> Recording:
    try:
        return read_recording(path)
    except RecordingError as error:
        raise TabRefusedError(f"E403 {error}") from None
