"""Is a pty still the one that it was? Its number says nothing about that: it is given anew as soon as both ends are closed.

So a port that has lost a simulated rig's pty must not look for it under its number. It once did, and a gateway whose
simulated rig had died took the output port of another gateway, whose control process was being started again, and kept it.

The kernel tells: a descriptor that only names the pty (O_PATH, which opens no line and holds no lock) keeps its directory
entry, and that has no link left once the device's end is closed. Devices and links by name (/dev/serial/by-id) are meant to
be found again, and are never gone here; so are the ptys that a rig file names, for nobody else will say where they are. Off
Linux there is no O_PATH, and nothing is told.
"""

import contextlib
import os
from typing import Final

_PTY_NUMBERS: Final = "/dev/pts/"
_NAME_ONLY: Final[int] = getattr(os, "O_PATH", 0)


class PtyIdentity:
    """Identity of the pty that a path leads to now; `take` and `release` as often as wanted."""

    def __init__(self, *, is_kept: bool) -> None:
        self._is_kept = is_kept
        self._descriptor = -1

    def take(self, path: str) -> None:
        """Remember this one. What is not there yet, or has a lasting name, is not remembered."""
        self.release()
        if self._is_kept and _NAME_ONLY and path.startswith(_PTY_NUMBERS):
            with contextlib.suppress(OSError):
                self._descriptor = os.open(path, _NAME_ONLY | os.O_CLOEXEC)

    @property
    def is_gone(self) -> bool:
        """Decide whether the pty that was remembered has lost its device: another one has its number now."""
        return self._descriptor >= 0 and os.fstat(self._descriptor).st_nlink == 0

    def release(self) -> None:
        """Release the pseudo-terminal."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1
