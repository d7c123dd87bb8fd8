"""A device was not heard in time: was it silent, or did the machine not let us hear it?

What is late is late, and the force goes; only the cause that is told differs. Where at least half of the silence was ours (or
of the process behind a simulated rig), no wire is to blame. It is MACHINE_BUSY where the kernel counts so much waiting for a
processor; else the fault of the line, with what was seen. A machine that stands still as a whole (a virtual one on a busy
host) counts nothing.

Bounds: Supervision.sample_timeout_s and output_timeout_s in control/settings.py.
"""

from dataclasses import dataclass
from typing import Final

from gateway.codes.explanation import BUSY_CURE, is_cause
from gateway.codes.faults import FaultCode
from gateway.units import format_ms

_WORTH_TELLING_S: Final = 1e-3


@dataclass(frozen=True, slots=True)
class Held:
    """What kept processes from running since a device was last heard, in seconds.

    loop_late_s: how late our own loop came, in sum; loop_waited_s: so much of it waiting for a processor, None where the
    machine does not count that; withheld: processor time that was kept from us from outside about then, and by whom, in
    words. Of the process behind a simulated rig, 0 for a real one: rig_waited_s: runnable, and not let; rig_stopped_s: held
    by a signal or a debugger.
    """

    loop_late_s: float = 0.0
    loop_waited_s: float | None = None
    rig_waited_s: float = 0.0
    rig_stopped_s: float = 0.0
    withheld: tuple[float, str] = 0.0, ""


NOT_HELD: Final = Held()


def cause_of_silence(fault: FaultCode, silent_s: float, held: Held, suspects: str) -> tuple[FaultCode, str]:
    """Return the fault and what is to blame, in words. suspects: what it is where the machine did let us run; nan s: never
    heard."""
    waited_s = held.loop_waited_s
    ours = f"our own loop came {format_ms(held.loop_late_s)} late in that time"
    if is_cause(held.rig_stopped_s, silent_s):
        return (
            fault,
            f"the simulated rig's process was stopped for {format_ms(held.rig_stopped_s)} of them (a signal, a debugger)",
        )
    if is_cause(held.rig_waited_s, silent_s):
        evidence = f"the simulated rig's process waited {format_ms(held.rig_waited_s)} of them for a processor"
        return FaultCode.MACHINE_BUSY, f"{evidence}: {cure_for_waiting(held, held.rig_waited_s)}"
    if not is_cause(held.loop_late_s, silent_s):
        return fault, f"{ours}: {suspects}" if held.loop_late_s >= _WORTH_TELLING_S and suspects else suspects
    if waited_s is not None and is_cause(waited_s, held.loop_late_s):
        return (
            FaultCode.MACHINE_BUSY,
            f"{ours}, {format_ms(waited_s)} of them waiting for a processor: {cure_for_waiting(held, waited_s)}",
        )
    if is_cause(held.withheld[0], held.loop_late_s):
        return FaultCode.MACHINE_BUSY, f"{ours}: {held.withheld[1]}"
    count_words = (
        "not counted why" if waited_s is None else f"only {format_ms(waited_s)} of them waiting for a processor"
    )
    return (
        fault,
        f"{ours}, {count_words}: this machine stood still (a virtual one on a busy host, a stop), not the device",
    )


def cure_for_waiting(held: Held, part_s: float) -> str:
    """Return what to do against that part of a silence, s: where time was withheld from outside no program here is to blame."""
    withheld_s, by_whom = held.withheld
    return by_whom if is_cause(withheld_s, part_s) else BUSY_CURE
