"""The `--columns` that corrects a column which is not what its name says, beside what was said of the table already.

What a number was multiplied by to be read, because a header or a mapping said so, stays: a force whose header says kgf and
whose sign is turned is in -kgf, not in -n.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isclose
from typing import Final, TypeAlias

from gateway.diagnosis.input_checks import Suspect
from gateway.units import LINEAR

Factors: TypeAlias = Mapping[str, float]
_QUANTITIES: Final = {"time_s": "time", "force_n": "force", "command_v": "voltage", "pressure_kpa": "pressure"}
_RANGE_MEANT: Final = re.compile(r"(.*\.\..*=\s*)([-+.\d]+)\.\.([-+]?[.\d]+)\s*([A-Za-z_]*)")


def name_options(
    found: Sequence[Suspect], given: str | None, factors: Mapping[str, Factors] | None = None
) -> tuple[Suspect, ...]:
    """Return the same with the option that corrects each, where there is one. given: what --columns said, None where that
    cannot be said in one line; factors: by recording and column, what numbers were multiplied by to be read."""
    if given is None:
        return tuple(found)
    known = factors or {}
    return tuple(replace(each, option=columns_option(each, given, known.get(each.recording, {}))) for each in found)


def columns_option(suspect: Suspect, given: str = "", factors: Factors | None = None) -> str:
    """Return `--columns ...` that corrects it; empty where no unit does. given: what --columns said, NAME=SOURCE[:UNIT] with
    commas: sources stay, and what was converted already stays so."""
    entries = dict(part.strip().split("=", 1) for part in given.split(",") if "=" in part)
    before, known = dict(entries), factors or {}
    for name, source in suspect.mapping.items():
        head, _, unit = source.partition(":")
        entry = before.get(head, head)
        meant = _RANGE_MEANT.fullmatch(entry)
        text = _scaled_entry(meant, name, unit) if meant else _entry(entry, name, unit, known.get(head, 1.0))
        if not text:
            return ""
        entries[name] = text
    return f"--columns {','.join(f'{name}={entry}' for name, entry in entries.items())}"


def _entry(entry: str, name: str, unit: str, factor: float) -> str:
    """Return the source of an entry with the unit that makes of its numbers what `unit` makes of them as they were read; empty
    where there is none. unit: empty for columns that are exchanged; factor: as they were read."""
    source = entry.rpartition(":")[0] or entry
    if not unit and factor == 1.0 and entry == source:
        return source
    found = _unit_of(name, factor * _factor(name, unit))
    return f"{source}:{found}" if found else ""


def _scaled_entry(meant: re.Match[str], name: str, unit: str) -> str:
    """Return an entry of a range, `3:4..20=0..500n`, with the unit or the sign that corrects it; empty where there is none."""
    head, low, high, own = meant.groups()
    found = _unit_of(name, _factor(name, own.lower()) * _factor(name, unit))
    if not found:
        return ""
    if found.startswith("-"):
        low, high = (f"{0.0 - float(end):g}" for end in (low, high))
    return f"{head}{low}..{high}{found.removeprefix('-')}"


def _own_unit(name: str) -> str:
    return name.rpartition("_")[2]


def _factor(name: str, unit: str) -> float:
    """Return what numbers in a unit are multiplied by to be in a column's own, with the sign of `-n`; 1 for none."""
    if not unit:
        return 1.0
    units = LINEAR[_QUANTITIES[name]]
    factor = units[unit.removeprefix("-")][0] / units[_own_unit(name)][0]
    return -factor if unit.startswith("-") else factor


def _unit_of(name: str, factor: float) -> str:
    """Return the unit with this factor, `-kgf` for a turned one; empty where there is none."""
    near = (unit for unit in LINEAR[_QUANTITIES[name]] if isclose(_factor(name, unit), abs(factor), rel_tol=1.0e-6))
    unit = next(near, "")
    return f"-{unit}" if unit and factor < 0.0 else unit
