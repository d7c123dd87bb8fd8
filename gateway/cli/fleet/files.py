"""What a fleet's work leaves in its folder: rows and cells as Parquet, and the report. Each whole, or as it was before."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from gateway.extras import import_library
from gateway.fleet.drift import CellDrift
from gateway.fleet.page import fleet_page
from gateway.fleet.tasks import Row

ROWS: Final = "rows.parquet"
CELLS: Final = "cells.parquet"
REPORT: Final = "report.html"
KEPT: Final = "rows.jsonl"


def write_files(folder: Path, rows: Sequence[Row], cells: Sequence[CellDrift], verb: str) -> list[Path]:
    """Write rows.parquet, cells.parquet and report.html; the paths. OSError when the disk does not take them."""
    _write_parquet(folder / ROWS, rows)
    _write_parquet(folder / CELLS, [cell_row(one) for one in cells])
    report = folder / REPORT
    beside = report.with_name(f".{report.name}.new")
    beside.write_text(fleet_page(rows, cells, verb), encoding="utf-8")
    beside.replace(report)
    return [folder / ROWS, folder / CELLS, report]


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
        "errors": one.errors,
    }


def _write_parquet(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    arrow, parquet = import_library("pyarrow"), import_library("pyarrow.parquet")
    beside = path.with_name(f".{path.name}.new")
    parquet.write_table(arrow.Table.from_pylist(list(rows)), beside)
    beside.replace(path)
