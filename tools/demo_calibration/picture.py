"""The voltage-force loop: measured dots over the model's two branches."""

from pathlib import Path

import matplotlib
import numpy as np

from demo_calibration.comparison import voltages_along
from gateway.bsfm.ladder.measured_ladder import Ladder
from gateway.bsfm.model import Bsfm, Calibration

matplotlib.use("Agg")
from matplotlib import pyplot


def plot_loop(calibration: Calibration, ladder: Ladder, file: Path) -> None:
    """Draw the ladder over the calibration's branches, and one cycle of the model between them."""
    model = calibration.model()
    figure, axes = pyplot.subplots(figsize=(7.2, 4.8), dpi=120)
    axes.plot(
        ladder.voltage_v, ladder.force_n, ".", color="0.45", markersize=3, label=f"measured, {len(ladder)} stairs"
    )
    low_v, high_v = model.voltage_range_v
    volts = np.linspace(low_v, high_v, 400)
    for name, curve, colour in (
        ("rising", model.branches.rising, "tab:red"),
        ("falling", model.branches.falling, "tab:blue"),
    ):
        axes.plot(volts, curve.value(volts), color=colour, linewidth=0.8, linestyle="--", label=f"BSFM order 2, {name}")
    axes.plot(*loop_of(model), color="black", linewidth=1.0, label="model between them, one cycle")
    axes.set(xlabel="command (V)", ylabel="contact force (N)", xlim=(low_v, high_v))
    axes.set_title(f"demo rig (twin): {calibration.rms_n:.2f} N RMS, {calibration.max_n:.2f} N max")
    axes.grid(alpha=0.3)
    axes.legend(loc="upper left", frameon=False)
    figure.savefig(file, bbox_inches="tight")
    pyplot.close(figure)


def loop_of(model: Bsfm) -> tuple[list[float], list[float]]:
    """Return (V, N) of the model on one cycle of forces from a vented tool."""
    low_n, high_n = model.force_range_n
    up = np.linspace(low_n, high_n, 200).tolist()
    path_n = up + up[::-1]
    return voltages_along(model, path_n), path_n
