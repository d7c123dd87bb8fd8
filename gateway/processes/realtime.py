"""Opt-in: let the control process run before ordinary ones and keep its memory in RAM (`run --realtime`)."""

import ctypes
import os

_MCL_CURRENT_AND_FUTURE = 3
_PRIORITY = 20


def use_realtime() -> tuple[str, ...]:
    """SCHED_FIFO and mlockall; sentences for the banner about what was not permitted."""
    notes = []
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    except (OSError, AttributeError) as error:
        notes.append(f"realtime: no SCHED_FIFO ({error}); grant the capability sys_nice or an rtprio limit")
    libc = ctypes.CDLL(None, use_errno=True)
    if not hasattr(libc, "mlockall") or libc.mlockall(_MCL_CURRENT_AND_FUTURE) != 0:
        notes.append(f"realtime: no mlockall ({os.strerror(ctypes.get_errno())}); raise the memlock limit")
    return tuple(notes)
