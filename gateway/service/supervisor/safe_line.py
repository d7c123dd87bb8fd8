"""The guardian's final safe-voltage write, repeated until the device has acknowledged it.

A dead process may leave half a command behind, so the first safe frame can be swallowed into an unknown command: it is
repeated until the acknowledgement comes, at most three times, and output is never flushed. What the device said before the
frame is dropped: the unread answer to an older question may look like an acknowledgement (a pressure of 0 is `0` too).
A call that fails, as an adapter's may once, ends one try and not the others. Standard library only.
"""

import contextlib
import os
import re
import select
import termios
import time
from dataclasses import dataclass

REPLY_S = 0.1
_REPEATS = 3
_NO_ROOM_S = 0.001  # between two tries to write where none was taken
_MOST_READS = 32  # of what was said before: twice what a terminal keeps, for who talks without end is not waited for
_READ_BYTES = 4096
_LONGEST_LINE = 128  # that is looked at: who babbles is no reason to look for long


@dataclass(frozen=True)
class SafeLine:
    """One output port: its descriptor, the frame for the safe voltage and the reply that acknowledges it (may be empty).
    end: of the reply, where lines have one; a Modbus frame has none. form: of a reply that may be spelt in other bytes, its end
    left out. reply_timeout_s: what the device may take. hears_itself: control has found that the adapter does."""

    descriptor: int
    frame: bytes
    reply: bytes
    end: bytes
    form: re.Pattern[bytes] | None = None
    reply_timeout_s: float = REPLY_S
    hears_itself: bool = False

    def close(self) -> None:
        """Close the descriptor."""
        with contextlib.suppress(OSError):
            os.close(self.descriptor)

    def write_safe(self, reply_timeout_s: float | None = None) -> bool:
        """Put the safe voltage on the wire. True when acknowledged, False when the device is silent or the port gone.
        reply_timeout_s: None for the line's own."""
        patience_s = self.reply_timeout_s if reply_timeout_s is None else reply_timeout_s
        for _ in range(_REPEATS):
            with contextlib.suppress(termios.error):  # a program may have stopped it, and its stop outlasts it
                termios.tcflow(self.descriptor, termios.TCOON)
            with contextlib.suppress(OSError):
                _drop_input(self.descriptor)
                _write_all(self.descriptor, self.frame, patience_s)
                if not self.reply or self._wait_for_acknowledgement(patience_s):
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
        behind_echo = received.removeprefix(self.frame)
        return any(self._is_reply(line) for heard in (received, behind_echo) for line in heard.split(self.end)[:-1])

    def _is_reply(self, line: bytes) -> bool:
        if line == self.reply.removesuffix(self.end):
            return True
        return bool(self.form and len(line) <= _LONGEST_LINE and self.form.fullmatch(line))


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
