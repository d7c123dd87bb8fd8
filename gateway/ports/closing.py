"""Closing a port whose driver still has bytes, beside the loop.

Whoever closes a serial port last waits for these bytes, by Linux' own default for 30 s: an adapter that has stopped taking any,
and is not unplugged, would hold a control loop for so long, and the force that another line and another master keep.
"""

import contextlib
import fcntl
import os
import struct
import termios
from functools import partial

from gateway.ports.errors import SERIAL_FAILURES
from gateway.processes.disk_worker import DiskWorker


def queued_bytes(descriptor: int) -> int:
    """Return the number of bytes in the driver's output queue."""
    (count,) = struct.unpack("i", fcntl.ioctl(descriptor, termios.TIOCOUTQ, bytes(4)))
    return int(count)


class Closing:
    """Of one port. is_pending: its driver has not let go yet, and who opens it again would wait in its place."""

    def __init__(self) -> None:
        self.is_pending = False

    def close(self, descriptor: int) -> None:
        """Close it, in a thread where it may take long. Called in the loop."""
        queued = 0
        with contextlib.suppress(*SERIAL_FAILURES):  # of one that is gone nothing is waited for
            queued = queued_bytes(descriptor)
        if not queued:
            _close(descriptor)
            return
        self.is_pending, closer = True, DiskWorker()
        closer(partial(_close, descriptor), partial(self._on_closed, descriptor))
        closer.close()

    def _on_closed(self, descriptor: int, failure: object) -> None:
        self.is_pending = False
        if failure is not None:  # there was no thread to be had
            _close(descriptor)


def _close(descriptor: int) -> None:
    with contextlib.suppress(OSError):
        os.close(descriptor)
