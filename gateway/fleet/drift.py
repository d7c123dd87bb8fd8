"""Which cells drift, and why: the trend of each cell over its days, against what chance would show somewhere in the fleet.

A cell's quantity is each row's `value_n`: of a diagnosis what the simulation gets wrong beyond the noise, of a fit the force at
the middle of the voltages. Slope, interval and chance are those of `trend`; among many cells the smallest of many
chances is small, so chances are judged by Holm's step-down procedure (Holm 1979), which keeps the chance of even one false
alarm in the whole fleet at `ALPHA`. A drift that nobody would mind is none: over the days that were seen it must reach
`LEAST_N`.
Why: the effect whose part of the excess has changed most in that cell, the way of the drift, by the same slope: a name that
stands on one or two days moves no median. What no day that names it can tell from it is named beside it.
A seal that stiffens is no effect that is missing, for the base model fits its friction anew on each day: so the numbers that it
refits are watched, too, by the force that each makes up for, and judged as a second family beside the first. One of them is
told where nothing else drifts in its cell.
"""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date
from math import isfinite
from typing import Final

import numpy as np

from gateway.fleet.tasks import Row
from gateway.fleet.trend import Trend, fit_trend

ALPHA: Final = 0.01
LEAST_N: Final = 0.1


@dataclass(frozen=True, slots=True)
class CellDrift:
    """days: since the cell's first one; values_n: of each day's recordings, the median; change_n: over all days, by the
    slope; cause: the effect that has changed most, empty for none; cause_n: by how much; group: effects that no day tells apart
    from it, itself among them; is_refitted: values_n are the force that the refit of `cause` makes up for, and no error."""

    cell: str
    first_day: str
    days: tuple[float, ...]
    values_n: tuple[float, ...]
    trend: Trend | None
    change_n: float
    drifts: bool
    cause: str
    cause_n: float
    group: tuple[str, ...]
    errors: int
    is_refitted: bool = False


def find_drifts(rows: Iterable[Row]) -> list[CellDrift]:
    """Return every cell, those that drift first and the steepest of them before the others. Rows without a date or with an
    error tell of no trend."""
    by_cell: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        by_cell[row["cell"]].append(row)
    ordered = sorted(by_cell.items())
    cells = _judge([_of_cell(cell, found) for cell, found in ordered])
    refits = _judge([one for cell, found in ordered for one in _refits_of(cell, found)])
    steepest = sorted((one for one in refits if one.drifts), key=lambda one: abs(one.change_n))
    refit_of = {one.cell: one for one in steepest}
    told = [one if one.drifts else refit_of.get(one.cell, one) for one in cells]
    return sorted(told, key=lambda one: (not one.drifts, -abs(one.change_n), one.cell))


def _of_cell(cell: str, rows: Sequence[Row]) -> CellDrift:
    good = [row for row in rows if not row["error_code"] and _day(row["date"]) is not None]
    days = sorted({row["date"] for row in good})
    first = _day(days[0]) if days else None
    since = tuple(float((_day(day) or date.min).toordinal() - first.toordinal()) for day in days) if first else ()
    values = tuple(float(np.median([row["value_n"] for row in good if row["date"] == day])) for day in days)
    trend = fit_trend(since, values)
    change_n = trend.slope_n_per_day * (since[-1] - since[0]) if trend else 0.0
    cause, cause_n = _grown(good, days, since, change_n) if trend else ("", 0.0)
    errors = sum(bool(row["error_code"]) for row in rows)
    first_day, group = days[0] if days else "", _group_of(cause, good)
    return CellDrift(cell, first_day, since, values, trend, change_n, False, cause, cause_n, group, errors)


def _refits_of(cell: str, rows: Sequence[Row]) -> list[CellDrift]:
    """The trend of each number that the base model has refitted, by the force that it makes up for."""
    names = sorted({each["name"] for row in rows for each in row.get("refitted") or ()})
    errors = sum(bool(row["error_code"]) for row in rows)
    return [replace(_of_cell(cell, _rows_by(name, rows)), errors=errors, is_refitted=True) for name in names]


def _rows_by(name: str, rows: Sequence[Row]) -> list[Row]:
    """Rows whose value, and whose only cause, is what one refitted number makes up for."""
    return [
        {**row, "value_n": each["by_n"], "causes": [{"name": name, "gain_n": each["by_n"], "group": [name]}]}
        for row in rows
        for each in row.get("refitted") or ()
        if each["name"] == name
    ]


def _judge(family: Sequence[CellDrift]) -> list[CellDrift]:
    """Each with its verdict, as one of so many that were asked."""
    proven = _holm({str(place): one.trend.chance for place, one in enumerate(family) if one.trend})
    return [
        replace(one, drifts=str(place) in proven and abs(one.change_n) >= LEAST_N) for place, one in enumerate(family)
    ]


def _grown(rows: Sequence[Row], days: Sequence[str], since: Sequence[float], change_n: float) -> tuple[str, float]:
    """The effect whose gain has changed most the way of change_n; a day on which it is not named has 0 of it."""
    names = {cause["name"] for row in rows for cause in row["causes"]}
    changes = {name: _change_of(name, rows, days, since) for name in sorted(names)}
    best = max(changes, key=lambda name: changes[name] * change_n, default="")
    return (best, changes[best]) if best and changes[best] * change_n > 0.0 else ("", 0.0)


def _group_of(name: str, rows: Sequence[Row]) -> tuple[str, ...]:
    """The effects that stand beside this one on every day that names it, itself first."""
    groups = [cause["group"] for row in rows for cause in row["causes"] if cause["name"] == name]
    others = set.intersection(*map(set, groups)) - {name} if groups else set()
    return (name, *sorted(others)) if name else ()


def _change_of(name: str, rows: Sequence[Row], days: Sequence[str], since: Sequence[float]) -> float:
    gains = [float(np.mean([_gain_of(name, row) for row in rows if row["date"] == day])) for day in days]
    trend = fit_trend(since, gains)
    return trend.slope_n_per_day * (since[-1] - since[0]) if trend else 0.0


def _gain_of(name: str, row: Row) -> float:
    return next((cause["gain_n"] for cause in row["causes"] if cause["name"] == name), 0.0)


def _holm(chances: Mapping[str, float]) -> set[str]:
    """Return the names whose null hypothesis falls at ALPHA among all of them."""
    fallen: set[str] = set()
    order = sorted((chance, name) for name, chance in chances.items() if isfinite(chance))
    for place, (chance, name) in enumerate(order):
        if chance > ALPHA / (len(order) - place):
            break
        fallen.add(name)
    return fallen


def undated(rows: Iterable[Row]) -> list[Row]:
    """Return the rows that no trend counts for want of a day, where they have an answer."""
    return [row for row in rows if not row["error_code"] and _day(row["date"]) is None]


def _day(text: str) -> date | None:
    try:
        return date.fromisoformat(text)
    except ValueError:
        return None
