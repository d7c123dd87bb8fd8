"""The report of a fleet: which cells drift and why, as the first sentence; then each cell's days."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from html import escape
from typing import Final

from gateway.fleet.drift import ALPHA, LEAST_N, CellDrift
from gateway.fleet.tasks import Row
from gateway.fleet.trend import LEAST_DAYS, level_of
from gateway.progress import few
from gateway.reports.axis import Axis, spread
from gateway.reports.figures import NOTHING, Drawing, Panel, drawing, grid
from gateway.reports.frame import Head, notes, page, section, table, tiles
from gateway.reports.svg_chart import Chart

_MOST_NAMED: Final = 3
_MOST_DRAWN: Final = 40
_MOST_ERRORS: Final = 20
_VALUE: Final = {"diagnose": "beyond the noise (N)", "fit": "force at the middle voltage (N)"}


def headline(cells: Sequence[CellDrift]) -> str:
    """Return the answer in one sentence."""
    drifting = [one for one in cells if one.drifts]
    if not drifting:
        judged = sum(one.trend is not None for one in cells)
        return (
            f"No drift in any of {judged} cells" if judged else f"No cell has {LEAST_DAYS} days: no trend can be judged"
        )
    named = "; ".join(map(describe_drift, drifting[:_MOST_NAMED]))
    more = f"; and {len(drifting) - _MOST_NAMED} more" if len(drifting) > _MOST_NAMED else ""
    verb = "drifts" if len(drifting) == 1 else "drift"
    return f"{len(drifting)} of {len(cells)} cells {verb}: {named}{more}"


def describe_drift(one: CellDrift) -> str:
    """Return a cell's drift in words: `cell 7 (leak, +0.82 N in 5 days)`."""
    why = f"{cause_in_words(one)}, " if one.cause else ""
    return f"cell {one.cell or 'without a name'} ({why}{one.change_n:+.2f} N in {one.days[-1] - one.days[0]:.0f} days)"


def cause_in_words(one: CellDrift) -> str:
    """Return the cause, and those that its recordings do not tell from it: `leak or creep, warm-up`."""
    others = f" or {few(one.group[1:])}" if one.group[1:] else ""
    return f"{one.cause}{others}{', refitted' if one.is_refitted else ''}"


def fleet_page(rows: Sequence[Row], cells: Sequence[CellDrift], verb: str) -> str:
    """Return the page. verb: diagnose or fit."""
    failed = [row for row in rows if row["error_code"]]
    drifting = sum(one.drifts for one in cells)
    badge = ("drift", "warn") if drifting else ("steady", "good")
    head = Head(kind=f"Fleet: {verb}", answer=headline(cells), badge=badge, facts=(_facts(rows, cells),))
    named = Counter(cause["name"] for row in rows for cause in row["causes"] or ())
    parts = (
        tiles(
            ("recordings", str(len(rows) - len(failed)), "read"),
            ("cells", str(len(cells)), f"{drifting} drifting"),
            ("not read", str(len(failed)), "recordings"),
        ),
        section("Cells", table(_HEADS, map(_cell_cells, cells), "numbers")),
        section("Day by day", _day_by_day(cells, _axis(cells, verb))),
        section(
            "Causes that were named",
            table(("cause", "recordings"), ((escape(name), str(count)) for name, count in named.most_common()))
            if named
            else "",
        ),
        section(
            "Not read",
            table(
                ("recording", "why"),
                ((escape(row["file"]), escape(f"{row['error_code']} {row['error']}")) for row in failed[:_MOST_ERRORS]),
            )
            if failed
            else "",
        ),
        notes(_caveats(cells)),
    )
    return page(head, parts, {"rows": len(rows)})


_HEADS: Final = ("cell", "days", "change (N)", "N per day", "95 % of it", "by chance", "cause that changed")


def _cell_cells(one: CellDrift) -> tuple[str, ...]:
    trend, name = one.trend, escape(one.cell or "-")
    if trend is None:
        return (name, str(len(one.days)), "-", "-", "-", "-", "")
    word = " <span class='badge warn'>drift</span>" if one.drifts else ""
    cause = f"{escape(cause_in_words(one))} {one.cause_n:+.2f} N" if one.cause else ""
    return (
        name + word,
        str(len(one.days)),
        f"{one.change_n:+.2f}",
        f"{trend.slope_n_per_day:+.3f}",
        f"{trend.low:+.3f} .. {trend.high:+.3f}",
        f"{trend.chance:.2g}",
        cause,
    )


def _title(one: CellDrift) -> str:
    return f"Cell {one.cell or 'without a name'}" + (f": {one.cause}" if one.drifts and one.cause else "")


def _day_by_day(cells: Sequence[CellDrift], axis: Axis) -> str:
    return grid(*(Panel(_title(one), partial(_draw, one, axis)) for one in cells[:_MOST_DRAWN]))


def _axis(cells: Sequence[CellDrift], verb: str) -> Axis:
    """One for all cells, so that they can be compared: of a diagnosis from 0 to where a drift would begin, at least."""
    values = [value for one in cells for value in one.values_n]
    if verb == "diagnose" or not values:
        values += [0.0, 1.5 * LEAST_N]
    return Axis(*spread(values), _VALUE[verb])


def _draw(one: CellDrift, axis: Axis, *, wide: bool) -> Drawing:
    if not one.days:
        return NOTHING
    days = Axis(0.0, max(one.days[-1], 1.0), f"days since {one.first_day}")
    label = f"what refitting {one.cause} makes up for (N)" if one.is_refitted else axis.label
    chart = Chart(days, replace(axis, label=label), f"Cell {one.cell}: {label} by day", height=170)
    if one.trend:
        level_n = level_of(one.trend, one.days, one.values_n)
        ends = [level_n + one.trend.slope_n_per_day * day for day in (one.days[0], one.days[-1])]
        chart.line((one.days[0], one.days[-1]), ends, "walk", "trend")
    chart.points(one.days, one.values_n, "rising", "median of a day")
    return drawing(chart)


def _facts(rows: Sequence[Row], cells: Sequence[CellDrift]) -> str:
    days = sorted({row["date"] for row in rows if row["date"]})
    span = f", {days[0]} to {days[-1]}" if days else ""
    return f"{len(rows)} recordings of {len(cells)} cells{span}"


def _caveats(cells: Sequence[CellDrift]) -> list[str]:
    unjudged = [one.cell for one in cells if one.trend is None]
    law = f"less than {100 * ALPHA:g} % of fleets (Kendall's test and Student's t, Holm over all cells)"
    said = [f"Drift: a slope as steep comes by chance in {law}, and the change is {LEAST_N:g} N or more."]
    if unjudged:
        have, their = ("cell has", "its") if len(unjudged) == 1 else ("cells have", "their")
        said.append(f"{len(unjudged)} {have} fewer than {LEAST_DAYS} days or no dates: {their} trend is not judged.")
    if len(cells) > _MOST_DRAWN:
        said.append(f"{_MOST_DRAWN} of {len(cells)} cells are drawn; cells.parquet has all.")
    return said
