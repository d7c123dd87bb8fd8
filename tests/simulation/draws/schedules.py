"""Which kind of schedule a seed is."""

from collections.abc import Iterator

from tests.simulation.draws.event import Event
from tests.simulation.draws.events import draw_events
from tests.simulation.draws.harmless_events import draw_harmless_events
from tests.simulation.draws.quiet_events import EVERY, QUIET, draw_quiet_events

KINDS = {3: draw_harmless_events, QUIET: draw_quiet_events}
"""Of so many schedules one has a force that is held, and only what may not cost it happens beside; and one has few events,
deep in what goes on."""


def draw_schedule(seed: int, duration_s: float) -> Iterator[Event]:
    """Return what happens in the schedule of a seed, in its order."""
    return KINDS.get(seed % EVERY, draw_events)(seed, duration_s)
