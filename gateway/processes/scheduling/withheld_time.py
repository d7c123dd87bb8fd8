"""Processor time that was kept from us from outside: by the host of a virtual machine (`steal` of /proc/stat, see proc(5)), or
by a CPU quota of our container or service (`throttled_usec` of cpu.stat, see Documentation/admin-guide/cgroup-v2 in the
kernel's sources; `throttled_time` of cgroup v1).

Both give shares, and take the processor away for the rest of 100 ms, as a rule, when the share is used up. In a process's
own counters that does not stand, or in part: one that waits for a timer sleeps, as it seems. Standard library only.
"""

import contextlib
import os
from math import inf
from pathlib import Path
from typing import Final, NamedTuple

from gateway.units import format_ms

_EVERY_S: Final = 1.0
_STEAL: Final = 8  # behind the processor's name, user, nice, system, idle, iowait, irq and softirq
_TICKS_PER_S: Final = os.sysconf("SC_CLK_TCK")
_UNITS_S: Final = {b"throttled_usec": 1e-6, b"throttled_time": 1e-9}


def read_stolen_s(stat: Path = Path("/proc/stat")) -> dict[str, float]:
    """Return for how long each processor, by its name, has been away since the machine's start, s; none where nobody counts
    it. One that is offline has no line."""
    stolen_s: dict[str, float] = {}
    with contextlib.suppress(OSError), stat.open("rb") as file:
        for line in file:
            if line[:3] != b"cpu":
                break  # processors stand first, and a large machine has long lines behind them
            words = line.split()
            if line[3:4].isdigit() and len(words) > _STEAL and words[_STEAL].isdigit():
                stolen_s[words[0].decode()] = int(words[_STEAL]) / _TICKS_PER_S
    return stolen_s


def most_growth(now: dict[str, float], then: dict[str, float]) -> float:
    """Return the most that any of them has grown by; one that was not to be read, now or then, has not."""
    return max((after - then[name] for name, after in now.items() if after > then.get(name, after)), default=0.0)


class _Reading(NamedTuple):
    """stolen_s: of each processor since the machine's start; throttled_s: of each of our groups, in sum over processors."""

    stolen_s: dict[str, float]
    throttled_s: dict[str, float]


class WithheldTime:
    """Read once a second, for a large machine needs long to say it. proc, groups: where the kernel says it."""

    def __init__(self, proc: Path = Path("/proc"), groups: Path = Path("/sys/fs/cgroup")) -> None:
        self._stat = proc / "stat"
        self._quotas = _files_of_quotas(proc, groups)
        self._before = self._noted = self._read()
        self._noted_s = -inf

    def note(self, now_s: float) -> None:
        """Note that our process runs now."""
        if now_s - self._noted_s >= _EVERY_S:
            self._noted_s, self._before, self._noted = now_s, self._noted, self._read()

    def lately(self) -> tuple[float, str]:
        """Return how much was withheld within the last second or two, s, and who did it, in words with the cure; 0 where
        nobody counts it. A pause that `note` has just ended is in it."""
        now, then = self._read(), self._before
        stolen_s, throttled_s = most_growth(now.stolen_s, then.stolen_s), most_growth(now.throttled_s, then.throttled_s)
        if throttled_s > stolen_s:
            taken = f"the CPU quota of our container or service withheld {format_ms(throttled_s)} of processor time about then"
            return throttled_s, f"{taken} (cpu.max): give it a larger one, or none"
        taken = f"the host of this virtual machine kept a processor away for {format_ms(stolen_s)} about then (steal)"
        return stolen_s, f"{taken}: give the machine processors of its own, or less to do"

    def _read(self) -> _Reading:
        throttled_s = {str(file): one for file in self._quotas if (one := _throttled_s(file)) is not None}
        return _Reading(read_stolen_s(self._stat), throttled_s)


def _files_of_quotas(proc: Path, groups: Path) -> list[Path]:
    """Return cpu.stat of our own control group and of those it lies in, in either version, as far as they have a quota's."""
    try:
        lines = (proc / "self" / "cgroup").read_text(errors="surrogateescape").splitlines()
    except OSError:
        return []
    found: list[Path] = []
    for _, controllers, path in (line.split(":", 2) for line in lines if line.count(":") >= 2):
        if controllers and "cpu" not in controllers.split(","):
            continue
        base = groups / "cpu" if controllers else groups
        own = base / path.lstrip("/")
        found += [place / "cpu.stat" for place in (own, *own.parents) if place.is_relative_to(base)]
    return [file for file in found if _throttled_s(file) is not None]


def _throttled_s(file: Path) -> float | None:
    with contextlib.suppress(OSError, ValueError):
        for line in file.read_bytes().splitlines():
            name, _, number = line.partition(b" ")
            if name in _UNITS_S:
                return int(number) * _UNITS_S[name]
    return None
