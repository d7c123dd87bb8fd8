"""Whether a force that is off is explained: where nothing is disturbed, nothing limits and no warning says why, it is where it
was asked for. No code of the gateway is used here.
"""

import struct

from tests.simulation.judges.observer import STATUS_WORDS, Observer

RAMPING, HOLDING = 2, 3
QUIET_S = 2.5
"""So long nothing must have happened; then the force has come."""
OFF_N = 1.0
COUNT_N = 0.01
SAYS_WHY = 1 << 1 | 1 << 2 | 1 << 8
"""Of warning_word: the target cannot be reached, the trim is at its limit, the model differs."""


class ExplainedForce:
    """Told of each look at the status block, and of each write that was taken: between two looks, two masters who take the
    force from each other may each have had theirs."""

    def __init__(self, observer: Observer) -> None:
        self._observer = observer
        self._quiet_s, self._requested, self._writer = 0.0, 0, ""

    def note_write(self, writer: str, at_s: float) -> None:
        """Note whose write was taken at at_s."""
        if writer != self._writer:
            self._writer = writer
            self.note_change(at_s)

    def note_change(self, at_s: float) -> None:
        """Another weight, tilt or model counts from at_s on: the force must follow."""
        self._quiet_s = max(self._quiet_s, at_s)

    def note(self, block: bytes, at_s: float, disturbed_s: float) -> None:
        """Judge the status block as it was at at_s. disturbed_s: when something was disturbed last."""
        words = struct.unpack(f">{STATUS_WORDS}h", block)
        measured, requested, applied = abs(words[2]), words[3], words[5]
        is_under_way = words[1] not in (RAMPING, HOLDING) or not requested or applied != requested
        before, self._requested = self._requested, requested
        if is_under_way or words[9] or words[11] & SAYS_WHY or requested != before:
            self._quiet_s = at_s
        quiet_s = at_s - max(self._quiet_s, disturbed_s)
        if quiet_s > QUIET_S and abs(measured - requested) * COUNT_N > OFF_N:
            told = f"{measured * COUNT_N:.2f} N instead of {requested * COUNT_N:.2f} N, and nothing says why"
            self._observer.complain("explained force", told, at_s)
            self._quiet_s = at_s
