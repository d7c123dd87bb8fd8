"""Durations on the command line: `500ms`, `10s`, `2min` (or `2m`), `1.5h`, `1d`, or a number of seconds."""

import re
from typing import Final

_UNITS_S: Final = {"": 1.0, "ms": 1e-3, "s": 1.0, "m": 60.0, "min": 60.0, "h": 3600.0, "d": 86400.0}
_DURATION: Final = re.compile(r"(\d+(?:\.\d*)?|\.\d+) ?(ms|s|min|m|h|d|)", re.ASCII)


def parse_duration_s(text: str) -> float | None:
    """Return the seconds that a text means; None where it is no duration."""
    match = _DURATION.fullmatch(text.strip())
    return float(match[1]) * _UNITS_S[match[2]] if match else None
