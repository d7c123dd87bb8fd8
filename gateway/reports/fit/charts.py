"""The charts of a fit: the raw ladder, the loop, what it leaves by branch, the order sweep, the minor loops."""

from itertools import groupby
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.bsfm import RationalBezier
from gateway.bsfm.fit.blend_span import command_error_n, rms_n
from gateway.bsfm.fit.evaluation import Evaluation
from gateway.bsfm.ladder.measured_ladder import FALLING, RISING
from gateway.reports.axis import Axis, spread
from gateway.reports.figures import NOTHING, Drawing, drawing
from gateway.reports.fit.document import Document, residual_of
from gateway.reports.fit.names import spell_model, spell_reversal
from gateway.reports.fit.raw_ladder import RawLadder
from gateway.reports.svg_chart import Chart

Floats = NDArray[np.float64]
_WAYS = ((RISING, "rising"), (FALLING, "falling"))
_CURVE_POINTS: Final = 200  # of a drawn curve: closer than a pixel's width on screen
_ORDER_MARGIN: Final = 0.4  # of an order, left and right of the first and last one, so that marks are whole
_BELOW_LEAST, _ABOVE_MOST = 0.7, 1.5  # the error axis over its data
_LEAST_BAR: Final = 0.01  # of its height: a shorter error bar is hidden by its mark
_ERROR_MARGIN: Final = 0.15  # of the spread of the errors along the walk
_WIDE, _WIDE_HIGH = 1064, 220  # of the drawing, px


def draw_raw_ladder(raw: RawLadder) -> Drawing:
    """Draw the recording as it came: force and command over time; words: how long, how many rows, where the ladder ends."""
    time = Axis(raw.time_s[0], max(raw.time_s[-1], raw.time_s[0] + 1e-9), "time (s)")
    chart = Chart(time, Axis(*spread(raw.force_n), "force (N)"), "Force over time as recorded", _WIDE, _WIDE_HIGH)
    chart.line(raw.time_s, raw.force_n, "walk thin", "measured force")
    for begin_s, words in raw.changes:
        chart.mark_change(begin_s, words)
    return drawing(chart, raw.sentence)


