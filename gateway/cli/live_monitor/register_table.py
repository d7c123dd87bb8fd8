"""What a frame is drawn from, and its register table: value, words, when it changed, who wrote it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from rich.text import Text

from gateway.cli.live_monitor.flow import TableCell, row_lines
from gateway.cli.live_monitor.history import Track
from gateway.cli.master.value_text import format_value, raw

_PLAIN: Final = 72  # columns from which raw words (without writers) and the age of a change are shown
_ROOMY: Final = 100  # columns from which the writer's port is shown too
_WIDE: Final = 78  # columns that a table needs so that two stand side by side
_WIDE_WITH_WRITERS: Final = 104
_HEADINGS: Final = ("addr", "register", "value", "raw", "changed", "writer")
_STYLES: Final = {"addr": "dim", "raw": "dim", "changed": "dim", "writer": "dim"}
_FIRST: Final = (
    "state",
    "force_setpoint",
    "force_measured",
    "force_applied",
    "output_voltage",
    "fault_code",
    "limited_by",
    "control_word",
    "status_word",
    "warning_word",
    "feedforward",
    "trim",
    "model_residual",
    "residual_cause",
    "pressure",
    "sample_age",
    "owner_ip",
    "refusal_reason",
    "refusal_address",
    "mode",
    "heartbeat",
    "missed_ticks",
    "loop_time",
    "calibration_id",
    "plant_id",
    "calibration_phase",
    "calibration_progress",
    "calibration_time_left",
)
"""Registers in the order in which a small terminal shows them."""


@dataclass(frozen=True, slots=True)
class Writer:
    """Who wrote a register last, and how long ago."""

    host: str
    port: str
    age_s: float


@dataclass(frozen=True, slots=True)
class View:
    """What a frame is drawn from. trouble: why there is no answer now; writers: by register or block name, None if unknown;
    hint: what a key does, and what cannot be shown."""

    track: Track
    where: str
    width: int
    height: int
    trouble: str = ""
    writers: Mapping[str, Writer] | None = None
    hint: str = ""


def register_lines(view: View, rows: int) -> list[Text]:
    """Return a table of as many registers as fit; two side by side where the terminal is wide. A value that is too long goes
    on below itself."""
    names: list[str] = [name for name in _FIRST if name in view.track.readings]
    names += [name for name in view.track.readings if name not in names]
    count = max(1, view.width // (_WIDE if view.writers is None else _WIDE_WITH_WRITERS))
    width = (view.width - 2 * (count - 1)) // count
    heading = row_lines([cell._replace(style="bold dim") for cell in _cells(view, width)])
    columns = []
    for _ in range(count):
        lines, names = _fill(view, names, width, rows)
        columns.append(heading + lines)
    return [_side_by_side(columns, line, width) for line in range(max(map(len, columns)))]


def _fill(view: View, names: Sequence[str], width: int, rows: int) -> tuple[list[Text], list[str]]:
    """Return the lines of the registers that fit whole, and the names that are left for another column."""
    lines: list[Text] = []
    left: list[str] = []
    for name in names:
        row = row_lines(_cells(view, width, name)) if len(lines) < rows else []
        if row and (len(lines) + len(row) <= rows or not lines):
            lines += row
        else:
            left.append(name)
    return lines, left


def _side_by_side(columns: Sequence[Sequence[Text]], at: int, width: int) -> Text:
    line = Text(no_wrap=True)
    for column in columns:
        text = column[at].copy() if at < len(column) else Text()
        text.pad_right(width - text.cell_len)
        line.append_text(text).append("  ")
    line.right_crop(2)
    return line


def _cells(view: View, width: int, register: str = "") -> list[TableCell]:
    """Return the cells of one register, without a name those of the heading. A narrow table has the value and who wrote it,
    not its raw words and when they changed."""
    has_writers = view.writers is not None
    words = _words_of(view, register) if register else dict(zip(_HEADINGS, _HEADINGS, strict=True))
    widths = {"addr": 4 if width >= _PLAIN or not has_writers else 0, "value": 0}
    widths |= {"raw": 9} if width >= _PLAIN else {}
    widths |= {"changed": 8} if width >= (_ROOMY if has_writers else _PLAIN) else {}
    widths |= {"writer": _writer_width(width)} if has_writers else {}
    widths["register"] = max(map(len, view.track.readings), default=8)
    widths = {name: widths[name] for name in _HEADINGS if widths.get(name) or name == "value"}
    widths["value"] = max(8, width - sum(widths.values()) - len(widths) + 1)
    styles = {"value": _freshness(view, register)} if register else {}
    return [
        TableCell(words[column], columns, styles.get(column, _STYLES.get(column, "")), column in ("addr", "changed"))
        for column, columns in widths.items()
    ]


def _writer_width(width: int) -> int:
    """An address with its port and seconds; without the port; the address alone, seconds below it."""
    return 25 if width >= _ROOMY else 19 if width >= _PLAIN else 15


def _freshness(view: View, name: str) -> str:
    age_s = view.track.change_age_s(name)
    return "bold" if age_s is not None and age_s < 1.0 else ""


def _words_of(view: View, name: str) -> dict[str, str]:
    reading = view.track.readings[name]
    age_s = view.track.change_age_s(name)
    writer = (view.writers or {}).get(name, (view.writers or {}).get(reading.register.block))
    return {
        "addr": str(reading.register.address),
        "register": name,
        "value": format_value(reading),
        "raw": raw(reading),
        "changed": "-" if age_s is None else f"{age_s:.0f} s",
        "writer": _writer(writer, view) if writer else "",
    }


def _writer(writer: Writer, view: View) -> str:
    port = f":{writer.port}" if writer.port and view.width >= _ROOMY else ""
    return f"{writer.host}{port} {writer.age_s:.0f} s"
