"""The axes of a chart: where a value lies, which round values are marked, and limits that hold all data."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import ceil, floor, log10
from typing import Final

_MANY_TICKS: Final = 5  # every second one goes where the chart is narrow
_MOST_DECADES: Final = 2  # of a logarithmic axis whose ticks stay where the chart is narrow
_STILL: Final = 1e-9  # of a value: moves no more than its rounding
_STEPS: Final = (1.0, 2.0, 5.0, 10.0)
_ROUND_STEPS: Final = 6  # about so many from one end of the axis to the other


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

    def spare_ticks(self) -> set[float]:
        """Return the ticks that go where there is little room."""
        ticks = self.ticks()
        if self.logarithmic:
            decades = [tick for tick in ticks if abs(log10(tick) - round(log10(tick))) < 1e-9]
            return set(ticks) - set(decades) if len(decades) > _MOST_DECADES else set()
        return set(ticks[1::2]) if len(ticks) > _MANY_TICKS else set()


def _round_ticks(low: float, high: float) -> list[float]:
    rough = (high - low) / _ROUND_STEPS
    unit = 10.0 ** floor(log10(rough))
    step = next(s for s in _STEPS if s * unit >= rough * (1 - 1e-9)) * unit
    first = ceil(low / step - 1e-9)
    return [k * step for k in range(first, floor(high / step + 1e-9) + 1)]


def spread(values: Iterable[float], margin: float = 0.06, around: float | None = None) -> tuple[float, float]:
    """Return limits that hold all values with a margin; symmetric about `around` where given. About a value that stands still
    they are as wide as about one of its size: rounding would be marked in steps of 2e-11."""
    finite = list(values)
    low, high = min(finite), max(finite)
    if around is not None:
        reach = _width(max(abs(low - around), abs(high - around)), around) * (1.0 + 2.0 * margin)
        return around - reach, around + reach
    width = _width(high - low, high)
    return low - margin * width, high + margin * width


def _width(width: float, value: float) -> float:
    size = max(abs(value), 1.0)
    return width if width > _STILL * size else size
