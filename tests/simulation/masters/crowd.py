"""Many who connect and say nothing, or half of a request: those who are connected they keep from nothing. Others they keep out:
as many addresses as there are places have these by right, each its only one, for a minute."""

from collections.abc import Callable

from tests.simulation.kernel.network import Caller, Line
from tests.simulation.kernel.virtual_time import VirtualLoop
from tests.simulation.masters.spelling import read_pdu

_REQUEST = b"\x00\x07\x00\x00\x00\x06\x01" + read_pdu(100, 10)


class Crowd:
    """Who came stays, until the other end closes, or all leave."""

    def __init__(self, outside: VirtualLoop, inside: Callable[[], VirtualLoop | None]) -> None:
        self._outside, self._inside, self._port = outside, inside, 0
        self._lines: list[tuple[VirtualLoop, Line]] = []

    def connect(self, count: int, hosts: int, said: int) -> None:
        """Connect so often, from so many addresses; said: bytes of a request that each of them sends."""
        inside = self._inside()
        for number in range(count if inside is not None and inside.servers else 0):
            self._port += 1
            caller = Caller(f"10.0.1.{1 + number % hosts}", 20000 + self._port)
            assert inside is not None
            line = Line(inside, self._outside, caller, lambda data: None)
            self._lines.append((inside, line))
            if said:
                line.send(_REQUEST[:said])

    def leave(self) -> None:
        """Hang up."""
        for inside, line in self._lines:
            if inside is self._inside():  # else it has died with the process at the other end
                line.close()
        self._lines.clear()
