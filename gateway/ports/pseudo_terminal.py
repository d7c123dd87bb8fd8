"""A pty pair in raw mode: a serial line without hardware. Our side is the master; the client opens `path`.

The slave side is kept open here too: without that the master reads EIO whenever no client has the line open, and a client's
settings would be forgotten at its close.
"""

import contextlib
import fcntl
import os
import struct
import tty
from typing import Final

_TCGETS2: Final = 0x802C542A  # linux/termbits.h: the only call that tells an unusual speed
_TCSETS2: Final = 0x402C542B
_CBAUD, _BOTHER = 0x100F, 0x1000  # the mask of the usual speeds in c_cflag, and the word for any other
_TERMIOS2: Final = struct.Struct("4IB19s2I")


class Pty:
    """Opened when made; `close` is an unplug for the client."""

    def __init__(self) -> None:
        self.fd, self._slave = os.openpty()  # that of `pty` hides the kernel's reason
        self.path = os.ttyname(self._slave)
        tty.setraw(self._slave)
        os.set_blocking(self.fd, False)

    def client_baud(self) -> int:
        """Return the speed that the client has set, bits per second: a pty's master sees it."""
        *_, speed = _TERMIOS2.unpack(fcntl.ioctl(self.fd, _TCGETS2, bytes(_TERMIOS2.size)))
        return int(speed)

    def set_client_baud(self, baud: int) -> None:
        """Set the speed that a client gets that sets none; any speed, for termios knows the usual ones only."""
        *flags, line, control, _, _ = _TERMIOS2.unpack(fcntl.ioctl(self._slave, _TCGETS2, bytes(_TERMIOS2.size)))
        flags[2] = flags[2] & ~_CBAUD | _BOTHER
        fcntl.ioctl(self._slave, _TCSETS2, _TERMIOS2.pack(*flags, line, control, baud, baud))

    def close(self) -> None:
        """Pull the plug: a client reads a hang-up."""
        for descriptor in (self._slave, self.fd):
            if descriptor >= 0:
                with contextlib.suppress(OSError):
                    os.close(descriptor)
        self.fd = self._slave = -1
