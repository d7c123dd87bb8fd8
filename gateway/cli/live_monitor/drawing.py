"""Pieces that the page is made of: digits three rows high, and a chart of block characters."""

from collections.abc import Sequence
from itertools import groupby
from math import isnan
from typing import Final

from rich.text import Text

from gateway.cli.live_monitor.history import TrackPoint

_DIGITS: Final = {
    "0": ("█▀█", "█ █", "▀▀▀"),
    "1": ("▀█ ", " █ ", "▀▀▀"),
    "2": ("▀▀█", "█▀▀", "▀▀▀"),
    "3": ("▀▀█", " ▀█", "▀▀▀"),
    "4": ("█ █", "▀▀█", "  ▀"),
    "5": ("█▀▀", "▀▀█", "▀▀▀"),
    "6": ("█▀▀", "█▀█", "▀▀▀"),
    "7": ("▀▀█", "  █", "  ▀"),
    "8": ("█▀█", "█▀█", "▀▀▀"),
    "9": ("█▀█", "▀▀█", "▀▀▀"),
    "-": ("   ", "▀▀ ", "   "),
    "+": ("   ", "▀█▀", " ▀ "),
    ".": (" ", " ", "▀"),
}
_EIGHTHS: Final = " ▁▂▃▄▅▆▇█"


def big(value: float, decimals: int, *, sign: str = "-", width: int, style: str) -> list[Text]:
    """Return a number three rows high, with as many decimals as fit into `width` columns. sign: "+" shows a plus too."""
    if isnan(value):
        return [Text(), Text("–", style="dim"), Text()]
    for digits in range(decimals, -1, -1):
        text = f"{value:{sign}.{digits}f}"
        rows = [" ".join(_DIGITS[character][row] for character in text) for row in range(3)]
        if len(rows[0]) <= width:
            return [Text(row, style, no_wrap=True) for row in rows]
    return [Text(), Text(f"{value:{sign}.{decimals}f}", f"bold {style}"), Text()]


def chart(points: Sequence[TrackPoint | None], rows: int, top_n: float) -> list[Text]:
    """Draw measured force as columns from 0 to top_n, newest at the right; the setpoint as a line where no column hides it."""
    return [_chart_row(points, row, rows, top_n) for row in range(rows - 1, -1, -1)]


def _chart_row(points: Sequence[TrackPoint | None], row: int, rows: int, top_n: float) -> Text:
    text = Text(no_wrap=True)
    cells = (_cell(point, row, rows, top_n) for point in points)
    for style, run in groupby(cells, key=lambda cell: cell[1]):
        text.append("".join(character for character, _ in run), style)
    return text


def boxed(title: str, lines: Sequence[Text], width: int, *, is_centred: bool = False) -> list[Text]:
    """Draw a frame around lines, `width` columns with its sides; the title is in its upper edge."""
    inner = width - 2
    heading = f" {title} " if len(title) + 2 <= inner else title[:inner]
    top = heading.center(inner, "─") if is_centred else f"─{heading}".ljust(inner, "─")[:inner]
    return [Text(f"╭{top}╮", no_wrap=True), *(_between_sides(line, inner) for line in lines), Text(f"╰{'─' * inner}╯")]


def _between_sides(line: Text, inner: int) -> Text:
    text = Text("│", no_wrap=True).append_text(line)
    text.pad_right(max(0, inner - line.cell_len))
    return text.append("│")


def beside(boxes: Sequence[Sequence[Text]]) -> list[Text]:
    """Put boxes of the same height beside each other."""
    return [Text.assemble(*parts, no_wrap=True) for parts in zip(*boxes, strict=True)]


def _cell(point: TrackPoint | None, row: int, rows: int, top_n: float) -> tuple[str, str]:
    if point is None:
        return " ", ""
    eighths = round(max(0.0, min(1.0, point.measured_n / top_n)) * rows * 8) - row * 8
    if eighths > 0:
        return _EIGHTHS[min(eighths, 8)], "cyan"
    setpoint_row = int(max(0.0, min(0.999, point.setpoint_n / top_n)) * rows)
    return ("─", "yellow") if setpoint_row == row and point.setpoint_n > 0 else (" ", "")


def chart_top_n(points: Sequence[TrackPoint | None]) -> float:
    """Return a round force above everything in the chart."""
    largest = max((max(point.measured_n, point.setpoint_n) for point in points if point), default=0.0)
    return next((float(top) for top in (5, 10, 20, 30, 40, 50, 75, 100, 150, 200) if largest <= 0.95 * top), 330.0)
