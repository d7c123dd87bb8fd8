"""The priority that each of our processes takes without being asked: what serves the wire before what calculates.

Only where the machine allows it (root, CAP_SYS_NICE or an rlimit), in silence, and modestly: nice values, never a
real-time class, so that a gateway that runs wild cannot take the machine with it; `--realtime` is for those who want that.
Somebody who started the gateway with a positive nice value wanted it behind others, and that is kept.

Each child lowers itself, to a fixed value. Rejected: SCHED_RESET_ON_FORK, which holds for threads too; control's own
threads would fall behind its loop, and a thread that is not let run while it has the interpreter's lock stops the loop.
With autogroup a session's nice value counts only within the session, so the group's own value is set as well.
Standard library only.
"""

import contextlib
import os
import resource
from pathlib import Path
from typing import Final

LOOP_NICE: Final = -10  # guardian and control
RIG_NICE: Final = -8  # a simulated rig stands for a device, which would not wait for anybody
HELPER_NICE: Final = 10  # fit, watch
LAST_NICE: Final = 19  # what nobody waits for
_REALTIME_PRIORITY: Final = 20
_MCL_CURRENT_AND_FUTURE: Final = 3  # sys/mman.h
_AUTOGROUP: Final = Path("/proc/self/autogroup")


def set_nice(nice: int) -> int:
    """Take this nice value, or the nearest one that is allowed; what the process has then."""
    has = os.getpriority(os.PRIO_PROCESS, 0)
    if has > 0 and nice < has:
        return has
    for wanted in (nice, min(has, _lowest_allowed())):
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, 0, wanted)
            break
    _take_group(nice)
    return os.getpriority(os.PRIO_PROCESS, 0)


def lower_priority() -> None:
    """Leave a parent's real-time class and go behind everybody else: for what calculates."""
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    set_nice(HELPER_NICE)


def use_realtime() -> tuple[str, ...]:
    """Run before all ordinary processes and keep the memory in RAM (`run --realtime`): SCHED_FIFO and mlockall.

    Return sentences for the banner about what was not permitted.
    """
    import ctypes  # not for the guardian, which starts in milliseconds

    notes = []
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_REALTIME_PRIORITY))
    except (OSError, AttributeError) as error:
        notes.append(f"realtime: no SCHED_FIFO ({error}); grant the capability sys_nice or an rtprio limit")
    libc = ctypes.CDLL(None, use_errno=True)
    if not hasattr(libc, "mlockall") or libc.mlockall(_MCL_CURRENT_AND_FUTURE) != 0:
        notes.append(f"realtime: no mlockall ({os.strerror(ctypes.get_errno())}); raise the memlock limit")
    return tuple(notes)


def _lowest_allowed() -> int:
    """By the soft limit, which counts down from 20: 25 allows -5."""
    soft, _ = resource.getrlimit(resource.RLIMIT_NICE)
    return -20 if soft == resource.RLIM_INFINITY else max(-20, 20 - soft)


def _take_group(nice: int) -> None:
    """Only in a session of our own: the terminal's group is not ours."""
    if os.getsid(0) == os.getpid():
        with contextlib.suppress(OSError):
            _AUTOGROUP.write_text(str(nice))
