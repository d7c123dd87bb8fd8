"""What a port is to those who use it: the serial port, the in-memory pair and the replay are all this."""

import time
from collections.abc import Callable
from typing import Final, Protocol

from gateway.ports.errors import PortError

OnBytes = Callable[[bytes, float], None]  # chunk, monotonic time of its arrival
OnLost = Callable[[PortError], None]
OnOpen = Callable[[int], None]  # descriptor, -1 where there is none

WRITE_DEADLINE_S: Final = 0.5


class Port(Protocol):
    """Bytes in by callbacks with their time of arrival, bytes out by `write`. After a loss it opens again by itself."""

    @property
    def path(self) -> str: ...

    @property
    def is_open(self) -> bool: ...

    async def open(self) -> None:
        """PortError says why it could not be opened; later losses are told by on_lost, and healed with backoff."""

    def write(self, data: bytes) -> bool:
        """Hand over bytes without waiting. False while the port is lost: nothing of before a loss is sent after it."""

    async def drain(self, deadline_s: float = WRITE_DEADLINE_S) -> None:
        """Wait until every byte is on the wire; PortError E111 when that takes longer."""

    async def write_last(self, data: bytes, deadline_s: float = WRITE_DEADLINE_S) -> None:
        """Write and drain: for the safe voltage before the end."""

    def close(self) -> None:
        """The end; bytes already written still go out."""


def monotonic_s() -> float:
    """The clock of every arrival time."""
    return time.monotonic()
