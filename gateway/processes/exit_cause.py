"""Why a control process ended: a cause that programs decide by, and words for people. Standard library only."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final


class EndCause(StrEnum):
    """What the guardian knows about the end of a control process; travels to the next one as its value."""

    DIED = "died"  # by a signal, or it ended by itself without a reason
    DEFECT = "defect"  # it said that an internal error was the first cause
    NONSENSE = "nonsense"  # it said what no control process says
    NOT_STARTED = "not-started"  # the machine had no process for us, or it never came up
    MACHINE_BUSY = "machine-busy"  # silent, because the machine did not let it run
    STALLED = "stalled"  # silent, although it could run
    STOPPED = "stopped"  # silent, because somebody stopped it (SIGSTOP, a debugger)


_EXPLAINED_AS: Final = {
    EndCause.MACHINE_BUSY: "A403",
    EndCause.STALLED: "A404",
    EndCause.STOPPED: "A405",
    EndCause.NOT_STARTED: "A406",
    EndCause.NONSENSE: "A499",
    EndCause.DEFECT: "A499",
}


@dataclass(frozen=True, slots=True)
class Ending:
    """One end: the cause, and what was seen in numbers."""

    cause: EndCause
    text: str

    @property
    def sentence(self) -> str:
        """The words, with the code that `explain` expands where there is one besides A401."""
        code = _EXPLAINED_AS.get(self.cause)
        return f"{self.text} ({code})" if code else self.text

    def to_json(self) -> dict[str, str]:
        """Return it as the fields of a message."""
        return {"cause": self.cause.value, "text": self.text}

    @classmethod
    def from_json(cls, body: dict[str, Any] | None) -> "Ending | None":
        """Return what `to_json` was made from; None for None."""
        return cls(EndCause(body["cause"]), str(body["text"])) if body else None
