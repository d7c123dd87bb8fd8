"""What the faces of a drawn scene have for an event loop: sockets are served when it is polled, timers when its clock moves."""

import select
from collections.abc import Callable
from typing import Any

from tests.fieldbus.conftest import HandClock

MOST_TURNS = 5000
Serve = tuple[Callable[..., None], tuple[Any, ...]]


class SocketLoop:
    """errors: what was told to its exception handler."""

    def __init__(self) -> None:
        self.clock = HandClock()
        self.call_later, self.time = self.clock.call_later, self.clock.time
        self.errors: list[Any] = []
        self._soon: list[Serve] = []
        self._readers: dict[int, Serve] = {}
        self._writers: dict[int, Serve] = {}

    def add_reader(self, source: Any, serve: Callable[..., None], *about: Any) -> None:
        self._readers[_descriptor(source)] = serve, about

    def remove_reader(self, source: Any) -> None:
        self._readers.pop(_descriptor(source), None)

    def add_writer(self, source: Any, serve: Callable[..., None], *about: Any) -> None:
        self._writers[_descriptor(source)] = serve, about

    def remove_writer(self, source: Any) -> None:
        self._writers.pop(_descriptor(source), None)

    def call_soon(self, callback: Callable[..., None], *about: Any) -> None:
        self._soon.append((callback, about))

    def call_exception_handler(self, context: dict[str, Any]) -> None:
        self.errors.append(context)

    def poll(self) -> None:
        """Serve the sockets until none has anything."""
        for _ in range(MOST_TURNS):
            soon, self._soon = self._soon, []
            for callback, about in soon:
                callback(*about)
            readable, writable, _ = select.select(list(self._readers), list(self._writers), [], 0)
            ready = [
                one[each] for one, found in ((self._readers, readable), (self._writers, writable)) for each in found
            ]
            for serve, given in ready:
                serve(*given)
            if not ready and not self._soon:
                return
        raise AssertionError("the sockets are never done")


def _descriptor(source: Any) -> int:
    return source if isinstance(source, int) else int(source.fileno())
