"""Was a silent process not let run, or did it not want to? What the kernel counts for it, read from /proc.

schedstat has two sums in nanoseconds: time on a processor, and time runnable but waiting for one. The wait that still
lasts is in neither; it is added when the process gets its turn, if only to be killed, so a silence is judged from the
zombie, before it is reaped. Only the main thread counts: it is the control loop. Standard library only.
"""

import contextlib
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

from gateway.codes.explanation import BUSY_CURE, is_cause
from gateway.processes.exit_cause import EndCause, Ending
from gateway.units import format_ms

STOPPED_STATES: Final = "Tt"
_OR_LONGER: Final = ", or a longer stall_s in the rig"
_CURE: Final = f": {BUSY_CURE}{_OR_LONGER}"


class ProcessorTime(NamedTuple):
    """Processor time of a process until now, in seconds."""

    on_cpu_s: float = 0.0
    waited_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Silence:
    """One silence of the control loop."""

    silent_s: float
    bound_s: float
    used: ProcessorTime | None  # processor time in it; None: not known
    state: str  # the kernel's letter before the kill; empty where it is not known
    was_late: bool  # the guardian, which does nothing but watch, was not let run in time either
    withheld: tuple[float, str] = 0.0, ""  # seconds kept from it from outside about then; by whom


class SchedulerCounters:
    """Reads one process's counters. A kernel without them, or a process that is gone, gives None."""

    def __init__(self, pid: int, proc: Path = Path("/proc")) -> None:
        self._stat = proc / str(pid) / "stat"
        self._descriptor = -1
        with contextlib.suppress(OSError):
            self._descriptor = os.open(proc / str(pid) / "schedstat", os.O_RDONLY | os.O_CLOEXEC)

    def read(self) -> ProcessorTime | None:
        """Return the processor time used and waited for. 1.5 us: cheap enough for every heartbeat."""
        try:
            on_cpu_ns, waited_ns = os.pread(self._descriptor, 64, 0).split()[:2]
        except (OSError, ValueError):
            return None
        return ProcessorTime(int(on_cpu_ns) * 1e-9, int(waited_ns) * 1e-9)

    def waited_s(self) -> float | None:
        """Return for how long it has waited for a processor, s; None where the kernel does not count that."""
        turns = self.read()
        return turns.waited_s if turns else None

    def state(self) -> str:
        """Return the state letter, R, S, D, T, ...: it stands behind the name, which may hold brackets itself."""
        try:
            return self._stat.read_text().rpartition(")")[2].split()[0]
        except (OSError, IndexError):
            return ""

    def close(self) -> None:
        """Close the descriptor."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1


def waited_s_of(time: ProcessorTime | None) -> float | None:
    """Return how long a processor was waited for, s; None where the kernel does not count that."""
    return time.waited_s if time else None


def time_between(before: ProcessorTime | None, now: ProcessorTime | None) -> ProcessorTime | None:
    """Return what a process had between two readings, s; None where one of them is missing."""
    if before is None or now is None:
        return None
    return ProcessorTime(now.on_cpu_s - before.on_cpu_s, now.waited_s - before.waited_s)


def explain_silence(silence: Silence, load: str) -> Ending:
    """Return the cause of a silence: what took the largest part of it. load: of the machine, in words."""
    allowed = f"allowed {format_ms(silence.bound_s)} (stall_s)"
    observation = f"control process stalled: {format_ms(silence.silent_s)} without a tick, {allowed}"
    if silence.state and silence.state in STOPPED_STATES:
        return Ending(EndCause.STOPPED, f"{observation}; it was stopped by a signal or a debugger")
    withheld_s, by_whom = silence.withheld
    if is_cause(withheld_s, silence.silent_s):
        return Ending(EndCause.MACHINE_BUSY, f"{observation}; {load}; {by_whom}{_OR_LONGER}")
    if silence.used is None:
        cause = EndCause.MACHINE_BUSY if silence.was_late else EndCause.STALLED
        return Ending(
            cause, f"{observation}; this kernel does not count why; {load}{_CURE if silence.was_late else ''}"
        )
    ran_s, waited_s = silence.used.on_cpu_s, silence.used.waited_s
    slept_s = max(0.0, silence.silent_s - ran_s - waited_s)
    parts = f"it waited {format_ms(waited_s)} for a processor, ran {format_ms(ran_s)} and slept {format_ms(slept_s)}; {load}"
    if waited_s >= max(ran_s, slept_s):
        return Ending(EndCause.MACHINE_BUSY, f"{observation}; {parts}{_CURE}")
    return Ending(EndCause.STALLED, f"{observation}; {parts}: {_what_else(silence, slept_s)}")


def _what_else(silence: Silence, slept_s: float) -> str:
    """What it may have been, where waiting for a processor was not: nobody counts a machine that stands still as a whole."""
    if silence.state == "D":
        return "not the machine's load, in the kernel, for a disk or a driver"
    withheld_s, by_whom = silence.withheld
    if not is_cause(slept_s, silence.silent_s) or not (silence.was_late or withheld_s > 0.0):
        return "not the machine's load"
    doubt = (
        by_whom
        if withheld_s > 0.0
        else "the guardian came late, too: a virtual machine on a busy host, a CPU in deep sleep"
    )
    return f"perhaps the machine stood still: {doubt}"


def load_of_machine(proc: Path = Path("/proc")) -> str:
    """Return how busy the machine is, as far as the kernel says.
    `load 8.4 on 2 cores, 62 % of the time somebody waited for a processor (10 s)`"""
    words = []
    with contextlib.suppress(OSError, IndexError):
        words.append(f"load {(proc / 'loadavg').read_text().split()[0]} on {_cores()} cores")
    with contextlib.suppress(OSError, IndexError, ValueError):
        some = (proc / "pressure" / "cpu").read_text().split()[1]
        words.append(f"pressure {float(some.removeprefix('avg10=')):.0f} %")
    return ", ".join(words) or "the load is not known"


def _cores() -> int:
    """Return the number of cores that we may use."""
    try:
        return len(os.sched_getaffinity(0))
    except (OSError, AttributeError):
        return os.cpu_count() or 1
