"""What makes a table no ladder to fit, in a sentence: what was seen, what it probably is, what to do."""

from enum import StrEnum


class LadderFlaw(StrEnum):
    """Why a ladder was refused, for programs."""

    COLUMNS = "columns"
    TOO_SHORT = "too-short"
    NOT_FINITE = "not-finite"
    NO_STAIRS = "no-stairs"
    COMMAND_CONSTANT = "command-constant"
    FORCE_CONSTANT = "force-constant"
    SWAPPED = "columns-swapped"
    ONE_DIRECTION = "one-direction"
    CUT_SHORT = "group-cut-short"
    SIGN = "sign-inverted"
    UNIT = "force-unit"
    SATURATED = "saturated"
    NOT_INCREASING = "not-increasing"
    OTHER_RIG = "another-rig"
    NO_FIT = "no-fit"


class LadderError(ValueError):
    """Refused; nothing was made of the data."""

    def __init__(self, flaw: LadderFlaw, sentence: str) -> None:
        super().__init__(sentence)
        self.flaw = flaw
