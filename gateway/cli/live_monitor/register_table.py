"""What a frame is drawn from, and its register table: value, words, when it changed, who wrote it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from rich.table import Table
from rich.text import Text

from gateway.cli.live_monitor.history import Track
from gateway.cli.master.value_text import format_value, raw

_ROOMY: Final = 100  # columns from which the writer's port is shown too
_FIRST: Final = (
    "state",
    "status_word",
    "fault_code",
    "warning_word",
    "limited_by",
    "control_word",
    "force_setpoint",
    "force_measured",
    "force_applied",
    "output_voltage",
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
    """What a frame is drawn from. trouble: why there is no answer now; writers: by register or block name, None if unknown."""

    track: Track
    where: str
    width: int
    height: int
    trouble: str = ""
    writers: Mapping[str, Writer] | None = None


def register_table(view: View, rows: int) -> Table:
    """Return a table of as many registers as fit; two side by side where the terminal is wide."""
    names: list[str] = [name for name in _FIRST if name in view.track.readings]
    names += [name for name in view.track.readings if name not in names]
    columns = max(1, view.width // 78) if view.writers is None else max(1, view.width // 104)
    table = Table.grid(expand=True, padding=(0, 1))
    for _ in range(columns):
        _add_columns(table, view)
    heading: list[Any] = []
    for _ in range(columns):
        heading += [Text(word, style="bold dim") for word in _headings(view)]
    table.add_row(*heading)
    for row in range(rows):
        cells: list[Any] = []
        for column in range(columns):
            index = column * rows + row
            cells += _cells(view, names[index]) if index < len(names) else [""] * len(_headings(view))
        table.add_row(*cells)
    return table


def _headings(view: View) -> list[str]:
    return ["addr", "register", "value", "raw", "changed", *(["writer"] if view.writers is not None else [])]


def _add_columns(table: Table, view: View) -> None:
    table.add_column(justify="right", width=4)
    table.add_column(width=17, no_wrap=True)
    table.add_column(ratio=1, no_wrap=True, overflow="ellipsis")
    table.add_column(width=9, no_wrap=True)
    table.add_column(justify="right", width=8)
    if view.writers is not None:
        table.add_column(width=19 if view.width < _ROOMY else 25, no_wrap=True, overflow="ellipsis")


def _cells(view: View, name: str) -> list[Any]:
    reading = view.track.readings[name]
    age_s = view.track.change_age_s(name)
    fresh = "bold" if age_s is not None and age_s < 1.0 else ""
    cells = [
        Text(str(reading.register.address), style="dim"),
        name,
        Text(format_value(reading), style=fresh),
        Text(raw(reading), style="dim"),
        Text("-" if age_s is None else f"{age_s:.0f} s", style="dim"),
    ]
    if view.writers is not None:
        writer = view.writers.get(name, view.writers.get(reading.register.block))
        cells.append(Text(_writer(writer, view) if writer else "", style="dim"))
    return cells


def _writer(writer: Writer, view: View) -> str:
    port = f":{writer.port}" if writer.port and view.width >= _ROOMY else ""
    return f"{writer.host}{port} {writer.age_s:.0f} s"
