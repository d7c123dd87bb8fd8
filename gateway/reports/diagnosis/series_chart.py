"""What the charts of a diagnosis need beyond those of a fit: envelopes of many rows, and clouds of points in few bytes."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.diagnosis.measurement import Floats
from gateway.reports.axis import Axis, spread
from gateway.reports.diagnosis.series import Envelope, occupied_cells
from gateway.reports.svg_chart import Chart

_LEAST_SPREAD: Final = 1e-6


def limits(*arrays: Floats, margin: float = 0.06, around: float | None = None) -> tuple[float, float]:
    """Return limits as `spread` does, of arrays that may hold NaN or one value only."""
    finite = np.concatenate([array[np.isfinite(array)] for array in arrays] or [np.zeros(1)])
    ends = [float(finite.min()), float(finite.max())] if finite.size else [0.0, 1.0]
    if around is None and ends[1] - ends[0] < _LEAST_SPREAD * max(1.0, abs(ends[0])):
        wide = 0.5 * max(1.0, abs(ends[0]))
        ends = [ends[0] - wide, ends[1] + wide]
    return spread(ends, margin, around if around is None or max(map(abs, ends)) > _LEAST_SPREAD else None)


@dataclass
class SeriesChart(Chart):
    """A Chart that also draws bands and clouds.

    cell_px: size of a cell of its clouds.
    """

    cell_px: float = 4.0

    def envelope(self, series: Envelope, style: str, name: str = "") -> None:
        """Draw a band from least to greatest; one stroke of it is seen where both are equal."""
        paths = []
        for piece in series.pieces:
            top = self._run(series.x[piece], series.high[piece])
            if np.array_equal(series.low[piece], series.high[piece]):
                paths.append(f'<path class="line thin {style}" d="M{top}"/>')
            else:
                bottom = self._run(series.x[piece][::-1], series.low[piece][::-1])
                paths.append(f'<path class="band {style}" d="M{top}L{bottom}Z"/>')
        self._parts.append("".join(paths))
        self._note(name, "block", style)

    def cloud(self, x: Floats, y: Floats, style: str, name: str = "") -> None:
        """Draw every small cell of the picture that holds a point, once. Its path counts in cells, which keeps it short."""
        columns, rows = self._cells()
        across, down = self.width / columns, self.height / rows
        box = (self.x.low, self.x.high, self.y.low, self.y.high)
        place = f"translate({across / 2:.2f} {self.height}) scale({across:.4f} {-down:.4f})"
        strokes = _strokes(occupied_cells(x, y, (columns, rows), box))
        self._parts.append(f'<path class="cloud {style}" transform="{place}" d="{strokes}"/>')
        self._note(name, "block", style)

    def _run(self, x: Floats, y: Floats) -> str:
        shares_x, shares_y = _shares(self.x, x), _shares(self.y, y)
        pairs = zip((self.width * shares_x).tolist(), (self.height * (1.0 - shares_y)).tolist(), strict=True)
        return " ".join(f"{px:.1f} {py:.1f}" for px, py in pairs)

    def _cells(self) -> tuple[int, int]:
        return max(1, round(self.width / self.cell_px)), max(1, round(self.height / self.cell_px))


def _strokes(cells: NDArray[np.int64]) -> str:
    """Return the path of the cells: a run of cells in one column is one vertical stroke."""
    if cells.size == 0:
        return ""
    follows = (np.diff(cells[:, 0]) == 0) & (np.diff(cells[:, 1]) == 1)
    first, last = np.concatenate([[True], ~follows]), np.concatenate([~follows, [True]])
    runs = zip(cells[first].tolist(), cells[last].tolist(), strict=True)
    return "".join(f"M{column} {low}v{high - low + 1}" for (column, low), (_, high) in runs)


def _shares(axis: Axis, values: Floats) -> Floats:
    if axis.logarithmic:
        return np.asarray(np.log(values / axis.low) / np.log(axis.high / axis.low))
    return np.asarray((values - axis.low) / (axis.high - axis.low))
