"""The charts of a fit: the loop, what it leaves by branch, the order sweep, the minor loops."""

from itertools import groupby
from typing import Final

import numpy as np

from gateway.bsfm.fit.blend_span import command_error_n, rms_n
from gateway.bsfm.fit.evaluation import Evaluation
from gateway.bsfm.ladder.measured_ladder import FALLING, RISING
from gateway.reports.fit.document import Document, residual_of
from gateway.reports.svg_chart import Axis, Chart, spread

_WAYS = ((RISING, "rising"), (FALLING, "falling"))
_CURVE_POINTS: Final = 200  # of a drawn curve: closer than a pixel's width on screen
_ORDER_MARGIN: Final = 0.4  # of an order, left and right of the first and last one, so that marks are whole
_BELOW_LEAST, _ABOVE_MOST = 0.7, 8.0  # the error axis over its data; the room above holds the key
_KEY_AT: Final = 0.78  # share of the chart's width at which the key begins
_LEAST_BAR: Final = 0.01  # of its height: a shorter error bar is hidden by its mark
_MARK_RADIUS_PX: Final = 3.2
_ERROR_MARGIN: Final = 0.25  # of the spread of the errors along the walk, for the key


def draw_loop(evaluation: Evaluation) -> str:
    """Draw the measured readings over the chosen model's two branches."""
    ladder, result = evaluation.checked.ladder, evaluation.chosen.result
    rising, falling = result.branches.rising, result.branches.falling
    volts = np.linspace(rising.x0, rising.x1, _CURVE_POINTS)
    chart = Chart(
        Axis(rising.x0, rising.x1, "command (V)"),
        Axis(*spread(ladder.force_n.tolist()), "force (N)"),
        "Force against command, measured and model",
    )
    for way, name in _WAYS:
        mask = ladder.direction == way
        chart.dots(ladder.voltage_v[mask].tolist(), ladder.force_n[mask].tolist(), name, f"measured, {name}")
    for curve, name in ((rising, "rising"), (falling, "falling")):
        chart.line(volts.tolist(), np.asarray(curve.value(volts)).tolist(), name)
    return chart.svg()


def draw_residuals(evaluation: Evaluation) -> str:
    """Draw measured minus model against the command, by branch."""
    ladder, left_n = evaluation.checked.ladder, residual_of(evaluation)
    low_v, high_v = float(ladder.voltage_v.min()), float(ladder.voltage_v.max())
    chart = Chart(
        Axis(low_v, high_v, "command (V)"),
        Axis(*spread(left_n.tolist(), around=0.0), "measured − model (N)"),
        "Residual of the chosen model against command, by branch",
    )
    chart.level(0.0)
    for way, name in _WAYS:
        mask = ladder.direction == way
        chart.dots(ladder.voltage_v[mask].tolist(), left_n[mask].tolist(), name, name)
    return chart.svg()


def draw_order_sweep(document: Document) -> str:
    """Draw the held-out RMS by order, one line per model; a hollow mark is a fit that may not drive a plant."""
    fits = [fit for fit in document["fits"] if fit["heldout_rms_n"]]
    orders = sorted({fit["order"] for fit in fits})
    heights = [fit["heldout_rms_n"] for fit in fits]
    chart = Chart(
        Axis(orders[0] - _ORDER_MARGIN, orders[-1] + _ORDER_MARGIN, "order", whole=True),
        Axis(_BELOW_LEAST * min(heights), _ABOVE_MOST * max(heights), "held-out RMS (N)", logarithmic=True),
        "Held-out error by model and order",
        key_at=_KEY_AT,
    )
    for model, same in groupby(fits, key=lambda fit: str(fit["model"])):
        line = list(same)
        chart.line([fit["order"] for fit in line], [fit["heldout_rms_n"] for fit in line], model, model.upper())
        _draw_marks(chart, line, model)
    return chart.svg()


def _draw_marks(chart: Chart, fits: list[Document], model: str) -> None:
    for fit in fits:
        height, error = fit["heldout_rms_n"], fit["heldout_error_n"] or 0.0
        if error > _LEAST_BAR * height:
            chart.bar(fit["order"], max(chart.y.low, height - error), height + error, model)
        chart.dots([fit["order"]], [height], model if fit["usable"] else f"{model} hollow", radius=_MARK_RADIUS_PX)
        if fit["chosen"]:
            chart.ring(fit["order"], height)


def draw_minor_loops(evaluation: Evaluation) -> str:
    """Draw the walk of partial reversals within the loop; empty where there was none."""
    volts, newtons = evaluation.checked.minor_v, evaluation.checked.minor_n
    if len(volts) < 2:
        return ""
    branches = evaluation.chosen.result.branches
    grid = np.linspace(branches.rising.x0, branches.rising.x1, _CURVE_POINTS)
    chart = Chart(
        Axis(branches.rising.x0, branches.rising.x1, "command (V)"),
        Axis(*spread(evaluation.checked.ladder.force_n.tolist()), "force (N)"),
        "Partial reversals inside the loop",
    )
    for curve, name in ((branches.rising, "rising"), (branches.falling, "falling")):
        chart.line(grid.tolist(), np.asarray(curve.value(grid)).tolist(), f"{name} faint", f"{name} branch")
    chart.line(volts.tolist(), newtons.tolist(), "walk thin")
    chart.dots(volts.tolist(), newtons.tolist(), "walk", "measured")
    return chart.svg()


def draw_minor_errors(evaluation: Evaluation) -> str:
    """Draw the error of the command along the walk: with the chosen reversal, and with branches switched at once."""
    checked, reversal = evaluation.checked, evaluation.reversal
    if reversal is None:
        return ""
    chosen_n = command_error_n(evaluation.model, checked.minor_v, checked.minor_n)
    switched_n = command_error_n(evaluation.chosen.result.bsfm(0.0), checked.minor_v, checked.minor_n)
    policy = (
        f"{len(reversal.slip.stops.radii_v)} slip stops" if reversal.slip else f"blend over {evaluation.span_n:g} N"
    )
    steps = list(range(1, len(chosen_n) + 1))
    chart = Chart(
        Axis(0, len(steps) + 1, "step of the walk"),
        Axis(
            *spread([*chosen_n.tolist(), *switched_n.tolist()], margin=_ERROR_MARGIN, around=0.0),
            "error of the command (N)",
        ),
        "Command error along the partial reversals",
    )
    chart.level(0.0)
    chart.line(steps, switched_n.tolist(), "faint switched", f"branches switched: {rms_n(switched_n):.2f} N RMS")
    chart.line(steps, chosen_n.tolist(), "walk", f"{policy}: {rms_n(chosen_n):.2f} N RMS")
    return chart.svg()
