"""The guardian's final safe-voltage write, repeated until the device has acknowledged it.

A dead process may leave half a command behind, so the first safe frame can be swallowed into an unknown command: it is
repeated until the acknowledgement comes, at most three times, and output is never flushed. What the device said before the
frame is dropped: the unread answer to an older question may look like an acknowledgement (a pressure of 0 is `0` too).
A call that fails, as an adapter's may once, ends one try and not the others. Standard library only.
"""

import contextlib
import os
import select
import termios
import time
from dataclasses import dataclass

_REPEATS = 3
_NO_ROOM_S = 0.001  # between two tries to write where none was taken
_MOST_READS = 32  # of what was said before: twice what a terminal keeps, for who talks without end is not waited for
_READ_BYTES = 4096


@dataclass(frozen=True)
class SafeLine:
    """One output port: its descriptor, the frame for the safe voltage and the reply that acknowledges it (may be empty).
    end: of the reply, where lines have one; a Modbus frame has none. hears_itself: control has found that the adapter does."""

    descriptor: int
    frame: bytes
    reply: bytes
    end: bytes
    hears_itself: bool = False

    def close(self) -> None:
        """Close the descriptor."""
        with contextlib.suppress(OSError):
            os.close(self.descriptor)

    def write_safe(self, reply_timeout_s: float = 0.1) -> bool:
        """Put the safe voltage on the wire. True when acknowledged, False when the device is silent or the port gone."""
        for _ in range(_REPEATS):
            with contextlib.suppress(termios.error):  # a program may have stopped it, and its stop outlasts it
                termios.tcflow(self.descriptor, termios.TCOON)
            with contextlib.suppress(OSError):
                _drop_input(self.descriptor)
                _write_all(self.descriptor, self.frame, reply_timeout_s)
                if not self.reply or self._wait_for_acknowledgement(reply_timeout_s):
                    return True
        return False

    def _wait_for_acknowledgement(self, timeout_s: float) -> bool:
        """Return whether the reply came. A line counts as a whole only: the 0 at the end of 510 acknowledges nothing."""
        deadline_s = time.monotonic() + timeout_s
        received = b""
        while (left_s := deadline_s - time.monotonic()) > 0:
            if not _is_ready(self.descriptor, select.POLLIN, left_s):
                return False
            chunk = os.read(self.descriptor, 256)
            if not chunk:
                return False
            received += chunk
            if self._acknowledges(received):
                return True
        return False

    def _acknowledges(self, received: bytes) -> bool:
        """A reply without a line's end (Modbus RTU) may contain one; with its checksum it is whole where it stands. An adapter
        that hears itself puts our own words ahead, on the same line where they end otherwise; to a device that answers by the
        same bytes, the first are ours."""
        if not self.end:
            return self.reply in (received.replace(self.frame, b"", 1) if self.hears_itself else received)
        wanted, behind_echo = self.reply.removesuffix(self.end), received.removeprefix(self.frame)
        return any(wanted in heard.split(self.end)[:-1] for heard in (received, behind_echo))


def _drop_input(descriptor: int) -> None:
    """Drop what can be read; what cannot is no reason to write nothing: a killed process may still have read it away."""
    with contextlib.suppress(OSError):
        for _ in range(_MOST_READS):
            if not (_is_ready(descriptor, select.POLLIN, 0.0) and os.read(descriptor, _READ_BYTES)):
                return


def _write_all(descriptor: int, data: bytes, timeout_s: float) -> None:
    view, deadline_s = memoryview(data), time.monotonic() + timeout_s
    while view:
        left_s = deadline_s - time.monotonic()
        if left_s <= 0.0 or not _is_ready(descriptor, select.POLLOUT, left_s):
            raise OSError("the line does not take bytes")
        sent = 0
        with contextlib.suppress(BlockingIOError):
            sent = os.write(descriptor, view)
        if sent:
            view, deadline_s = view[sent:], time.monotonic() + timeout_s
        else:
            time.sleep(_NO_ROOM_S)


def _is_ready(descriptor: int, event: int, timeout_s: float) -> bool:
    """Wait until it can be read or written, or is no port any more, which the next call finds. By poll: for select a descriptor
    of 1024 and more, as who starts us with a thousand files open makes it, is an error, and the voltage would stand."""
    poll = select.poll()
    poll.register(descriptor, event)
    return bool(poll.poll(timeout_s * 1e3))
