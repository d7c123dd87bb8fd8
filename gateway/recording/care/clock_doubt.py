"""Whether the clock can tell how old recordings are.

One that is years ahead would have them all deleted at once, one that nobody has set would keep them for ever; neither can be
told from a long rest with certainty, and so it is said. What has ended a moment ago is no witness: it has its time from the
clock that is doubted. One that leaps ahead while we look, by less than recordings are retained, makes some too old and not all:
that is told by the monotonic clock.
"""

import contextlib
from collections.abc import Sequence
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import Final, NamedTuple

from gateway.recording.care.keeping import CLOCK_SET_S

_DAY_S: Final = 86400.0
_LAST_S: Final = 253_402_214_400.0  # 9999-12-31
_CURE: Final = "`date` shows the clock, `sudo timedatectl set-ntp true` has it set"


class ClockDoubt(StrEnum):
    """What the clock cannot be believed for."""

    NONE = "none"
    UNSET = "unset"
    BEHIND = "behind"
    AHEAD = "ahead"
    LEAPT = "leapt"


class Doubt(NamedTuple):
    """kind, and the sentence with its code, empty for none."""

    kind: ClockDoubt
    sentence: str = ""


def doubt_clock(paths: Sequence[Path], days: float, now_s: float) -> Doubt:
    """Return what is odd about the clock beside the ends of these recordings. days: how long they are retained; now_s: of the
    epoch."""
    if now_s < CLOCK_SET_S:
        sentence = f"nobody has set this machine's clock ({_date(now_s)}): no recording goes for its age until it is"
        return Doubt(ClockDoubt.UNSET, f"W252 {sentence}; {_CURE}")
    ends = _ended(paths)
    ended_s, name = max(ends, default=(now_s, ""))
    if ended_s > now_s + _DAY_S:
        clocks = f"recording {name} ended on {_date(ended_s)}, and now this machine's clock says {_date(now_s)}"
        cure = f"{_CURE}, recordings delete N removes one"
        sentence = f"{clocks}: it is behind, or was ahead then. Such recordings do not go for their age; {cure}"
        return Doubt(ClockDoubt.BEHIND, f"W252 {sentence}")
    fresh_s = _fresh_s(days)
    ended_s, name = max((end for end in ends if end[0] < now_s - fresh_s), default=(now_s, ""))
    if CLOCK_SET_S <= ended_s < now_s - days * _DAY_S:
        which = f"recordings of more than {'a day' if fresh_s == _DAY_S else f'{fresh_s / 3600.0:g} h'} ago"
        oldest = f"all {which} are older than {days:g} days, the newest of them, {name}, is of {_date(ended_s)}"
        cure = f"If the clock is ahead, set it within a day: so long none goes for its age; {_CURE}"
        return Doubt(ClockDoubt.AHEAD, f"W252 by this machine's clock ({_date(now_s)}) {oldest}. {cure}")
    return Doubt(ClockDoubt.NONE)


def doubt_leap(ahead_s: float, days: float, now_s: float) -> Doubt:
    """Return what is odd about a clock that has gained ahead_s on the monotonic one. days: how long recordings are retained;
    now_s: of the epoch."""
    if ahead_s <= _fresh_s(days):
        return Doubt(ClockDoubt.NONE)
    leap = f"this machine's clock has leapt ahead by {ahead_s / _DAY_S:.1f} days, to {_date(now_s)}"
    return Doubt(
        ClockDoubt.LEAPT, f"W252 {leap}: no recording goes for its age for a day, so that it can be set; {_CURE}"
    )


def _fresh_s(days: float) -> float:
    """Return what a clock may be off by without a doubt."""
    return min(_DAY_S, 0.5 * days * _DAY_S)


def _ended(paths: Sequence[Path]) -> list[tuple[float, str]]:
    """When each was written last; what cannot be asked tells nothing."""
    ends = []
    for path in paths:
        with contextlib.suppress(OSError):
            ends.append((path.stat().st_mtime, path.name))
    return ends


def _date(time_s: float) -> str:
    """Of what a calendar has: a file may be of the year 60000."""
    return f"{datetime.fromtimestamp(min(max(time_s, 0.0), _LAST_S), UTC):%Y-%m-%d}"
