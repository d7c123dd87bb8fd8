"""For how long this machine has stood still, measured beside the tests: a process that does nothing but sleep 20 ms at a time
notes by how much it has come late.

What a host takes from a virtual machine the kernel counts only where the host tells it (`steal`), and a container's quota, a
snapshot or a disk that holds all up is nowhere in that. Who asks for next to nothing of a processor and is kept waiting for
50 ms is kept waiting by the machine; a gateway under test that blocks its own loop does not make it late.
"""

import mmap
import os
import struct
import subprocess
import sys
import time

LOOK_S = 0.02
LATE_S = 0.05
"""What is shorter breaks no bound of a test, and a busy processor may make anybody wait for it."""
_NOTE = struct.Struct("dd")  # lost, and when it last looked


class StandstillWitness:
    """Begun before the workers are forked, which share what it notes. It ends with the process that has begun it."""

    def __init__(self) -> None:
        descriptor = os.memfd_create("standstill")
        os.ftruncate(descriptor, _NOTE.size)
        self._note = mmap.mmap(descriptor, _NOTE.size)
        words = [sys.executable, "-I", "-S", __file__, str(descriptor), str(os.getpid())]
        # a session of its own: Ctrl-C in a terminal is for who runs the tests
        self.process = subprocess.Popen(words, pass_fds=[descriptor], start_new_session=True)
        os.close(descriptor)

    def settle(self) -> None:
        """Wait until it has looked after now: behind a standstill it may wake behind us. At most a second, if it has ended."""
        now_s = time.monotonic()
        while _NOTE.unpack_from(self._note)[1] < now_s and time.monotonic() < now_s + 1.0:
            time.sleep(LOOK_S)

    def lost_s(self) -> float:
        """Return for how long the machine has stood still since the beginning, s: pauses of LATE_S and longer."""
        return float(_NOTE.unpack_from(self._note)[0])

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        self._note.close()


def _watch(descriptor: int, parent: int) -> None:
    note, lost_s = mmap.mmap(descriptor, _NOTE.size), 0.0
    woke_s = time.monotonic()
    while os.getppid() == parent:
        time.sleep(LOOK_S)
        before_s, woke_s = woke_s, time.monotonic()
        if (late_s := woke_s - before_s - LOOK_S) >= LATE_S:
            lost_s += late_s
        _NOTE.pack_into(note, 0, lost_s, woke_s)


if __name__ == "__main__":
    _watch(*map(int, sys.argv[1:]))
