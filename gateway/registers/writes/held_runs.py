"""Bits of runs that masters that write in cycles keep at 1: only a master's own 0 lets its next 1 count.

They outlive the process: by a control that was started anew the holder's next cycle would begin another run.
"""

from collections.abc import Callable, Mapping
from typing import Final

_MOST_HOLDERS: Final = 64  # memory stays bounded whoever writes


class HeldRuns:
    """on_change: told of all that is held, by host, whenever that is another."""

    def __init__(self) -> None:
        self.on_change: Callable[[dict[str, int]], None] = lambda held: None
        self._held: dict[str, int] = {}

    def of(self, host: str) -> int:
        """Return the bits that a host keeps at 1."""
        return self._held.get(host, 0)

    def keep(self, host: str, held: int) -> None:
        """Note which bits a host keeps at 1."""
        before = self._held.pop(host, 0)
        if held:
            self._held[host] = held
            if len(self._held) > _MOST_HOLDERS:
                del self._held[next(iter(self._held))]
        if held != before:
            self.on_change(dict(self._held))

    def restore(self, held: Mapping[str, int]) -> None:
        """Go on with what was held in the process before."""
        self._held.update(held)
