"""Figures of a report, two to a row, and none beside an empty place: of an odd number the last one is drawn across."""

from dataclasses import dataclass
from html import escape
from typing import Final, Protocol

from gateway.reports.svg_chart import Chart


@dataclass(frozen=True, slots=True)
class Drawing:
    """A chart and its legend, as HTML; words: what its caption says of its peak or step."""

    svg: str
    key: str
    words: str = ""

    def __bool__(self) -> bool:
        return bool(self.svg)


NOTHING: Final = Drawing("", "")


def drawing(chart: Chart, words: str = "") -> Drawing:
    """Return what a chart shows."""
    return Drawing(chart.svg(), chart.key, words)


class Draw(Protocol):
    """A chart, across both columns or in one."""

    def __call__(self, *, wide: bool) -> Drawing: ...


@dataclass(frozen=True, slots=True)
class Panel:
    """One figure of a grid."""

    title: str
    draw: Draw
    caption: str = ""


def figure(title: str, drawing: Drawing, caption: str = "", style: str = "") -> str:
    """Return one figure as HTML; empty where there is nothing to draw. What the drawing says stands before the caption."""
    if not drawing:
        return ""
    caption = " ".join(part for part in (drawing.words, caption) if part)
    text = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
    return f"<figure class='{style}'><h3>{escape(title)}</h3>{drawing.key}{drawing.svg}{text}</figure>"


def grid(*panels: Panel) -> str:
    """Return the panels as HTML in two columns; empty without panels. Those that draw nothing take no place."""
    drawings = [(panel, drawing) for panel in panels if (drawing := panel.draw(wide=False))]
    if not drawings:
        return ""
    figures = [figure(panel.title, drawing, panel.caption) for panel, drawing in drawings]
    if len(drawings) % 2:
        last = drawings[-1][0]
        figures[-1] = figure(last.title, last.draw(wide=True), last.caption, "across")
    return f"<section class='pair'>{''.join(figures)}</section>"
