"""Whether a force that a master holds stays, whatever happens beside it that may not cost it (draws/harmless_events.py): its
master beats, its cell and its output work, so nobody has a reason to drop it. No code of the gateway is used here.
"""

import struct
from math import inf

from tests.simulation.judges.observer import COUNT_V, FAULT, STATUS_WORDS, Observer

RAMPING, HOLDING = 2, 3
SETTLE_S = 3.5
"""After a command: a ramp, and where a valve turns before, a ramp down and its dwell as well."""
IN_BAND_N = 1.0
COUNT_N = 0.01
SHOWN_S = 0.3
"""So long, at most, a reading that was spoiled on its wire is what the registers show."""


class HeldForce:
    """begun_s: who holds later than this is not judged."""

    _force_n = _settled_s = 0.0
    _is_expected = False

    def __init__(self, observer: Observer, begun_s: float) -> None:
        self._observer, self._begun_s = observer, begun_s

    def expect(self, force_n: float, now_s: float) -> None:
        """A master holds this force from now on, until it says another one. It is judged where it has begun at once: who comes
        later may have to wait, for a person's run to end, say."""
        if self._is_expected or now_s < self._begun_s:
            self._is_expected = True
            self._force_n, self._settled_s = force_n, now_s + SETTLE_S

    def note(self, block: bytes, at_s: float, spoiled_s: float = -inf) -> None:
        """Judge the status block as it was at at_s. spoiled_s: when a reading of the cell was spoiled last."""
        if not self._is_expected or at_s < self._settled_s:
            return
        words = struct.unpack(f">{STATUS_WORDS}h", block)
        force_n = abs(words[2]) * COUNT_N
        if words[1] not in (RAMPING, HOLDING):
            told = f"fault {words[10]}" if words[1] == FAULT else f"state {words[1]}"
            self._complain(f"{told}, {force_n:.2f} N instead of {self._force_n:g} N", at_s)
        elif self._is_least() and force_n > self._force_n:
            return  # the least voltage that may be out gives more
        elif abs(force_n - self._force_n) > IN_BAND_N and at_s - spoiled_s > SHOWN_S:
            self._complain(f"{force_n:.2f} N instead of {self._force_n:g} N", at_s)

    def end(self) -> None:
        """Nobody holds any more."""
        self._is_expected = False

    def _is_least(self) -> bool:
        """Whether nothing less may be out than what the wire has been told."""
        least_v = self._observer.bounds.voltage_min_v
        return least_v > 0.0 and self._observer.voltage_v - least_v <= 0.6 * COUNT_V

    def _complain(self, words: str, at_s: float) -> None:
        self._observer.complain("held force", words, at_s)
