"""Publish a warning when two windows in a row agree; clear it when a window that could have shown it does not.

A window in which a change happened is half old and half new, and its cause may be misnamed. So two windows in a row must
show a cause, and it has a name only where both give the same one. Pure.
"""

from dataclasses import dataclass
from typing import Final

from gateway.registers.residual_cause import ResidualCause

_EXCITATION_TO_CLEAR: Final = (
    0.5  # share of the excitation of the window that named the cause, by which another may clear it
)


@dataclass(frozen=True, slots=True)
class WindowVerdict:
    """The cause that one window shows. excitation_v: how much the command moved in it; others: effects that it could not
    tell from the cause."""

    cause: ResidualCause = ResidualCause.NONE
    sentence: str = ""
    excitation_v: float = 0.0
    others: tuple[str, ...] = ()

    def agrees_with(self, other: "WindowVerdict") -> bool:
        """Return whether both name the same cause, or one of a group that both cannot tell apart."""
        return self.cause is other.cause or (self.cause.effect in other.others and other.cause.effect in self.others)


NO_CHANGE: Final = WindowVerdict()


@dataclass(slots=True)
class WarningFilter:
    """Decides what is published. agreeing_windows: how many windows in a row have shown the same cause."""

    published: WindowVerdict = NO_CHANGE
    agreeing_windows: int = 0
    _last: WindowVerdict = NO_CHANGE

    def add(self, finding: WindowVerdict) -> None:
        """Take in the verdict of one window; `published` changes where two in a row agree or one clears it."""
        if finding.cause is ResidualCause.NONE:
            self._clear_if_visible(finding)
            return
        last, self._last = self._last, finding
        if last.cause is ResidualCause.NONE:
            self.agreeing_windows = 1
        elif finding.agrees_with(last):
            self.agreeing_windows += 1
            keeps = self.published.agrees_with(finding) and self.published.cause is not ResidualCause.UNKNOWN
            self.published = self.published if keeps else finding
        else:
            self.agreeing_windows = 1
            if self.published.cause is ResidualCause.NONE:
                self.published = WindowVerdict(ResidualCause.UNKNOWN, finding.sentence, finding.excitation_v)

    def _clear_if_visible(self, finding: WindowVerdict) -> None:
        if finding.excitation_v >= _EXCITATION_TO_CLEAR * self._last.excitation_v:
            self.published, self._last, self.agreeing_windows = NO_CHANGE, NO_CHANGE, 0
