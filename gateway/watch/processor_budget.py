"""How much of the processor the watch may take: a small share in the long run, and more for a while where something changed.

A search takes seconds, and a change is only named when two windows agree. So what was not used is saved up to a store that
pays for a few searches at once; a machine that changes all the time is looked at less often. Pure.
"""

from dataclasses import dataclass
from typing import Final

SHARE: Final = 0.025
"""Of one core, in the long run."""
STORE_S: Final = 30.0
"""Of processor, that may be spent at once: the libraries, the first windows, and four searches of a change."""
_SHARE_AT_ONCE: Final = 0.25  # of one core, while the store lasts


@dataclass(slots=True)
class ProcessorBudget:
    """Seconds of processor that are saved, and how long to wait after spending some."""

    saved_s: float = STORE_S

    def pause_s(self, every_s: float, lasted_s: float, spent_s: float) -> float:
        """Return the pause from the end of a look to the next. lasted_s: since the end of the one before; spent_s: in it,
        of processor.
        """
        self.saved_s = min(self.saved_s + SHARE * lasted_s, STORE_S) - spent_s
        usual_s = max(every_s, spent_s / _SHARE_AT_ONCE) - min(spent_s, every_s)
        return max(usual_s, -self.saved_s / SHARE)
