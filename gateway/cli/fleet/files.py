"""What a fleet's work leaves in its folder: rows, days, cells (Parquet) and the report. Each whole, or as it was before."""

from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any, Final

from gateway.extras import import_library
from gateway.fleet.drift import CellDrift
from gateway.fleet.page import fleet_page
from gateway.fleet.tasks import Row
from gateway.processes.durable_file import replace_text, replacing_file

ROWS: Final = "rows.parquet"
DAYS: Final = "days.parquet"
CELLS: Final = "cells.parquet"
REPORT: Final = "report.html"
KEPT: Final = "rows.jsonl"
WRITTEN: Final = (ROWS, DAYS, CELLS, REPORT)


def write_files(folder: Path, rows: Sequence[Row], cells: Sequence[CellDrift], verb: str) -> list[Path]:
    """Write rows, days and cells.parquet and report.html; the paths. OSError when the disk does not take them."""
    _write_parquet(folder / ROWS, rows)
    _write_parquet(folder / DAYS, day_rows(rows))
    _write_parquet(folder / CELLS, [cell_row(one) for one in cells])
    report = folder / REPORT
    replace_text(report, fleet_page(rows, cells, verb))
    return [folder / ROWS, folder / DAYS, folder / CELLS, report]


def cell_row(one: CellDrift) -> dict[str, Any]:
    """Return a cell's trend as plain values; slope and interval in N per day, None where there are too few days."""
    trend = one.trend
    return {
        "cell": one.cell,
        "first_day": one.first_day,
        "days": len(one.days),
        "drifts": one.drifts,
        "change_n": one.change_n,
        "slope_n_per_day": trend.slope_n_per_day if trend else None,
        "slope_low_n_per_day": trend.low if trend else None,
        "slope_high_n_per_day": trend.high if trend else None,
        "chance": trend.chance if trend else None,
        "cause": one.cause,
        "cause_n": one.cause_n,
        "group": list(one.group),
        "errors": one.errors,
    }


def day_rows(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Return a summary of every cell's every day: how many recordings and errors, the median of what is watched, the causes
    that were named."""
    by_day: dict[tuple[str, str], list[Row]] = {}
    for row in sorted(rows, key=lambda row: (row["cell"], row["date"])):
        by_day.setdefault((row["cell"], row["date"]), []).append(row)
    return [_day_row(cell, date, of_day) for (cell, date), of_day in by_day.items()]


def _day_row(cell: str, date: str, rows: Sequence[Row]) -> dict[str, Any]:
    good = [row for row in rows if not row["error_code"]]
    return {
        "cell": cell,
        "date": date,
        "recordings": len(rows),
        "errors": len(rows) - len(good),
        "value_n": median(row["value_n"] for row in good) if good else None,
        "causes": sorted({cause["name"] for row in good for cause in row["causes"]}),
    }


def _write_parquet(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    arrow, parquet = import_library("pyarrow"), import_library("pyarrow.parquet")
    with replacing_file(path) as stream:
        parquet.write_table(arrow.Table.from_pylist(list(rows)), stream)
