"""The report of `calibration compare`: both loops over the measured points, and where they differ."""

from collections.abc import Iterator

from gateway.bsfm.ladder.measured_ladder import FALLING, RISING, Ladder
from gateway.cli.calibration.comparison import Comparison, answer_sentence, title
from gateway.cli.calibration.measured_points import MeasuredPoints
from gateway.reports.axis import Axis, spread
from gateway.reports.figures import drawing, figure
from gateway.reports.frame import Head, notes, page, section, table, tiles
from gateway.reports.svg_chart import Chart

_WAYS = ((RISING, "rising"), (FALLING, "falling"))
_TICKS_SHOWN = 9


def comparison_page(comparison: Comparison, points: dict[str, MeasuredPoints]) -> str:
    """Return a self-contained HTML page. points: those that A and B were made from."""
    first, second = (f"{letter}: {title(each)}" for letter, each in (("A", comparison.a), ("B", comparison.b)))
    head = Head(
        kind="Two calibrations compared",
        answer=answer_sentence(comparison),
        sentences=tuple(_describe_points(comparison, points)),
        facts=(first, second),
    )
    missing = [f"No measured points of {name}: {each.why}." for name, each in points.items() if each.ladder is None]
    parts = [
        tiles(*_figures(comparison)),
        f"<div class='pair'>{_loops(comparison, points)}{_differences(comparison)}</div>",
        notes(missing),
        section("The branches, in figures", _table(comparison)),
    ]
    provenance = {
        f"{letter}": f"{title(each)}; {each.source}" for letter, each in (("A", comparison.a), ("B", comparison.b))
    }
    return page(head, parts, provenance)


def _figures(comparison: Comparison) -> Iterator[tuple[str, str, str]]:
    for name, branch in comparison.branches.items():
        place = f"N RMS; at most {_signed(branch.max_n)} N at {comparison.place_v(branch):.2f} V"
        yield f"B − A, {name}", f"{branch.rms_n:.3f}", place


def _describe_points(comparison: Comparison, points: dict[str, MeasuredPoints]) -> Iterator[str]:
    """How far both are off at the points that were measured, where there are any."""
    for name, each in points.items():
        if each.ladder is not None:
            errors = (each.error_rms_n(model) for model in (comparison.a, comparison.b))
            first, second = (f"{error_n:.3f} N RMS" for error_n in errors)
            yield f"At the {len(each.ladder)} points that {name} was made from, A is off by {first} and B by {second}."


def _loops(comparison: Comparison, points: dict[str, MeasuredPoints]) -> str:
    volts = comparison.voltage_v
    ladders = {name: each.ladder for name, each in points.items() if each.ladder is not None}
    forces = [force for branch in comparison.branches.values() for force in (*branch.a_n, *branch.b_n)]
    measured = [force for ladder in ladders.values() for force in ladder.force_n.tolist()]
    chart = Chart(_across(volts), Axis(*spread([*forces, *measured]), "force (N)"), "Both loops, and measured points")
    for name, ladder in ladders.items():
        _draw_points(chart, ladder, name, (volts[0], volts[-1]))
    for name, branch in comparison.branches.items():
        chart.line(volts, branch.a_n, f"{name} dash", f"A, {name}")
        chart.line(volts, branch.b_n, name, f"B, {name}")
    shown = "Dots: measured. " if ladders else ""
    return figure("Both loops", drawing(chart), f"{shown}Broken lines: A. Whole lines: B.")


def _draw_points(chart: Chart, ladder: Ladder, name: str, ends_v: tuple[float, float]) -> None:
    inside = (ladder.voltage_v >= ends_v[0]) & (ladder.voltage_v <= ends_v[1])
    for way, word in _WAYS:
        mask = inside & (ladder.direction == way)
        style = f"measured {'few' if name == 'B' else 'many'}"
        said = f"measured for {name}" if way == RISING else ""
        chart.dots(ladder.voltage_v[mask].tolist(), ladder.force_n[mask].tolist(), f"{style} of-{word}", said)


def _differences(comparison: Comparison) -> str:
    gaps = [gap for branch in comparison.branches.values() for gap in branch.difference_n]
    chart = Chart(
        _across(comparison.voltage_v), Axis(*spread(gaps, around=0.0), "B − A (N)"), "Difference of the branches"
    )
    chart.level(0.0)
    for name, branch in comparison.branches.items():
        chart.line(comparison.voltage_v, branch.difference_n, name, name)
    name, worst = max(comparison.branches.items(), key=lambda item: abs(item[1].max_n))
    place_v = comparison.place_v(worst)
    chart.mark(place_v, worst.max_n, f"{_signed(worst.max_n)} N")
    return figure("Difference", drawing(chart, f"Largest: {_signed(worst.max_n)} N at {place_v:.2f} V, {name}."))


def _across(volts: tuple[float, ...]) -> Axis:
    return Axis(volts[0], volts[-1], "command (V)")


def _signed(value_n: float) -> str:
    return f"{value_n:+.3f}".replace("-", "−")


def _table(comparison: Comparison) -> str:
    heads = (
        "command (V)",
        *(f"{each}, {name}" for name in comparison.branches for each in ("A (N)", "B (N)", "B − A")),
    )
    count = len(comparison.voltage_v)
    rows = []
    for k in range(0, count, (count - 1) // (_TICKS_SHOWN - 1)):
        cells = [f"{comparison.voltage_v[k]:.2f}"]
        for branch in comparison.branches.values():
            cells += [f"{branch.a_n[k]:.2f}", f"{branch.b_n[k]:.2f}", _signed(branch.difference_n[k])]
        rows.append(cells)
    return table(heads, rows, "numbers")
