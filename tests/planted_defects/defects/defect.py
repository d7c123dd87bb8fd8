"""Defects that somebody could make, each a change of one place: what stands there, what is put there, whose tests must see it.

They are chosen by what they would do on a rig (drop a force, exceed one, take a wrong command, lose data) or to somebody who
relies on a figure far from it, not by how easy they are to find. `tests` are those near the change: a defect that only a far
test sees is one that its author meets too late. Each file beside this one holds those of a few rooms.
"""

from typing import NamedTuple


class Defect(NamedTuple):
    """file: below gateway/; before: stands in it once; tests: below tests/."""

    name: str
    file: str
    before: str
    after: str
    tests: tuple[str, ...]


BANK = ("registers/bank/test_commands.py", "registers/bank/test_ownership.py", "registers/bank/test_refusals.py")
WIRED = ("service/running_rig/wired/test_faults.py", "service/running_rig/wired/test_invariants.py")
REACTIONS = ("faults/test_control_reactions.py", "faults/test_first_cause_and_reset.py", "control/test_states.py")
DETECTION = ("control/supervision/test_fault_detection.py", *REACTIONS)
