"""What every process beside control does first: go behind whatever serves the wire, and end with the guardian.

Standard library only.
"""

import contextlib
import os
import socket
import threading
from pathlib import Path
from typing import Final

from gateway.processes import priority

_FIRST_AMONG_THE_KILLED: Final = "900"
_LAST_NICE: Final = 19


def serve_behind_control() -> None:
    """Give way to control, and be the first to go when memory runs out; use one thread for the mathematics. For what people
    or machines wait for."""
    priority.lower_priority()
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(_FIRST_AMONG_THE_KILLED)
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"


def yield_to_others() -> None:
    """Give way to everybody, in processor time and memory: for what nobody waits for."""
    serve_behind_control()
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, _LAST_NICE)  # where the idle class is refused
    with contextlib.suppress(OSError, AttributeError):  # takes the idle class of the disk with it, see ioprio_set(2)
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))


def exit_with_guardian(link: socket.socket) -> None:
    """Start a thread that waits for the guardian's end and takes the process with it, in the middle of whatever it does."""

    def wait() -> None:
        with contextlib.suppress(OSError):
            link.recv(1)
        os._exit(0)

    threading.Thread(target=wait, daemon=True).start()
