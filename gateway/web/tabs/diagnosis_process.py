"""A diagnosis as a process of the page: `python -m gateway.web.tabs.diagnosis_process LINK MODULE WORD...`.

It is `python -m MODULE WORD...` behind everybody else, which tells over the link what it is at, one JSON line each time, and
ends with the link: a page that is cancelled, stopped or killed leaves no search behind.
"""

import contextlib
import json
import os
import runpy
import socket
import sys
import threading
import time
from typing import Final

from gateway import progress
from gateway.processes.scheduling import priority

_TOLD_EVERY_S: Final = 0.1


class ProgressTeller:
    """Tells a link what is reported, a new stage at once and a share of it now and then."""

    def __init__(self, link: socket.socket) -> None:
        self._link = link
        self._stage = ""
        self._told_s = 0.0

    def tell(self, now: progress.Progress) -> None:
        """Send one line. A link that is full is not waited for, the next line says more."""
        time_s = time.monotonic()
        if now.stage == self._stage and time_s - self._told_s < _TOLD_EVERY_S:
            return
        self._stage, self._told_s = now.stage, time_s
        line = json.dumps({"stage": now.stage, "done": now.done, "of": now.of})
        with contextlib.suppress(OSError):
            self._link.send(line.encode() + b"\n", socket.MSG_DONTWAIT)


def end_with(link: socket.socket) -> None:
    """Start a thread that waits for the link's end and takes the process with it, in the middle of whatever it does."""

    def wait() -> None:
        with contextlib.suppress(OSError):
            link.recv(1)
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


def main(arguments: list[str]) -> None:
    """Run a verb. arguments: descriptor of the link, the module, its words."""
    priority.lower_priority()
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, priority.LAST_NICE)
    link = socket.socket(fileno=int(arguments[0]))
    end_with(link)
    progress.hear_everything(ProgressTeller(link).tell)
    sys.argv = ["force-gateway", *arguments[2:]]
    runpy.run_module(arguments[1], run_name="__main__", alter_sys=False)


if __name__ == "__main__":
    main(sys.argv[1:])
