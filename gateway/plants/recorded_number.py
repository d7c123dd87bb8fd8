"""Which plant was in use while something was recorded, as the recording says it."""

import json
from dataclasses import fields
from typing import Any, Final

from gateway.recording import RecordingError

_LARGEST: Final = 1.0e30


def header_in_use(header: dict[str, Any]) -> dict[str, Any]:
    """Return what a recording says of the plant that was in use; empty for one that says nothing. A CSV holds it as JSON.
    RecordingError where it says what no gateway writes: nobody knows then how the readings were straightened."""
    in_use = header.get("plant_in_use") or {}
    try:
        in_use = json.loads(in_use) if isinstance(in_use, str) else in_use
    except (ValueError, RecursionError):
        return {}
    if not isinstance(in_use, dict):
        return {}
    number, cell = in_use.get("number", 0), in_use.get("cell")
    if type(number) is not int or not (cell is None or _is_cell(cell)):
        raise RecordingError(
            "the recording says of plant_in_use what no gateway writes: take that line out if the readings are the cell's own"
        )
    return in_use


def _is_cell(cell: Any) -> bool:
    from gateway.control.compensation.cell_map import CellMap  # here: a diagnosis of any other table loads no control

    return (
        isinstance(cell, dict)
        and cell.keys() <= {each.name for each in fields(CellMap)}
        and all(type(value) in (int, float) and abs(value) < _LARGEST for value in cell.values())
    )
