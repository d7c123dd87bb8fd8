"""Starts the fit of a recorded ladder as a process of its own and hears its one-line result.

Control never waits for it: the child is forked (a millisecond or two, with the output off), its pipe is read when it
speaks, and it goes on to its end should control die meanwhile. It sets its own priority down
(gateway.service.fitting.fit_process). One that hangs (its disk does, say) is killed in the end: until it has ended no other
run may begin.
"""

import asyncio
import contextlib
import json
import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gateway.processes.module_command import module_command, start_program

Result = dict[str, Any]
_LONGEST = 1 << 16
_REAP_S = 0.1
LONGEST_S = 1800.0  # a ladder is fitted in seconds, on a small machine that is busy in minutes


class FitLauncher:
    """on_result gets {"stored": number, ...} or {"refused": sentence}; exactly once. pid: of its process; is_reaped: nothing is
    left of that."""

    def __init__(self, recording: Path, rig_file: Path, state: Path, on_result: Callable[[Result], None]) -> None:
        arguments = json.dumps({"recording": str(recording), "rig": str(rig_file), "state": str(state)})
        command = [*module_command("gateway.service.fitting.fit_process"), arguments]
        self._descriptor, output = os.pipe()
        try:
            self.pid = start_program(command, output=output)
        except OSError:
            os.close(self._descriptor)
            raise
        finally:
            os.close(output)
        os.set_blocking(self._descriptor, False)
        self._output, self._is_given_up, self.is_reaped = b"", False, False
        self._on_result = on_result
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(self._descriptor, self._read)
        self._patience = self._loop.call_later(LONGEST_S, self._give_up)

    def _give_up(self) -> None:
        """What it has started goes with it, and the pipe's end tells."""
        self._is_given_up = True
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.pid, signal.SIGKILL)

    def _read(self) -> None:
        try:
            chunk = os.read(self._descriptor, _LONGEST)
        except BlockingIOError:
            return
        if chunk:
            self._output += chunk
            return
        self._forget()
        self._reap()
        self._on_result(self._result())

    def _reap(self) -> None:
        """The pipe's end comes a moment before the process's: no waiting for it, and no zombie either."""
        with contextlib.suppress(ChildProcessError):
            if os.waitpid(self.pid, os.WNOHANG) == (0, 0):
                self._loop.call_later(_REAP_S, self._reap)
                return
        self.is_reaped = True

    def _result(self) -> Result:
        try:
            result: Result = json.loads(self._output)
        except ValueError:
            how = f"was killed after {LONGEST_S / 60.0:g} minutes" if self._is_given_up else "ended"
            return {"refused": f"A331 the fit process {how} without a result; force-gateway fit RECORDING shows why"}
        return result

    def close(self) -> None:
        """Stop listening. The child is not ended: what it stores is of use whoever listens."""
        self._forget()

    def _forget(self) -> None:
        self._patience.cancel()
        if self._descriptor >= 0:
            self._loop.remove_reader(self._descriptor)
            os.close(self._descriptor)
            self._descriptor = -1
