"""How the figures look. matplotlib is imported by these modules only (drawing, figures*), and drawn without a screen.

Colours mean the same everywhere: grey the data, blue the paper's BSFM, orange PSFM, green the gateway's controller.
"""

from io import BytesIO
from typing import Any, Final

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot
from matplotlib.figure import Figure

GREY, RED = "0.55", "#d03b3b"
COLOUR: Final = {
    "psfm": "#eb6834",
    "psfm 2": "#f0a07c",
    "bsfm": "#2a78d6",
    "ours": "#1a9850",
    "pfm": "#4a3aa7",
    "bfm": "#e0a100",
}
LABEL: Final = {
    "psfm": "PSFM, order 3",
    "bsfm": "BSFM, order 2 (the paper's law)",
    "ours": "ours: slip + lead + trim",
}
STYLE: Final = {
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "0.9",
    "legend.frameon": False,
    "legend.fontsize": 8,
    "lines.linewidth": 1.3,
    "figure.dpi": 110,
    "figure.constrained_layout.use": True,
}


def sheet(rows: int, columns: int, size: tuple[float, float], **more: Any) -> tuple[Figure, Any]:
    """Return a figure of rows x columns panels, and the panels."""
    return pyplot.subplots(rows, columns, figsize=size, squeeze=False, **more)


def png(figure: Figure) -> bytes:
    """Return the picture's bytes; close the figure."""
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=110)
    pyplot.close(figure)
    return buffer.getvalue()
