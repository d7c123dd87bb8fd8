"""A pty pair in raw mode: a serial line without hardware. Our side is the master; the client opens `path`.

The slave side is kept open here too: without that the master reads EIO whenever no client has the line open, and a client's
settings would be forgotten at its close.
"""

import contextlib
import fcntl
import os
import pty
import struct
import termios
import tty
from typing import Final

_TCGETS2: Final = 0x802C542A  # linux/termbits.h: the only call that tells an unusual speed
_TERMIOS2: Final = struct.Struct("4IB19s2I")


class Pty:
    """Opened when made; `close` is an unplug for the client."""

    def __init__(self) -> None:
        self.fd, self._slave = pty.openpty()
        self.path = os.ttyname(self._slave)
        tty.setraw(self._slave)
        os.set_blocking(self.fd, False)

    def client_baud(self) -> int:
        """The speed that the client has set, bits per second: a pty's master sees it."""
        *_, speed = _TERMIOS2.unpack(fcntl.ioctl(self.fd, _TCGETS2, bytes(_TERMIOS2.size)))
        return int(speed)

    def set_client_baud(self, baud: int) -> None:
        """The speed that a client gets that sets none. Only the speeds of termios."""
        attributes = termios.tcgetattr(self._slave)
        attributes[4] = attributes[5] = getattr(termios, f"B{baud}")
        termios.tcsetattr(self._slave, termios.TCSANOW, attributes)

    def close(self) -> None:
        """Pull the plug: a client reads a hang-up."""
        for descriptor in (self._slave, self.fd):
            if descriptor >= 0:
                with contextlib.suppress(OSError):
                    os.close(descriptor)
        self.fd = self._slave = -1
