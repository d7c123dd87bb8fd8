"""Publish a warning when two windows in a row agree; clear it when a window that could have shown it does not.

A window in which a change happened is half old and half new, and its cause may be misnamed. So two windows in a row must
show a cause, and it has a name only where both give the same one. Pure.
"""

from dataclasses import dataclass
from typing import Final

from gateway.registers.residual_cause import ResidualCause

_WINDOWS_TO_AGREE: Final = 2
"""Windows in a row that must show a cause before it is published, and the same one before it has a name."""
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
    _showing_windows: int = 0
    _last: WindowVerdict = NO_CHANGE

    def add(self, finding: WindowVerdict) -> None:
        """Take in the verdict of one window; `published` changes where enough in a row agree or one clears it."""
        if finding.cause is ResidualCause.NONE:
            self._clear_if_visible(finding)
            return
        last, self._last = self._last, finding
        self._showing_windows += 1
        self.agreeing_windows = self.agreeing_windows + 1 if finding.agrees_with(last) else 1
        if self.agreeing_windows >= _WINDOWS_TO_AGREE:
            keeps = self.published.agrees_with(finding) and self.published.cause is not ResidualCause.UNKNOWN
            self.published = self.published if keeps else finding
        elif self._showing_windows >= _WINDOWS_TO_AGREE and self.published.cause is ResidualCause.NONE:
            self.published = WindowVerdict(ResidualCause.UNKNOWN, finding.sentence, finding.excitation_v)

    def _clear_if_visible(self, finding: WindowVerdict) -> None:
        if finding.excitation_v >= _EXCITATION_TO_CLEAR * self._last.excitation_v:
            self.published, self._last = NO_CHANGE, NO_CHANGE
            self.agreeing_windows = self._showing_windows = 0
