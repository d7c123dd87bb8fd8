"""The cells of a fleet as a table of the terminal: those that drift first."""

from collections.abc import Sequence
from typing import Final

import click

from gateway.fleet.drift import CellDrift
from gateway.fleet.page import cause_in_words

_MOST_SHOWN: Final = 20


def print_cells(cells: Sequence[CellDrift]) -> None:
    """Print a row for each cell, the steepest first, and how many more there are."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, header_style="dim")
    table.add_column("cell")
    for name in ("days", "change\nN", "N per day\n95 %"):
        table.add_column(name, justify="right")
    table.add_column("cause that changed")
    for one in cells[:_MOST_SHOWN]:
        table.add_row(*_words(one), style="bold" if one.drifts else None)
    Console(markup=False).print(table)  # a cell is called as it likes
    if len(cells) > _MOST_SHOWN:
        click.echo(f"and {len(cells) - _MOST_SHOWN} cells more: cells.parquet has all")


def _words(one: CellDrift) -> tuple[str, ...]:
    name = f"{one.cell or '-'}{' drifts' if one.drifts else ''}"
    if one.trend is None:
        return name, str(len(one.days)), "-", "-", ""
    interval = f"{one.trend.low:+.3f} .. {one.trend.high:+.3f}"
    return name, str(len(one.days)), f"{one.change_n:+.2f}", interval, cause_in_words(one) if one.cause else ""
