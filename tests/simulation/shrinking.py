"""The shortest list of events that still breaks a law: what a failing seed is told by."""

from collections.abc import Callable, Sequence

from tests.simulation.draws.event import Event


def shrink(events: Sequence[Event], is_broken: Callable[[Sequence[Event]], bool]) -> list[Event]:
    """Return a shorter list that is still broken: halves, quarters ... down to single events are left out (ddmin)."""
    kept, size = list(events), max(1, len(events) // 2)
    while True:
        at = 0
        while at < len(kept):
            shorter = kept[:at] + kept[at + size :]
            if is_broken(shorter):
                kept = shorter
            else:
                at += size
        if size == 1:
            return kept
        size = max(1, size // 2)
