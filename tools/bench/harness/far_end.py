"""Both devices of a rig on two ptys, served by a process of its own.

    python tools/bench/harness/far_end.py [--no-cell]

Answers each setting of an output at once, and sends a load cell's readings; no wire, so no time of one.
"""

import contextlib
import json
import os
import pty
import select
import struct
import subprocess
import sys
import time
import tty

NO_CELL = "--no-cell"


class Devices:
    """Both devices in a process of their own, so that nothing here waits for our own interpreter: it answers at once, and
    tells when the first byte of each setting arrived (the monotonic clock is the machine's, so both processes share it).
    has_cell: whether the load cell sends its 100 readings a second.
    """

    def __init__(self, *, has_cell: bool = True) -> None:
        words = [sys.executable, __file__, *([] if has_cell else [NO_CELL])]
        self._process = subprocess.Popen(words, stdout=subprocess.PIPE, bufsize=0)
        assert self._process.stdout
        self._told = self._process.stdout
        self.paths: list[str] = json.loads(self._told.readline())

    def forget(self) -> None:
        """Drop what was told so far."""
        while self._is_told(0.0):
            os.read(self._told.fileno(), 4096)

    def next_setting_s(self, timeout_s: float) -> float | None:
        """Return when the first byte of the next setting arrived, s; None where none comes in time."""
        return struct.unpack("=d", self._told.read(8))[0] if self._is_told(timeout_s) else None

    def _is_told(self, timeout_s: float) -> bool:
        return bool(select.select([self._told], [], [], timeout_s)[0])

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()
        self._told.close()


def serve_far_end(*, has_cell: bool) -> None:
    """Serve both devices until the process is ended: paths as JSON, then eight bytes for each setting."""
    (output, output_end), (cell, cell_end) = pty.openpty(), pty.openpty()
    for end in (output, output_end, cell, cell_end):
        tty.setraw(end)
    for end in (output, cell):
        os.set_blocking(end, False)
    os.write(1, json.dumps([os.ttyname(output_end), os.ttyname(cell_end)]).encode() + b"\n")
    due_s, line, first_s = time.perf_counter(), b"", 0.0
    while True:
        pause_s = max(0.0, due_s - time.perf_counter()) if has_cell else None
        readable, _, _ = select.select([output], [], [], pause_s)
        if readable:
            first_s = first_s if line else time.perf_counter()
            line += os.read(output, 4096)
            while b"\r\n" in line:
                request, line = line.split(b"\r\n", 1)
                word, _, number = request.partition(b" ")
                say(output, (number if word == b"SET" else b"0") + b"\r\n")
                if word == b"SET":
                    os.write(1, struct.pack("=d", first_s))
        if has_cell and time.perf_counter() >= due_s:
            due_s += 0.01
            say(cell, b"ST,GS,+0000.00kg\r\n")


def say(end: int, sentence: bytes) -> None:
    """Put a sentence on a line; lost where nobody reads it, as on a wire: a bare line must not stop us once it is full."""
    with contextlib.suppress(BlockingIOError):
        os.write(end, sentence)


if __name__ == "__main__":
    serve_far_end(has_cell=NO_CELL not in sys.argv)