def draw_raw_command(raw: RawLadder) -> Drawing:
    """Draw the command over time."""
    time = Axis(raw.time_s[0], max(raw.time_s[-1], raw.time_s[0] + 1e-9), "time (s)")
    volts = Axis(*spread(raw.command_v), "command (V)")
    chart = Chart(time, volts, "Command over time as recorded", _WIDE, _WIDE_HIGH // 2)
    chart.line(raw.time_s, raw.command_v, "switched", "command")
    return drawing(chart)


def draw_loop(evaluation: Evaluation) -> Drawing:
    """Draw the measured stairs and the chosen model's two branches."""
    ladder, result = evaluation.checked.ladder, evaluation.chosen.result
    rising, falling = result.branches.rising, result.branches.falling
    volts = np.linspace(rising.x0, rising.x1, _CURVE_POINTS)
    chart = Chart(
        Axis(rising.x0, rising.x1, "command (V)"),
        Axis(*spread(ladder.force_n.tolist()), "force (N)"),
        "Force against command, measured and model",
    )
    model = spell_model(result.model, result.order)
    for curve, name in ((rising, "rising"), (falling, "falling")):
        chart.line(volts.tolist(), np.asarray(curve.value(volts)).tolist(), name, f"{model}, {name}")
    for way, name in _WAYS:
        mask = ladder.direction == way
        chart.points(ladder.voltage_v[mask].tolist(), ladder.force_n[mask].tolist(), name, f"measured, {name}")
    return drawing(chart, _describe_gap(rising, falling, volts))


def _describe_gap(rising: RationalBezier, falling: RationalBezier, volts: Floats) -> str:
    gap_n = np.asarray(falling.value(volts)) - np.asarray(rising.value(volts))
    place = int(np.argmax(np.abs(gap_n)))
    return f"The branches are furthest apart at {volts[place]:.2f} V: {gap_n[place]:.2f} N."


def draw_residuals(evaluation: Evaluation) -> Drawing:
    """Draw measured minus model against the command, by branch, with the largest named."""
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
        chart.points(ladder.voltage_v[mask].tolist(), left_n[mask].tolist(), name, name)
    worst = int(np.argmax(np.abs(left_n)))
    side = dict(_WAYS)[int(ladder.direction[worst])]
    volts, error = float(ladder.voltage_v[worst]), _signed(float(left_n[worst]))
    chart.mark(volts, float(left_n[worst]), f"largest: {error}")
    return drawing(chart, f"Largest: {error} at {volts:.2f} V, {side}.")


def _signed(value_n: float) -> str:
    return f"{value_n:+.2f} N".replace("-", "−")


def draw_order_sweep(document: Document) -> Drawing:
    """Draw the held-out RMS by order, one line per model; a hollow mark is a fit that may not drive a plant."""
    fits = [fit for fit in document["fits"] if fit["heldout_rms_n"]]
    if not fits:
        return NOTHING
    orders = sorted({fit["order"] for fit in fits})
    heights = [fit["heldout_rms_n"] for fit in fits]
    chart = Chart(
        Axis(orders[0] - _ORDER_MARGIN, orders[-1] + _ORDER_MARGIN, "order", whole=True),
        Axis(_BELOW_LEAST * min(heights), _ABOVE_MOST * max(heights), "held-out RMS (N)", logarithmic=True),
        "Held-out error by model and order",
    )
    for model, same in groupby(fits, key=lambda fit: str(fit["model"])):
        line = list(same)
        chart.line([fit["order"] for fit in line], [fit["heldout_rms_n"] for fit in line], model, model.upper())
        _draw_marks(chart, line, model)
    chosen = document["chosen"]
    named = f"Chosen: {spell_model(chosen['model'], chosen['order'])}"
    return drawing(
        chart, f"{named}, held to what may drive a plant: no mark here." if chosen["constrained"] else f"{named}."
    )


def _draw_marks(chart: Chart, fits: list[Document], model: str) -> None:
    for fit in fits:
        height, error = fit["heldout_rms_n"], fit["heldout_error_n"] or 0.0
        if error > _LEAST_BAR * height:
            chart.bar(fit["order"], max(chart.y.low, height - error), height + error, model)
        if fit["usable"]:
            chart.dots([fit["order"]], [height], f"{model} few")
        else:
            chart.circle(fit["order"], height, f"{model} hollow", 3.4)
        if fit["chosen"]:
            chart.mark(fit["order"], height, f"chosen: {spell_model(model, fit['order'])}")


def draw_minor_loops(evaluation: Evaluation) -> Drawing:
    """Draw the walk of partial reversals within the loop; NOTHING where there was none."""
    volts, newtons = evaluation.checked.minor_v, evaluation.checked.minor_n
    if len(volts) < 2:
        return NOTHING
    branches = evaluation.chosen.result.branches
    grid = np.linspace(branches.rising.x0, branches.rising.x1, _CURVE_POINTS)
    chart = Chart(
        Axis(branches.rising.x0, branches.rising.x1, "command (V)"),
        Axis(*spread(evaluation.checked.ladder.force_n.tolist()), "force (N)"),
        "Partial reversals inside the loop",
    )
    for curve, name in ((branches.rising, "rising"), (branches.falling, "falling")):
        chart.line(grid.tolist(), np.asarray(curve.value(grid)).tolist(), name, f"{name} branch")
    chart.line(volts.tolist(), newtons.tolist(), "walk thin")
    chart.dots(volts.tolist(), newtons.tolist(), "walk", "measured, inside the loop")
    return drawing(chart)


def draw_minor_errors(evaluation: Evaluation) -> Drawing:
    """Draw the error of the command along the walk: with the chosen reversal, and with branches switched at once."""
    checked, reversal = evaluation.checked, evaluation.reversal
    if reversal is None:
        return NOTHING
    chosen_n = command_error_n(evaluation.model, checked.minor_v, checked.minor_n)
    switched_n = command_error_n(evaluation.chosen.result.bsfm(0.0), checked.minor_v, checked.minor_n)
    stops = len(reversal.slip.stops.radii_v) if reversal.slip else 0
    steps = list(range(1, len(chosen_n) + 1))
    both = [*chosen_n.tolist(), *switched_n.tolist()]
    chart = Chart(
        Axis(0, len(steps) + 1, "step of the walk"),
        Axis(*spread(both, margin=_ERROR_MARGIN, around=0.0), "error of the command (N)"),
        "Command error along the partial reversals",
    )
    chart.level(0.0)
    chart.line(steps, switched_n.tolist(), "dash switched", f"branches switched: {rms_n(switched_n):.2f} N RMS")
    policy = spell_reversal(stops, evaluation.span_n)
    chart.line(steps, chosen_n.tolist(), "walk", f"{policy}: {rms_n(chosen_n):.2f} N RMS")
    worst = int(np.argmax(np.abs(chosen_n)))
    error = _signed(float(chosen_n[worst]))
    chart.mark(steps[worst], float(chosen_n[worst]), f"largest: {error}")
    return drawing(chart, f"Largest with {policy}: {error} at step {steps[worst]}.")
