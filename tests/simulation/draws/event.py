"""One thing that happens to a gateway."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Event:
    """At at_s after READY, `what` happens to `whom`, with these numbers. way: how a master spells it (spelling.py)."""

    at_s: float
    whom: str
    what: str
    numbers: tuple[float, ...] = ()
    data: bytes = b""
    way: str = "block"
