"""Whether a fault's cause was there: who blames the load cell must have had a reason to. Knows what was done to the world and
its wires, and no code of the gateway. Whether a master was lost (1) is judged by those who know what it had written:
held_force.py, observer.py.
"""

import struct
from collections.abc import Iterable
from math import inf

from tests.simulation.judges.observer import FAULT, STATUS_WORDS, Observer

AFTER_S = 1.5
"""So long after its cause has ended a fault may still begin: the longest bound on silence, and two looks."""
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
MASTER_LOST = 1
DISTURBS = {"cell": (CELL, FORCE), "output": (OUTPUT, FORCE), "wire": (CELL, OUTPUT, VALVE), "valve": (VALVE, FORCE)}
"""By what its name begins with: whom a setting of the simulated rig disturbs; the others the force."""


class ReasonJudge:
    """Told of each disturbance for as long as it lasts, asked at each look at the status block."""

    def __init__(self, observer: Observer) -> None:
        self._observer = observer
        self._last_s: dict[str, float] = {}
        self._fault = 0

    def note(self, whom: str, now_s: float) -> None:
        """This is disturbed now."""
        self._last_s[whom] = now_s

    def note_settings(self, names: Iterable[str], now_s: float) -> None:
        """These are set on the simulated rig now."""
        for name in names:
            for whom in DISTURBS.get(name.partition(".")[0], (FORCE,)):
                self.note(whom, now_s)

    def judge(self, block: bytes, at_s: float) -> None:
        """Judge the status block as it was at at_s: a fault that is new."""
        words = struct.unpack(f">{STATUS_WORDS}H", block)
        before, self._fault = self._fault, words[10] if words[1] == FAULT else 0
        if self._fault in (0, before, MASTER_LOST):
            return
        reasons = REASONS.get(self._fault, ())
        if all(at_s - self._last_s.get(whom, -inf) > AFTER_S for whom in reasons):
            told = {whom: f"{at_s - last_s:.1f} s ago" for whom, last_s in self._last_s.items()}
            self._observer.complain("reason", f"fault {self._fault}, and what was disturbed is {told}", at_s)
