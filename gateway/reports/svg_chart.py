"""A chart as inline SVG that stretches with the page while its words keep their size. Colours are CSS classes of the page.

Own code instead of a plotting library: a report needs a few charts, and matplotlib would be the largest dependency of a
gateway. The drawing is an SVG without an aspect of its own, as wide as its place and always `height` px high; ticks, names
and marked points stand at shares of that width beside it. So one drawing serves a telephone and a wall of screens.
Coordinates are rounded to a tenth of a pixel, which keeps a report of 2000 dots near 100 kB.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Final

from gateway.reports.axis import Axis

RIGHT, TOP, BOTTOM = 14, 28, 40  # room around the drawing, px
_LEAST_LEFT, _SIGN_PX, _TICK_GAP = 34, 7, 14  # room at the left for the longest number at a tick
_MANY_POINTS: Final = 600  # are drawn as small dots
_WORDS_ABOVE, _WORDS_BELOW, _ROOM_ABOVE = -10.0, 20.0, 16.0  # of a marked point, px


@dataclass
class Chart:
    """Draw, then `svg()` and its legend `key`. title is read out to those who cannot see it. width: of the drawing where the
    page has its usual size, px; its lines and dots are rounded for that."""

    x: Axis
    y: Axis
    title: str
    width: int = 560
    height: int = 270
    _parts: list[str] = field(default_factory=list)
    _marks: list[str] = field(default_factory=list)
    _legend: list[tuple[str, str, str]] = field(default_factory=list)

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Return the place of a point in the drawing, px from its left and upper edge."""
        return self.width * self.x.share(x), self.height * (1.0 - self.y.share(y))

    def line(self, xs: Sequence[float], ys: Sequence[float], style: str, name: str = "") -> None:
        """Draw a line through the points."""
        points = " ".join(f"{px:.1f},{py:.1f}" for px, py in self._places(xs, ys))
        self._parts.append(f'<polyline class="line {style}" points="{points}"/>')
        self._note(name, "dash" if "dash" in style.split() else "", style)

    def dots(self, xs: Sequence[float], ys: Sequence[float], style: str, name: str = "") -> None:
        """Draw a dot at each point: strokes without length and with round ends, which stay round however wide the chart is."""
        strokes = "".join(f"M{px:.1f} {py:.1f}h0" for px, py in self._places(xs, ys))
        self._parts.append(f'<path class="dots {style}" d="{strokes}"/>')
        self._note(name, "dot", style)

    def points(self, xs: Sequence[float], ys: Sequence[float], style: str, name: str) -> None:
        """Draw measured points so that they are seen on a line: as rings, as small dots where they are many."""
        if len(xs) > _MANY_POINTS:
            self.dots(xs, ys, f"{style} many", name)
            return
        self.dots(xs, ys, f"{style} rim", name)
        self.dots(xs, ys, "core")

    def bar(self, x: float, low: float, high: float, style: str) -> None:
        """Draw a vertical bar between two values."""
        (px, bottom), (_, top) = self.at(x, low), self.at(x, high)
        self._parts.append(f'<path class="line thin {style}" d="M{px:.1f} {bottom:.1f}V{top:.1f}"/>')

    def circle(self, x: float, y: float, style: str, radius: float) -> None:
        """Draw a circle around a point, in front of all lines."""
        px, py = self.at(x, y)
        share = 100.0 * px / self.width
        self._marks.append(f'<circle class="{style}" cx="{share:.2f}%" cy="{py:.1f}" r="{radius:g}"/>')

    def mark(self, x: float, y: float, words: str) -> None:
        """Draw a ring around a point and say what is there, in few words: they reach over at most half of a narrow chart."""
        self.circle(x, y, "ring", 5.0)
        self._write(x, self.at(x, y)[1], words)

    def mark_change(self, x: float, words: str) -> None:
        """Draw a broken line across the height where something changes, and say what."""
        share = 100.0 * self.x.share(x)
        self._marks.append(f'<line class="change" x1="{share:.2f}%" x2="{share:.2f}%" y1="0" y2="{self.height}"/>')
        self._write(x, self.height - _WORDS_BELOW, words)

    def level(self, y: float) -> None:
        """Draw a horizontal line across the chart."""
        self._parts.append(f'<path class="level" d="M0 {self.at(self.x.low, y)[1]:.1f}H{self.width}"/>')

    def svg(self) -> str:
        """Return the chart as HTML, without its legend."""
        room = f"padding:{TOP}px {RIGHT}px {BOTTOM}px {self._left()}px"
        label = f'role="img" aria-label="{escape(self.title)}"'
        return f'<div class="plot" style="{room}"><svg {label} height="{self.height}">{self._inside()}</svg></div>'

    def svg_at(self, left_px: float, down_px: float, width_px: float) -> str:
        """Return the chart as part of another SVG, of a fixed size; its names stand to the right above it."""
        place = f'x="{left_px}" y="{down_px}" width="{width_px}" height="{self.height}" style="width: {width_px}px"'
        names = "".join(
            f'<text class="end" x="100%" y="-12" dx="{-150 * at}">{escape(name)}</text>'
            f'<path class="line {style}" d="M{width_px - 150 * at - 75} -16h-30"/>'
            for at, (name, _, style) in enumerate(self._legend)
        )
        return f"<svg {place}>{self._inside()}{names}</svg>"

    def _inside(self) -> str:
        drawing = (
            f'<svg class="drawing" viewBox="0 0 {self.width} {self.height}" preserveAspectRatio="none" '
            f'width="100%" height="{self.height}">{"".join(self._parts)}</svg>'
        )
        return self._axes() + drawing + "".join(self._marks)

    @property
    def key(self) -> str:
        """The legend as HTML, to stand above the picture where it hides no data."""
        marks = (
            f'<span><i class="{f"{kind} {style}".strip()}"></i>{escape(name)}</span>'
            for name, kind, style in self._legend
        )
        return f'<p class="key">{"".join(marks)}</p>' if self._legend else ""

    def _places(self, xs: Sequence[float], ys: Sequence[float]) -> Iterable[tuple[float, float]]:
        return (self.at(x, y) for x, y in zip(xs, ys, strict=True))

    def _note(self, name: str, kind: str, style: str) -> None:
        if name:
            self._legend.append((name, kind, style))

    def _write(self, x: float, down_px: float, words: str) -> None:
        """Towards the middle, so that the words stay in the chart; above the point where there is room."""
        share = self.x.share(x)
        way, gap = ("end", -9) if share > 0.5 else ("start", 9)
        top = down_px + (_WORDS_ABOVE if down_px > _ROOM_ABOVE else _WORDS_BELOW)
        place = f'x="{100.0 * share:.2f}%" dx="{gap}" y="{top:.1f}"'
        self._marks.append(f'<text class="words {way}" {place}>{escape(words)}</text>')

    def _left(self) -> int:
        longest = max((len(_number(tick)) for tick in self.y.ticks()), default=0)
        return max(_LEAST_LEFT, _SIGN_PX * longest + _TICK_GAP)

    def _axes(self) -> str:
        parts, spare = [], self.x.spare_ticks()
        for tick in self.x.ticks():
            share = f"{100.0 * self.x.share(tick):.2f}%"
            style = ' class="spare"' if tick in spare else ""
            parts.append(f'<line class="grid" x1="{share}" x2="{share}" y1="0" y2="{self.height}"/>')
            parts.append(f'<text{style} x="{share}" y="{self.height + 16}">{_number(tick)}</text>')
        for tick in self.y.ticks():
            down = self.at(self.x.low, tick)[1]
            parts.append(f'<line class="grid" x1="0" x2="100%" y1="{down:.1f}" y2="{down:.1f}"/>')
            parts.append(f'<text class="end" x="-7" y="{down + 4:.1f}">{_number(tick)}</text>')
        parts.append(f'<text class="name" x="50%" y="{self.height + 34}">{escape(self.x.label)}</text>')
        parts.append(f'<text class="name start" x="{-self._left() + 2}" y="-12">{escape(self.y.label)}</text>')
        return "".join(parts)


def _number(value: float) -> str:
    return f"{value:.6g}".replace("-", "−")
