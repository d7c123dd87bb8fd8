"""How much of what a peer has sent waits in its socket."""

import asyncio
import fcntl
import sys
import termios
from math import inf


def count_waiting(transport: asyncio.BaseTransport) -> float:
    """Return the bytes that have come and have not been read; inf where the system does not tell."""
    wire = transport.get_extra_info("socket")
    try:
        return (
            inf
            if wire is None
            else int.from_bytes(fcntl.ioctl(wire.fileno(), termios.FIONREAD, bytes(4)), sys.byteorder)
        )
    except (OSError, ValueError):  # it is closed
        return inf
