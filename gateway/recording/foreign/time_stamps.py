"""Stamps of time that loggers write, as seconds: ISO 8601 with and without zone, 22.11.2026, and the time of day alone.

Dates with slashes are left alone: 11/12/2026 is two days, and nobody can tell which. A stamp without a zone counts as UTC:
only differences are used, and where the clock was set back in autumn the times run backwards, which is refused elsewhere.
"""

import re
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_CLOCK: Final = re.compile(r"(\d{1,2}):([0-5]\d):([0-5]\d)(?:[.,](\d{1,9}))?")
_DATE: Final = re.compile(r"(?:(\d{4})-(\d\d)-(\d\d)|(\d{1,2})\.(\d{1,2})\.(\d{4}))(?:(?:T|\s+)(.+))?")
_ZONE: Final = re.compile(r"\s*(Z|UTC|GMT|[+-]\d\d:?\d\d)$")
_SLASHES: Final = re.compile(r"\d{1,2}/\d{1,2}/\d{2,4}\b.*")
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
_SECOND_US: Final = 1_000_000
_DAY_US: Final = 86_400 * _SECOND_US


def parse_stamp(cell: str) -> float | None:
    """Return the microseconds since 1970, or of the day where no date stands; None for what is no stamp."""
    text = cell.strip()
    if ":" not in text and "-" not in text and text.count(".") != 2:
        return None  # a number: most cells
    if clock := _CLOCK.fullmatch(text):
        return _clock_us(clock)
    found = _DATE.fullmatch(text)
    return _date_us(found) if found else None


def is_ambiguous_date(cell: str) -> bool:
    """Decide whether this is a date with slashes, whose day and month nobody can tell apart."""
    return bool(_SLASHES.fullmatch(cell.strip()))


def _clock_us(clock: re.Match[str]) -> float:
    hours, minutes, seconds, fraction = clock.groups()
    whole_s = int(hours) * 3600 + int(minutes) * 60 + int(seconds)
    return float(whole_s * _SECOND_US + int((fraction or "0").ljust(6, "0")[:6]))


def _date_us(found: re.Match[str]) -> float | None:
    year, month, day, day_first, month_second, year_last, rest = found.groups()
    offset_us = clock_us = 0.0
    if rest:
        zone = _ZONE.search(rest)
        clock = _CLOCK.fullmatch(rest[: zone.start()] if zone else rest.strip())
        if clock is None:
            return None
        clock_us, offset_us = _clock_us(clock), _offset_us(zone[1]) if zone else 0.0
    try:
        date = datetime(int(year or year_last), int(month or month_second), int(day or day_first), tzinfo=UTC)
    except ValueError:
        return None
    return (date - _EPOCH).days * float(_DAY_US) + clock_us - offset_us


def _offset_us(zone: str) -> float:
    """Return how far a zone is ahead of UTC."""
    if zone[0] not in "+-":
        return 0.0
    minutes = int(zone[1:3]) * 60 + int(zone[-2:])
    return (-1.0 if zone[0] == "-" else 1.0) * minutes * 60 * _SECOND_US


def seconds_from_stamps(stamps_us: "NDArray[np.float64]") -> "NDArray[np.float64]":
    """Return seconds since the first known stamp; a time of day goes on through midnight."""
    import numpy as np

    known = np.flatnonzero(np.isfinite(stamps_us))
    if not known.size:
        return stamps_us
    stamps = stamps_us[known]
    if stamps.max() < _DAY_US:
        stamps = stamps + _DAY_US * np.cumsum(np.append(0, np.diff(stamps) < -0.5 * _DAY_US))
    seconds = np.full(stamps_us.size, np.nan)
    seconds[known] = (stamps - stamps[0]) / _SECOND_US
    return seconds
