"""A process that raises committing children to be killed: modules are imported once, a child costs a fork.

Lines in: `STATE MARK` starts a child that commits MARK, MARK + 1, ... for ever; `STATE MARK N` one that kills itself at
the N-th call of a single commit to the disk, and in the middle of it where that call is a write. Lines out: `child PID`,
then `MARK` for each commit that has returned, at last `gone`.
"""

import os
import signal
import sys
from itertools import count
from pathlib import Path

from gateway.calibrations.store import CalibrationStore
from tests.calibrations.coefficients import calibration
from tests.calibrations.failing_disk import Disk, disk


def say(text: object) -> None:
    os.write(1, f"{text}\n".encode())


def commit(store: CalibrationStore, mark: int) -> None:
    store.use(store.add(calibration(mark)), mark % 8)
    say(mark)


class DeadlyDisk(Disk):
    """The n-th call is the last thing that this process does; of a write, half."""

    def count(self, what: str, name: str) -> None:
        self.calls.append((what, name))
        if len(self.calls) == self._fail_at and what != "write":
            os.kill(os.getpid(), signal.SIGKILL)
        if len(self.calls) == self._fail_at + 1:
            os.kill(os.getpid(), signal.SIGKILL)  # a half write has come back: nothing more happens


def child(state: Path, mark: int, n: int | None) -> None:
    store = CalibrationStore(state)
    if n is not None:
        with disk(n, kind=DeadlyDisk):
            commit(store, mark)
        return
    for each in count(mark):
        commit(store, each)


def main() -> None:
    for line in sys.stdin:
        state, mark, *n = line.split()
        pid = os.fork()
        if pid == 0:
            say(f"child {os.getpid()}")  # itself: said by its parent it could come behind a commit
            child(Path(state), int(mark), int(n[0]) if n else None)
            os._exit(0)
        os.waitpid(pid, 0)
        say("gone")


if __name__ == "__main__":
    main()
