"""What an output device refuses or alters again and again: once is noise on the line, three times in a row are a fault."""

from dataclasses import dataclass, field
from typing import Final

from gateway.codes.faults import FaultCode

_FAILURES_BEFORE_FAULT: Final = 3  # in a row


@dataclass(slots=True)
class RepeatedFailures:
    """Counted by the kind of question: an echo that agrees makes no reading good that does not. fault: behind three."""

    fault: FaultCode = FaultCode.NONE
    _counts: dict[type, int] = field(default_factory=dict)

    def note_success(self, question: type) -> None:
        """End the fault with whichever question was its last reason: where the safe voltage stands, only polls go on."""
        self._counts[question] = 0
        if max(self._counts.values()) < _FAILURES_BEFORE_FAULT:
            self.fault = FaultCode.NONE

    def count(self, question: type, fault: FaultCode) -> None:
        """Count one more answer that told of this fault."""
        self._counts[question] = self._counts.get(question, 0) + 1
        if self._counts[question] >= _FAILURES_BEFORE_FAULT:
            self.fault = fault
