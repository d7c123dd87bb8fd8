"""`--columns` and `--sheet`: how the table of another program is read, alike for every verb that takes one."""

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar, cast

import click

Verb = TypeVar("Verb", bound=Callable[..., Any])


def table_options(verb: Verb) -> Verb:
    """Add both options; the verb gets one mapping, `columns`, in which the sheet stands first."""

    @click.option(
        "--columns",
        metavar="MAP",
        help="For foreign tables: time_s=1:ms,force_n=7:n (column or header, unit), force_n=3:4..20=0..500n, or a YAML file.",
    )
    @click.option(
        "--sheet", metavar="NAME", help="The sheet of an Excel workbook, by name or number; default the first."
    )
    @wraps(verb)
    def with_table(*positional: Any, columns: str | None, sheet: str | None, **options: Any) -> Any:
        if sheet is not None:
            columns = f"sheet={sheet}" + (f",{columns}" if columns else "")
        return verb(*positional, columns=columns, **options)

    return cast(Verb, with_table)
