"""Processor time that was kept from us from outside: by the host of a virtual machine (`steal` of /proc/stat, see proc(5)), or
by a CPU quota of our container or service (`throttled_usec` of cpu.stat, see Documentation/admin-guide/cgroup-v2 in the
kernel's sources; `throttled_time` of cgroup v1).

Both give shares, and take the processor away for the rest of 100 ms, as a rule, when the share is used up. In a process's
own counters that does not stand, or in part: one that waits for a timer sleeps, as it seems. Standard library only.
"""

import contextlib
import os
from math import inf, nan
from pathlib import Path
from typing import Final, NamedTuple

from gateway.units import format_ms

_EVERY_S: Final = 1.0
_STEAL: Final = 8  # behind the processor's name, user, nice, system, idle, iowait, irq and softirq
_LINE_BYTES: Final = 256
_UNITS_S: Final = {b"throttled_usec": 1e-6, b"throttled_time": 1e-9}


class _Reading(NamedTuple):
    """stolen_s: of each processor since the machine's start; throttled_s: of each of our groups, in sum over processors."""

    stolen_s: list[float]
    throttled_s: list[float]


def _most(now: list[float], then: list[float]) -> float:
    """Return the most that any of them has grown by; one that was not to be read, nan, has not."""
    return max((after - before for after, before in zip(now, then, strict=False) if after > before), default=0.0)


class WithheldTime:
    """Read once a second, for a large machine needs long to say it. proc, groups: where the kernel says it."""

    def __init__(self, proc: Path = Path("/proc"), groups: Path = Path("/sys/fs/cgroup")) -> None:
        self._stat = proc / "stat"
        self._quotas = _files_of_quotas(proc, groups)
        self._bytes = _LINE_BYTES * (1 + (os.cpu_count() or 1))
        self._ticks_per_s = os.sysconf("SC_CLK_TCK")
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
        stolen_s, throttled_s = _most(now.stolen_s, then.stolen_s), _most(now.throttled_s, then.throttled_s)
        if throttled_s > stolen_s:
            taken = f"the CPU quota of our container or service withheld {format_ms(throttled_s)} of processor time about then"
            return throttled_s, f"{taken} (cpu.max): give it a larger one, or none"
        taken = f"the host of this virtual machine kept a processor away for {format_ms(stolen_s)} about then (steal)"
        return stolen_s, f"{taken}: give the machine processors of its own, or less to do"

    def _read(self) -> _Reading:
        stolen_s = [int(line.split()[_STEAL]) / self._ticks_per_s for line in self._lines_of_processors()]
        return _Reading(stolen_s, [nan if (one := _throttled_s(file)) is None else one for file in self._quotas])

    def _lines_of_processors(self) -> list[bytes]:
        try:
            with self._stat.open("rb", buffering=0) as file:
                lines = file.read(self._bytes).split(b"\n")
        except OSError:
            return []
        processors = (line for line in lines if line[:3] == b"cpu" and line[3:4].isdigit())
        return [line for line in processors if len(words := line.split()) > _STEAL and words[_STEAL].isdigit()]


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
