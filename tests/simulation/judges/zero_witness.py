"""Whether a zero was taken while air still pressed: each force behind it would be that much too large, and read as right. Asks
the simulated rig for its pressure; no code that decides about a tare is used here.
"""

from collections.abc import Callable, Iterable

from tests.simulation.judges.observer import Observer

MOST_N = 2.0
"""A force on its way to 0 may be so large; the gateway knows it by its model."""
UNKNOWN_S = 3.0
"""So long behind a machine that is another one than the model's, or a device that has said what is not so."""
SILENT = frozenset(("output.silent", "cell.silent"))
"""What nobody hears may press, and everybody knows that."""


class ZeroWitness:
    """pressing_n: what the air presses with now; heard_falsely_s: when the output's answers were spoiled last."""

    rest_n = 0.0
    """What the air presses with at the safe voltage: whoever tares then is told so."""
    _other_s = -UNKNOWN_S

    def __init__(
        self, observer: Observer, pressing_n: Callable[[], float], heard_falsely_s: Callable[[], float]
    ) -> None:
        self._observer, self._pressing_n, self._heard_falsely_s = observer, pressing_n, heard_falsely_s

    def note_settings(self, names: Iterable[str], now_s: float) -> None:
        """These are set on the simulated rig now."""
        if not SILENT.issuperset(names):
            self._other_s = now_s

    def note_zero(self, now_s: float) -> None:
        """A zero has been taken."""
        is_known = now_s - max(self._other_s, self._heard_falsely_s()) > UNKNOWN_S
        if is_known and (pressing_n := self._pressing_n()) > self.rest_n + MOST_N:
            self._observer.complain("zero", f"it was taken while the air pressed with {pressing_n:.1f} N", now_s)
