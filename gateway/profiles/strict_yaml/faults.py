"""What is wrong in a profile, where, and in the user's words.

A fault is one line, `file:line:column path: message`, as compilers print theirs, so that editors jump to it. Faults are
collected and told together: a file with five typos takes one run to fix, not five.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from difflib import get_close_matches
from enum import Enum

Path = tuple[str | int, ...]
"""Where in a document: keys and list indices from the top."""


def path_text(path: Path) -> str:
    """Return `("network", "units", 1)` as a user reads it: `network.units[1]`."""
    text = ""
    for step in path:
        text += f"[{step}]" if isinstance(step, int) else f".{step}" if text else step
    return text


def printable(text: str) -> str:
    """Return one line without control characters: a file cannot write on the reader's terminal."""
    return "".join(sign if sign.isprintable() else sign.encode("unicode_escape").decode() for sign in text)


class FaultKind(Enum):
    """Kind of a fault, which other checks decide by; the sentence is for people."""

    OTHER = "other"
    MISSING = "missing"  # a key that must be there
    STRANGER = "stranger"  # a key that means nothing there


@dataclass(frozen=True, slots=True, order=True)
class ProfileFault:
    """One thing to fix. line and column count from 1; line 0: the file as a whole (it could not be found or read). meant:
    the key that a STRANGER probably is, empty where nobody knows."""

    file: str
    line: int
    column: int
    path: str
    message: str
    kind: FaultKind = field(default=FaultKind.OTHER, compare=False)
    meant: str = field(default="", compare=False)

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}:{self.column}" if self.line else self.file
        return printable(f"{place} {self.path}: {self.message}" if self.path else f"{place}: {self.message}")


class ProfileError(Exception):
    """A profile that cannot be used, with every fault found. Exit code 78 at the command line."""

    def __init__(self, faults: Iterable[ProfileFault]) -> None:
        self.faults = tuple(dict.fromkeys(faults))
        super().__init__("\n".join(map(str, self.faults)))


@dataclass(slots=True)
class Findings:
    """Collects while files are read: faults stop a rig from starting, warnings do not. `texts`: all bytes read, by file."""

    faults: list[ProfileFault] = field(default_factory=list)
    hardware: list[ProfileFault] = field(default_factory=list)  # what only a run on real devices needs
    warnings: list[ProfileFault] = field(default_factory=list)
    texts: dict[str, bytes] = field(default_factory=dict)


def closest(word: str, known: Iterable[str]) -> str | None:
    """Return the known word that a typist most likely meant, None when nothing is near."""
    candidates = {name.lower(): name for name in known}
    matches = get_close_matches(word.lower(), candidates, n=1, cutoff=0.6)
    return candidates[matches[0]] if matches else None


def one_of(words: Iterable[object]) -> str:
    """Return the words as a list for a sentence: `a, b, c`."""
    return ", ".join(str(word) for word in words)
