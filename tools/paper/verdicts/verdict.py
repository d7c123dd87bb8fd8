"""One line of the table, and what its words mean.

Reproduced: the statement holds on the twin, and a number that it names is met within the tolerance written here.
"""

from dataclasses import dataclass
from typing import Final

YES, NO, OUTSIDE = "reproduced", "not reproduced", "outside software"
NORM_TOLERANCE: Final = 0.2  # of the paper's value: another slide, another loop
ERROR_TOLERANCE: Final = 0.25
TIME_TOLERANCE_S: Final = 0.03


@dataclass(frozen=True, slots=True)
class Verdict:
    """One statement of the paper, and whether the twin bears it out. where: figure; paper, ours: the values side by side;
    verdict: one of the three words.
    """

    where: str
    statement: str
    paper: str
    ours: str
    verdict: str
    why: str


def word(holds: bool) -> str:
    """Return the word for whether a statement holds."""
    return YES if holds else NO


def near(ours: float, paper: float, share: float) -> bool:
    """Return whether ours is within this share of the paper's value."""
    return abs(ours - paper) <= share * paper
