"""A flag that the handler of a signal sets and a thread waits for."""

from contextlib import suppress
from queue import Empty, SimpleQueue


class SignalFlag:
    """As threading.Event, without its lock: a handler that runs while its own thread is in `set` waits for that lock without
    an end, and a thread that beats waits behind it. One thread waits, no more."""

    def __init__(self) -> None:
        self._is_set = False
        self._wakes: SimpleQueue[None] = SimpleQueue()  # its `put` may come inside another one

    def set(self) -> None:
        """Set the flag, and wake who waits for it."""
        self._is_set = True
        self._wakes.put(None)

    def is_set(self) -> bool:
        """Return whether it has been set."""
        return self._is_set

    def wait(self, seconds: float) -> bool:
        """Wait until it is set, no longer than this many seconds, and return whether it is."""
        if not self._is_set:
            with suppress(Empty):
                self._wakes.get(timeout=seconds)
        return self._is_set
