"""Starting, watching and ending the guardian's children. Standard library only."""

import contextlib
import json
import os
import select
import signal
import socket
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gateway.service import link as guardian_link

_END_BOUND_S = 1.0


@dataclass
class Child:
    """A child process: `died` is its pidfd (readable once it is gone); `link` is our end of its line."""

    process: subprocess.Popen[bytes]
    link: socket.socket
    died: int

    @property
    def pid(self) -> int:
        return self.process.pid

    def first_line(self, timeout_s: float = 30.0) -> str:
        """What the child says first on its link; empty when it died or stayed silent."""
        deadline_s = time.monotonic() + timeout_s
        readable, _, _ = select.select([self.link], [], [], max(0.0, deadline_s - time.monotonic()))
        return self.link.recv(65536).decode() if readable else ""

    def kill(self) -> None:
        with contextlib.suppress(ProcessLookupError):
            self.process.kill()

    def wait(self) -> int:
        return self.process.wait()

    def end(self) -> None:
        """Ask, then insist; leaves nothing behind."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(_END_BOUND_S)
            except subprocess.TimeoutExpired:
                self.kill()
                self.process.wait()
        self.close()

    def close(self) -> None:
        self.link.close()
        if self.died >= 0:
            os.close(self.died)
            self.died = -1


def _spawn(module: str, arguments: dict[str, Any], *shared: int | None) -> Child:
    """A session of its own: the terminal's Ctrl-C reaches the guardian alone. shared: descriptors that it inherits."""
    ours, theirs = guardian_link.pair()
    command = [sys.executable, "-m", module, str(theirs.fileno()), json.dumps(arguments)]
    passed = (theirs.fileno(), *(descriptor for descriptor in shared if descriptor is not None))
    with theirs:
        process = subprocess.Popen(command, pass_fds=passed, stdin=subprocess.DEVNULL, start_new_session=True)
    return Child(process, ours, os.pidfd_open(process.pid))


def spawn_control(arguments: dict[str, Any]) -> Child:
    return _spawn("gateway.service.control_process", arguments, arguments["ring"])


def spawn_rig(rig: str, state: Path) -> Child:
    """The simulated rig outlives a kill of control, as a real rig does; it ends when its link does."""
    return _spawn("gateway.service.simulated_rig", {"rig": rig, "state": str(state)})


def spawn_watch(arguments: dict[str, Any]) -> Child:
    """The residual watch: what it finds it tells control, through the control socket."""
    return _spawn("gateway.service.watch_process", arguments, arguments["ring"])


def shared_memory() -> int | None:
    """Memory without a name and without a disk, for the sample ring; None where the kernel has none to give."""
    try:
        return os.memfd_create("force-gateway-samples")
    except (OSError, AttributeError):
        return None
