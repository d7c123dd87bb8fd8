"""What `explain` says of a code: what was seen, what it probably is, one thing to do."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Explanation:
    """code: as messages begin (`A310`); title: a few words; is_warning: an alarm that leaves the force as it is.

    Every other A and every E is an error, every W a warning.
    """

    code: str
    title: str
    seen: str
    probably: str
    do: str
    is_warning: bool = False

    @property
    def sentence(self) -> str:
        """Title and cure as one clause, to end a message with."""
        return f"{self.title}: {self.do[:1].lower()}{self.do[1:].rstrip('.')}"


_DECIDING_SHARE = 0.5


def is_cause(part_s: float, whole_s: float) -> bool:
    """Decide whether what took a part of a silence or a lateness, both s, is told as its cause: it took at least half of it.
    Of one that is not known, nan, nothing is."""
    return part_s >= _DECIDING_SHARE * whole_s


BUSY_CURE = "the machine is too busy: end other programs, or `run --realtime`"
"""Ends the sentences whose cause is a machine with too much to do (MACHINE_BUSY, A403)."""

NO_CODE = Explanation("", "none", "", "", "")
"""Of the number 0 in the registers."""
