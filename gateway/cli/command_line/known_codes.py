"""A code of a message as it is typed: W204, w204, or the name that registers have for it, such as over_force."""

from difflib import get_close_matches
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from gateway.codes.all_codes import CatalogueEntry


def entries_of(code: str) -> "tuple[CatalogueEntry, ...]":
    """Return the entries of one code or name; UsageError where there is none, with those that are near."""
    from gateway.codes.all_codes import CATALOGUE, find_codes

    if code.strip() and (entries := find_codes(code)):
        return entries
    codes = [*CATALOGUE, *(entry.name for entry in CATALOGUE.values() if entry.name)]
    near = get_close_matches(code.upper().replace("-", "_"), codes, n=2, cutoff=0.6)
    meant = f"; did you mean {' or '.join(near)}?" if near else ";"
    raise click.UsageError(f"{code} is not a code{meant} `force-gateway explain` lists them all")
