"""How long the broker takes to answer, and so for how long what it brings may have waited, in it or on the way.

A message of MQTT does not say when it was sent. A broker that stood still, or a network that did, brings a command late: an
enable of eight seconds ago pressed when nobody expected it. Heartbeats that a publisher had piled up came for as long as it
took to read them, and kept the force of one that had hung for 23 s. An answer of the broker comes behind what it has sent
before: where that takes too long, nothing that comes presses, until one is quick again.
"""

from collections.abc import Callable
from typing import Final

SLOW_S: Final = 1.0
ASK_S: Final = 0.25


class RoundTrips:
    """clock: seconds. Nothing is slow before the first question."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._asked_s: float | None = None
        self._was_slow = False

    def note_asked(self) -> None:
        """Note that the broker is asked now."""
        self._asked_s = self._clock()

    def note_answered(self) -> None:
        """Note that its answer has come."""
        self._was_slow = self._is_overdue
        self._asked_s = None

    @property
    def is_slow(self) -> bool:
        """Decide whether what comes now may have waited for too long."""
        return self._was_slow or self._is_overdue

    @property
    def _is_overdue(self) -> bool:
        return self.waits_s > SLOW_S

    @property
    def waits_s(self) -> float:
        """For how long the broker has not answered; 0 where it is not asked."""
        return 0.0 if self._asked_s is None else self._clock() - self._asked_s
