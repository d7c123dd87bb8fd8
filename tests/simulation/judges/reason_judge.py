"""Whether the cause of a fault or of a refusal was there: who blames the load cell must have had a reason to. Knows what was
done to the world and its wires, and no code of the gateway. Whether a master was lost (1) is judged by those who know what it
had written: held_force.py, observer.py. What is refused because of a fault, a run or an owner is not judged: these may come
and go between two looks; nor what is not ready, for after a tare under force it is not until the next one.
"""

import struct
from collections.abc import Iterable
from math import inf

from tests.simulation.judges.observer import FAULT, STATUS_WORDS, Observer

AFTER_S = 1.5
"""So long after its cause has ended a fault may still begin: the longest bound on silence, and two looks."""
RISE_S = 3.0
"""The same of a wrong gain or sign: they are judged over the whole first rise, which may have begun with a disturbed cell, or
behind a contact that has just come back (seed 259310)."""
REOPENED_S = 3.0
"""So long one may be refused: a port that is back is opened within two seconds."""
EVER_S = 1e6
WINDOW_S = 11.5
"""So long of what is counted over ten seconds."""
CELL, OUTPUT, VALVE, MACHINE, FORCE = "load_cell", "output", "valve", "machine", "force"
REASONS: dict[int, tuple[str, ...]] = {
    2: (CELL, MACHINE),
    3: (CELL,),
    4: (CELL, FORCE),
    5: (CELL, FORCE),
    6: (CELL, FORCE),
    7: (OUTPUT, MACHINE),
    8: (OUTPUT,),
    9: (OUTPUT,),
    10: (OUTPUT,),
    11: (CELL,),
    12: (MACHINE,),
    16: (MACHINE,),
    17: (VALVE, MACHINE),
    18: (VALVE,),
    20: (OUTPUT, MACHINE),
    21: (OUTPUT, CELL),
    22: (OUTPUT,),
}
"""Of a number in fault_code: whose disturbance may be its cause. Of those that are not here none ever is."""
MASTER_LOST, OVER_FORCE, SIGN_INVERTED, GAIN_WRONG = 1, 4, 5, 6
REFUSED: dict[int, tuple[float, tuple[str, ...]]] = {
    13: (EVER_S, (OUTPUT, MACHINE)),
    14: (REOPENED_S, (CELL, MACHINE)),
    33: (REOPENED_S, (VALVE, MACHINE)),
}
"""The same of refusal_reason, where it is not the master that is blamed, and how long ago that may be: an output whose own
watchdog has tripped obeys nothing until somebody resets it."""
DISTURBS = {"cell": (CELL, FORCE), "output": (OUTPUT, FORCE), "wire": (CELL, OUTPUT, VALVE), "valve": (VALVE, FORCE)}
WARNED = {
    0: (AFTER_S, (MACHINE,)),
    3: (WINDOW_S, (CELL, OUTPUT, VALVE, MACHINE)),
    4: (WINDOW_S, (MACHINE,)),
}
"""The same of a bit in warning_word, and how long ago that may be."""
"""By what its name begins with: whom a setting of the simulated rig disturbs; the others the force."""


class ReasonJudge:
    """Told of each disturbance for as long as it lasts, asked at each look at the status block."""

    def __init__(self, observer: Observer) -> None:
        self._observer = observer
        self._last_s: dict[str, float] = {}
        self._fault = self._refusal = self._warned = 0
        self.has_payload = False
        """A master has told of one: what it says that weighs counts as force."""

    @property
    def disturbed_s(self) -> float:
        """When anybody was disturbed last."""
        return max(self._last_s.values(), default=-inf)

    def note(self, whom: str, now_s: float) -> None:
        """This is disturbed now."""
        self._last_s[whom] = now_s

    def note_settings(self, names: Iterable[str], now_s: float) -> None:
        """These are set on the simulated rig now."""
        for name in names:
            for whom in DISTURBS.get(name.partition(".")[0], (FORCE,)):
                self.note(whom, now_s)

    def judge(self, block: bytes, at_s: float) -> None:
        """Judge the status block as it was at at_s: a fault or a refusal that is new."""
        words = struct.unpack(f">{STATUS_WORDS}H", block)
        self._judge_refusal(words[19], at_s)
        new, self._warned = words[11] & ~self._warned, words[11]
        for bit, (after_s, reasons) in WARNED.items():
            if new & 1 << bit:
                self._judge_blame(f"warning {bit}", reasons, at_s, after_s)
        before, self._fault = self._fault, words[10] if words[1] == FAULT else 0
        if self._fault in (0, before, MASTER_LOST) or (self._fault == OVER_FORCE and self.has_payload):
            return
        after_s = RISE_S if self._fault in (GAIN_WRONG, SIGN_INVERTED) else AFTER_S
        reasons = REASONS.get(self._fault, ())
        if self._fault == SIGN_INVERTED and self._observer.bounds.safe_v > 0.0:
            reasons = (
                *reasons,
                OUTPUT,
            )  # what pressed at the last tare has left with its power: the cell reads below 0
        self._judge_blame(f"fault {self._fault}", reasons, at_s, after_s)

    def _judge_refusal(self, refusal: int, at_s: float) -> None:
        before, self._refusal = self._refusal, refusal
        if refusal in REFUSED and refusal != before:
            after_s, reasons = REFUSED[refusal]
            self._judge_blame(f"refusal {refusal}", reasons, at_s, after_s)

    def _judge_blame(self, told: str, reasons: tuple[str, ...], at_s: float, after_s: float = AFTER_S) -> None:
        if all(at_s - self._last_s.get(whom, -inf) > after_s for whom in reasons):
            last = {whom: f"{at_s - last_s:.1f} s ago" for whom, last_s in self._last_s.items()}
            self._observer.complain("reason", f"{told}, and what was disturbed is {last}", at_s)
