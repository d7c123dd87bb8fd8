"""One entry of the catalogue, in the order of FIRST-HOUR's rule: what was seen, what it probably is, one thing to do."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Entry:
    """code: as messages begin; title: a few words; name: of the fault, warning bit or refusal in the registers, if any."""

    code: str
    title: str
    seen: str
    probably: str
    do: str
    name: str = ""
