"""Which plant was in use while something was recorded, as the recording says it."""

import json
from typing import Any


def header_in_use(header: dict[str, Any]) -> dict[str, Any]:
    """Return what a recording says of the plant that was in use; empty for one that says nothing. A CSV holds it as JSON."""
    in_use = header.get("plant_in_use") or {}
    try:
        in_use = json.loads(in_use) if isinstance(in_use, str) else in_use
    except (ValueError, RecursionError):
        return {}
    return in_use if isinstance(in_use, dict) else {}
