"""The report of `calibration compare`: both loops over the measured points, and where they differ."""

from collections.abc import Iterator

from gateway.bsfm.ladder.measured_ladder import Ladder
from gateway.cli.calibration.comparison import Comparison, answer_sentence, title
from gateway.cli.calibration.measured_points import MeasuredPoints
from gateway.reports.axis import Axis, spread
from gateway.reports.figures import drawing, figure
from gateway.reports.frame import Head, notes, page, section, table, tiles
from gateway.reports.svg_chart import Chart

_STYLES = {"A": "measured", "B": "walk"}  # of the points that each was made from
_TICKS_SHOWN = 9


def comparison_page(comparison: Comparison, points: dict[str, MeasuredPoints]) -> str:
    """Return a self-contained HTML page. points: those that A and B were made from."""
    first, second = (f"{letter}: {title(each)}" for letter, each in (("A", comparison.a), ("B", comparison.b)))
    head = Head(
        kind="Two calibrations compared",
        answer=answer_sentence(comparison),
        sentences=tuple(
            f"{said}."
            for letter, each in points.items()
            if (said := each.describe(letter, (comparison.a, comparison.b)))
        ),
        facts=(first, second),
    )
    missing = [f"No measured points of {name}: {each.why}." for name, each in points.items() if each.checked is None]
    parts = [
        tiles(*_figures(comparison)),
        section("Side by side", f"<div class='pair'>{_loops(comparison, points)}{_differences(comparison)}</div>"),
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


def _loops(comparison: Comparison, points: dict[str, MeasuredPoints]) -> str:
    volts = comparison.voltage_v
    ladders = {name: each.checked.ladder for name, each in points.items() if each.checked is not None}
    forces = [force for branch in comparison.branches.values() for force in (*branch.a_n, *branch.b_n)]
    measured = [force for ladder in ladders.values() for force in ladder.force_n.tolist()]
    chart = Chart(_across(volts), Axis(*spread([*forces, *measured]), "force (N)"), "Both loops, and measured points")
    for name, branch in comparison.branches.items():
        chart.line(volts, branch.a_n, f"{name} dash", f"A, {name}")
        chart.line(volts, branch.b_n, name, f"B, {name}")
    for name, ladder in ladders.items():
        _draw_points(chart, ladder, name, (volts[0], volts[-1]))
    shown = "Rings: measured. " if ladders else ""
    stops = " Just after a turn the slip stops hold the force between the branches." if _has_stops(comparison) else ""
    return figure("Both loops", drawing(chart), f"{shown}Broken lines: A. Whole lines: B.{stops}")


def _has_stops(comparison: Comparison) -> bool:
    return bool(comparison.a.slip_radii_v or comparison.b.slip_radii_v)


def _draw_points(chart: Chart, ladder: Ladder, name: str, ends_v: tuple[float, float]) -> None:
    inside = (ladder.voltage_v >= ends_v[0]) & (ladder.voltage_v <= ends_v[1])
    chart.points(
        ladder.voltage_v[inside].tolist(), ladder.force_n[inside].tolist(), _STYLES[name], f"measured for {name}"
    )


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
    return f"{value_n:+z.3f}".replace("-", "−")


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
