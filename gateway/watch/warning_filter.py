"""What stands after several windows: the warning rises slowly and falls when a window that could have seen it acquits.

A window in which a change happened is half old and half new, and its cause may be misnamed. So two windows in a row must
convict, and the cause has a name only where both give the same one. Pure.
"""

from dataclasses import dataclass
from typing import Final

from gateway.registers.residual_cause import ResidualCause

_AS_GOOD: Final = 0.5  # share of the convicting window's excitation from which a window may acquit


@dataclass(frozen=True, slots=True)
class WindowVerdict:
    """What one window says. excitation_v: how much the command moved in it; others: names it could not tell apart."""

    cause: ResidualCause = ResidualCause.NONE
    sentence: str = ""
    excitation_v: float = 0.0
    others: tuple[str, ...] = ()

    def agrees_with(self, other: "WindowVerdict") -> bool:
        """The same cause, or one of a group that both windows cannot tell apart."""
        return self.cause is other.cause or (self.cause.effect in other.others and other.cause.effect in self.others)


AGREEMENT: Final = WindowVerdict()


@dataclass(slots=True)
class WarningFilter:
    """standing: what is published. convictions: how many windows in a row have said the same."""

    standing: WindowVerdict = AGREEMENT
    convictions: int = 0
    _last: WindowVerdict = AGREEMENT

    def hear(self, finding: WindowVerdict) -> None:
        """One judged window."""
        if finding.cause is ResidualCause.NONE:
            self._acquit(finding)
            return
        last, self._last = self._last, finding
        if last.cause is ResidualCause.NONE:
            self.convictions = 1
        elif finding.agrees_with(last):
            self.convictions += 1
            keeps = self.standing.agrees_with(finding) and self.standing.cause is not ResidualCause.UNKNOWN
            self.standing = self.standing if keeps else finding
        else:
            self.convictions = 1
            if self.standing.cause is ResidualCause.NONE:
                self.standing = WindowVerdict(ResidualCause.UNKNOWN, finding.sentence, finding.excitation_v)

    def _acquit(self, finding: WindowVerdict) -> None:
        if finding.excitation_v >= _AS_GOOD * self._last.excitation_v:
            self.standing, self._last, self.convictions = AGREEMENT, AGREEMENT, 0
