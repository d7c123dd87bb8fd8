"""What every port calls back with, and the clock of its arrival times."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from gateway.ports.errors import PortError

OnBytes = Callable[[bytes, float], None]  # chunk, monotonic time of its arrival
OnLost = Callable[[PortError], None]
OnOpen = Callable[[int], None]  # descriptor


@dataclass(frozen=True, slots=True)
class PortEvents:
    """Callbacks of a serial port: bytes with their time of arrival, the loss of the port, each opening with its descriptor,
    why a lost one that is there again does not open (permission, another program), once, and that another program had set it
    otherwise. on_open may refuse the opening by a PortError: the port is closed again, and tried as any that does not open."""

    on_bytes: OnBytes
    on_lost: OnLost
    on_open: OnOpen
    on_refused: OnLost = lambda refusal: None
    on_restored: OnLost = lambda change: None


WRITE_DEADLINE_S: Final = 0.5
"""Longest time for a write to leave the machine: a setting is a few dozen bytes, some 30 ms at 9600 baud, so a port that
takes longer is blocked (flow control, a dead adapter) and counts as lost."""


CHUNK_BYTES: Final = 512
"""Read at once; what else waits, the loop's next turn reads. Of 4 kB that a driver has kept, crafted ones took 26 ms in the
search for a frame, and a device on USB has no baud rate that would part them."""


def monotonic_s() -> float:
    """Return the time by the clock of every arrival time, s."""
    return time.monotonic()
