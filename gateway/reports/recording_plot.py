"""A recording as a picture: forces and the voltage against time, as a page or as one SVG file."""

from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING, Final

from gateway.recording import Recording
from gateway.recording.care.what_happened import tell_happened
from gateway.recording.label import label_of
from gateway.reports import frame
from gateway.reports.axis import Axis, spread
from gateway.reports.figures import drawing, figure
from gateway.reports.style import inline_style
from gateway.reports.svg_chart import Chart

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_LEAST_ROWS: Final = 2
_DRAWN: Final = 700
"""Places along a curve; each shows the lowest and the highest value there."""
_PANELS: Final = (
    ("Force", "force (N)", (("setpoint_n", "before", "setpoint"), ("force_n", "after", "measured"))),
    ("Command", "command (V)", (("command_v", "bsfm", "command"),)),
)
_WIDTH, _LEFT, _ABOVE, _BELOW = 1200, 70, 90, 60  # of the SVG file, px


def why_no_picture(recording: Recording) -> str:
    """Return why a recording cannot be drawn, as what is said of it; empty where it can."""
    if "time_s" not in recording.columns:
        return "has no column time_s: nothing to draw"
    return f"has {recording.rows} rows: nothing to draw" if recording.rows < _LEAST_ROWS else ""


def recording_page(recording: Recording) -> str:
    """Return a page with the drawings of a recording that has a picture."""
    figures = "".join(figure(title, drawing(chart), "", "full") for title, chart in _charts(recording))
    header, label = recording.header, label_of(recording.header)
    head = frame.Head(
        kind="Recording",
        answer=_title(recording),
        sentences=(label.note, _words(recording)),
        facts=(f"rig {header.get('rig')}", f"started {header.get('started_utc')}", *recording.notes),
    )
    return frame.page(head, [figures], {"recording": recording.path.name, "calibration": header.get("calibration")})


def recording_svg(recording: Recording) -> str:
    """Return one SVG file with the drawings of a recording that has a picture."""
    charts, parts, down = _charts(recording), [], _ABOVE
    for _, chart in charts:
        parts.append(chart.svg_at(_LEFT, down, _WIDTH))
        down += chart.height + _BELOW + 30
    words = "".join(
        f'<text class="name start" x="{_LEFT}" y="{24 + 20 * line}">{escape(text)}</text>'
        for line, text in enumerate((_title(recording), _words(recording)))
    )
    room = f'viewBox="0 0 {_LEFT + _WIDTH + 30} {down}"'
    style = f"<style>{escape(inline_style(), quote=False)}</style>"
    paper = '<rect width="100%" height="100%" style="fill: var(--paper)"/>'
    body = f'{style}{paper}<g class="plot">{words}{"".join(parts)}</g>'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {room} role="img">{body}</svg>\n'


def _title(recording: Recording) -> str:
    time_s, name = recording.columns["time_s"], label_of(recording.header).name
    named = f" ({name})" if name else ""
    number = recording.header.get("number", recording.path.stem)
    return f"Recording {number}{named}: {time_s[-1] - time_s[0]:.1f}\u00a0s, {recording.rows}\u00a0rows"


def _words(recording: Recording) -> str:
    happened = tell_happened(recording)
    return happened.as_words() if happened else ""


def _charts(recording: Recording) -> list[tuple[str, Chart]]:
    charts = ((title, _chart(recording, title, label, names)) for title, label, names in _PANELS)
    return [(title, chart) for title, chart in charts if chart]


def _chart(recording: Recording, title: str, label: str, names: Iterable[tuple[str, str, str]]) -> Chart | None:
    """Return the curves of a panel; None where no value is known."""
    time_s = recording.columns["time_s"]
    known: Sequence[tuple[tuple[list[float], list[float]], str, str]] = [
        (_thinned(time_s, _drawn(recording, name)), style, words)
        for name, style, words in names
        if name in recording.columns
    ]
    values = [value for (_, ys), _, _ in known for value in ys]
    if not values:
        return None
    across = Axis(float(time_s[0]), max(float(time_s[-1]), float(time_s[0]) + 1e-3), "time (s)")
    chart = Chart(across, Axis(*spread(values), label), title, width=_WIDTH)
    for (xs, ys), style, words in known:
        if xs:
            chart.line(xs, ys, style, words)
    return chart


def _drawn(recording: Recording, name: str) -> "NDArray[np.float64]":
    """Return the values of a column: the setpoint of a pull, which is told without a sign, beside the force of it."""
    import numpy as np

    from gateway.recording.tables.row_validity import pulled_rows

    values = recording.columns[name]
    return np.where(pulled_rows(recording.columns), -values, values) if name == "setpoint_n" else values


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
