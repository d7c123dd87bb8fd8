"""Figs. 4, 5 and 6, redrawn from the fits."""

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from gateway.bsfm.fit.result import FitResult
from gateway.bsfm.ladder.measured_ladder import RISING, Ladder
from paper import paper_values
from paper.figures.drawing import COLOUR, GREY, sheet
from paper.study import Study


def dots(axes: Any, ladder: Ladder) -> None:
    """Draw the ladder as the eye sees it: every reading a faint dot."""
    rising = ladder.direction == RISING
    for mask, marker, name in ((rising, "^", "measured, rising"), (~rising, "v", "measured, falling")):
        axes.plot(
            ladder.voltage_v[mask], ladder.force_n[mask], marker, color=GREY, markersize=2, alpha=0.45, label=name
        )


def of_order(fits: list[FitResult], order: int) -> FitResult:
    """Return the fit of a model that has this order."""
    return next(result for result in fits if result.order == order)


def loop_axes(axes: Any, title: str) -> None:
    """Label the axes of a loop."""
    axes.set(xlabel="command (V)", ylabel="force (N)", title=title)


def figure_4(study: Study) -> Figure:
    """Draw Fig. 4: pooled fits over the measured loop."""
    figure, axes = sheet(1, 2, (9.0, 3.8), sharey=True)
    volts = np.linspace(0.0, paper_values.LADDER_TOP_V, 300)
    pairs = (("pfm", (2, 3), "(a) pooled polynomial"), ("bfm", (1, 2), "(b) pooled rational Bezier"))
    for panel, (name, orders, title) in zip(axes[0], pairs, strict=True):
        dots(panel, study.ladder)
        for order, style in zip(orders, ("--", "-"), strict=True):
            result = of_order(study.fits[name], order)
            label = f"{name.upper()} n = {order}: {result.rms_n:.2f} N RMS"
            panel.plot(volts, result.branches.rising.value(volts), style, color=COLOUR[name], label=label)
        loop_axes(panel, title)
        panel.legend(loc="upper left")
    return figure


def figure_5(study: Study) -> Figure:
    """Draw Fig. 5: fits per direction."""
    figure, axes = sheet(2, 2, (9.0, 6.8))
    top_v = paper_values.LADDER_TOP_V
    for row, (name, letters) in enumerate((("psfm", "ab"), ("bsfm", "cd"))):
        for panel, letter, (low_v, words) in zip(
            axes[row], letters, ((0.0, ""), (top_v - 0.5, ", enlarged")), strict=True
        ):
            branch_panel(panel, study, name, low_v)
            loop_axes(panel, f"({letter}) {name.upper()}{words}")
        low_n, high_n = of_order(study.fits["bsfm"], 2).branches.rising.value(np.array([top_v - 0.5, top_v]))
        axes[row][1].set(xlim=(top_v - 0.5, top_v + 0.03), ylim=(low_n - 0.8, high_n + 1.2))
        axes[row][0].legend(loc="upper left")
    return figure


def branch_panel(panel: Any, study: Study, name: str, low_v: float) -> None:
    """Draw both branches of a fit into a panel."""
    volts = np.linspace(low_v, paper_values.LADDER_TOP_V, 300)
    dots(panel, study.ladder)
    for order, style in ((2, "--"), (3, "-")):
        result = of_order(study.fits[name], order)
        label = f"n = {order}: {result.rms_n:.3f} N RMS"
        for curve in (result.branches.rising, result.branches.falling):
            panel.plot(volts, curve.value(volts), style, color=COLOUR[name], label=label)
            label = ""


def figure_6(study: Study) -> Figure:
    """Draw Fig. 6: residual over the order."""
    figure, axes = sheet(3, 2, (9.0, 7.4), sharex=True)
    measures: tuple[tuple[str, Callable[[FitResult], float]], ...] = (
        ("the paper's norm", lambda result: result.paper_norm),
        ("RMS residual (N)", lambda result: result.rms_n),
        ("largest residual (N)", lambda result: result.max_n),
    )
    groups = ((("pfm", "bfm"), "(a) pooled"), (("psfm", "bsfm"), "(b) per direction"))
    for column, (names, title) in enumerate(groups):
        for row, (label, measure) in enumerate(measures):
            panel = axes[row][column]
            for name, marker in zip(names, "os", strict=True):
                order_line(panel, study.fits[name], name, measure, marker)
            panel.set(ylabel=label, title=title if row == 0 else "", xticks=range(1, 16, 2))
            panel.margins(y=0.15)
        for name, marker in zip(names, "os", strict=True):
            label = f"{name.upper()}, the paper"
            axes[0][column].plot(
                (1, 15), paper_values.NORM[name], marker, color=COLOUR[name], mfc="none", ms=8, label=label
            )
        axes[0][column].legend(loc="center" if column == 0 else "upper right")
        axes[2][column].set(xlabel="order n")
    for row in (1, 2):
        axes[row][1].set_ylim(bottom=0.0)
    return figure


def order_line(
    panel: Any, fits: list[FitResult], name: str, measure: Callable[[FitResult], float], marker: str
) -> None:
    """Draw one model's residual over the order."""
    orders = [result.order for result in fits]
    values = [measure(result) for result in fits]
    panel.plot(orders, values, marker + "-", color=COLOUR[name], markersize=3.5, label=f"{name.upper()}, twin")
