"""A small chart as inline SVG: axes with round ticks, dots, lines, error bars. Colours are CSS classes of the page.

Own code instead of a plotting library: a report needs four charts, and matplotlib would be the largest dependency of a
gateway. Coordinates are rounded to a tenth of a pixel, which keeps a report of 2000 dots near 100 kB.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from html import escape
from math import ceil, floor, log10
from typing import Final

LEFT, RIGHT, TOP, BOTTOM = 62, 14, 12, 40  # margins, px


@dataclass(frozen=True, slots=True)
class Axis:
    """low..high in data units; logarithmic where asked; ticks at whole numbers where whole."""

    low: float
    high: float
    label: str
    logarithmic: bool = False
    whole: bool = False

    def share(self, value: float) -> float:
        """Return where a value lies on the axis, 0 at its low end and 1 at its high one."""
        if self.logarithmic:
            return (log10(value) - log10(self.low)) / (log10(self.high) - log10(self.low))
        return (value - self.low) / (self.high - self.low)

    def ticks(self) -> list[float]:
        """Return round values to mark on the axis."""
        if self.logarithmic:
            steps = [m * 10.0**e for e in range(floor(log10(self.low)), ceil(log10(self.high)) + 1) for m in (1, 2, 5)]
            return [step for step in steps if self.low <= step * (1 + 1e-9) and step <= self.high * (1 + 1e-9)]
        if self.whole:
            return [float(n) for n in range(ceil(self.low), floor(self.high) + 1)]
        return _round_ticks(self.low, self.high)


_STEPS: Final = (1.0, 2.0, 5.0, 10.0)


def _round_ticks(low: float, high: float, count: int = 6) -> list[float]:
    rough = (high - low) / count
    unit = 10.0 ** floor(log10(rough))
    step = next(s for s in _STEPS if s * unit >= rough * (1 - 1e-9)) * unit
    first = ceil(low / step - 1e-9)
    return [k * step for k in range(first, floor(high / step + 1e-9) + 1)]


def spread(values: Iterable[float], margin: float = 0.06, around: float | None = None) -> tuple[float, float]:
    """Return limits that hold all values with a margin; symmetric about `around` where given."""
    finite = list(values)
    low, high = min(finite), max(finite)
    if around is not None:
        reach = max(abs(low - around), abs(high - around), 1e-9) * (1.0 + 2.0 * margin)
        return around - reach, around + reach
    width = max(high - low, 1e-9)
    return low - margin * width, high + margin * width


@dataclass
class Chart:
    """Draw, then `svg()`. title is read out to those who cannot see it."""

    x: Axis
    y: Axis
    title: str
    width: int = 560
    height: int = 340
    key_at: float = 0.0  # where the legend begins, as a share of the width
    _parts: list[str] = field(default_factory=list)
    _legend: list[tuple[str, str, str]] = field(default_factory=list)

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Return the place of a point in the picture, px from its left and upper edge."""
        across, down = self.width - LEFT - RIGHT, self.height - TOP - BOTTOM
        return LEFT + across * self.x.share(x), TOP + down * (1.0 - self.y.share(y))

    def line(self, xs: Sequence[float], ys: Sequence[float], style: str, name: str = "") -> None:
        """Draw a line through the points."""
        points = " ".join(f"{px:.1f},{py:.1f}" for px, py in (self.at(x, y) for x, y in zip(xs, ys, strict=True)))
        self._parts.append(f'<polyline class="line {style}" points="{points}"/>')
        self._note(name, "line", style)

    def dots(self, xs: Sequence[float], ys: Sequence[float], style: str, name: str = "", radius: float = 1.8) -> None:
        """Draw a dot at each point."""
        circles = "".join(
            f'<circle cx="{px:.1f}" cy="{py:.1f}" r="{radius}"/>'
            for px, py in (self.at(x, y) for x, y in zip(xs, ys, strict=True))
        )
        self._parts.append(f'<g class="dots {style}">{circles}</g>')
        self._note(name, "dot", style)

    def bar(self, x: float, low: float, high: float, style: str) -> None:
        """Draw a vertical bar between two values."""
        (px, bottom), (_, top) = self.at(x, low), self.at(x, high)
        self._parts.append(
            f'<path class="line thin {style}" d="M{px:.1f} {bottom:.1f}V{top:.1f}M{px - 3:.1f} {top:.1f}h6"/>'
        )

    def ring(self, x: float, y: float) -> None:
        """Draw a ring around a point, to mark it."""
        px, py = self.at(x, y)
        self._parts.append(f'<circle class="ring" cx="{px:.1f}" cy="{py:.1f}" r="8"/>')

    def level(self, y: float) -> None:
        """Draw a horizontal line across the chart."""
        self._parts.append(f'<path class="level" d="M{LEFT} {self.at(self.x.low, y)[1]:.1f}H{self.width - RIGHT}"/>')

    def svg(self) -> str:
        """Return the whole chart as an SVG element."""
        head = f'<svg viewBox="0 0 {self.width} {self.height}" role="img" aria-label="{escape(self.title)}">'
        return head + self._axes() + "".join(self._parts) + self._key() + "</svg>"

    def _note(self, name: str, kind: str, style: str) -> None:
        if name:
            self._legend.append((name, kind, style))

    def _axes(self) -> str:
        bottom, right = self.height - BOTTOM, self.width - RIGHT
        parts = []
        for tick in self.x.ticks():
            px = self.at(tick, self.y.low)[0]
            parts.append(
                f'<path class="grid" d="M{px:.1f} {TOP}V{bottom}"/><text x="{px:.1f}" y="{bottom + 16}">{tick:g}</text>'
            )
        for tick in self.y.ticks():
            py = self.at(self.x.low, tick)[1]
            number = f"{tick:.6g}".replace("-", "−")
            parts.append(f'<path class="grid" d="M{LEFT} {py:.1f}H{right}"/>')
            parts.append(f'<text class="end" x="{LEFT - 7}" y="{py + 4:.1f}">{number}</text>')
        middle = (TOP + bottom) / 2
        parts.append(f'<text class="name" x="{(LEFT + right) / 2}" y="{self.height - 6}">{escape(self.x.label)}</text>')
        parts.append(f'<text class="name" transform="translate(12 {middle}) rotate(-90)">{escape(self.y.label)}</text>')
        return "".join(parts)

    def _key(self) -> str:
        parts, x = [], LEFT + self.key_at * (self.width - LEFT - RIGHT)
        for k, (name, kind, style) in enumerate(self._legend):
            y = TOP + 16 + 17 * k
            mark = (
                f'<path class="line {style}" d="M{x + 12:.0f} {y - 4}h18"/>'
                if kind == "line"
                else f'<g class="dots {style}"><circle cx="{x + 21:.0f}" cy="{y - 4}" r="3"/></g>'
            )
            parts.append(f'{mark}<text class="key" x="{x + 37:.0f}" y="{y}">{escape(name)}</text>')
        return "".join(parts)
