"""Bits of runs that masters that write in cycles keep at 1: only a master's own 0 lets its next 1 count.

They outlive the process: by a control that was started anew the holder's next cycle would begin another run.
"""

from collections.abc import Callable, Mapping
from typing import Final

_MOST_HOLDERS: Final = 64  # memory stays bounded whoever writes


class HeldRuns:
    """by_host: the bits of each host that keeps any; on_change: told of all of them whenever they are others."""

    def __init__(self) -> None:
        self.on_change: Callable[[dict[str, int]], None] = lambda held: None
        self.by_host: dict[str, int] = {}

    def of(self, host: str) -> int:
        """Return the bits that a host keeps at 1."""
        return self.by_host.get(host, 0)

    def keep(self, host: str, held: int) -> None:
        """Note which bits a host keeps at 1."""
        before = self.by_host.pop(host, 0)
        if held:
            self.by_host[host] = held
            if len(self.by_host) > _MOST_HOLDERS:
                del self.by_host[next(iter(self.by_host))]
        if held != before:
            self.on_change(dict(self.by_host))

    def restore(self, held: Mapping[str, int]) -> None:
        """Go on with what was held in the process before."""
        self.by_host.update(held)
