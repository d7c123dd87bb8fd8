"""The residual watch itself: look at the newest window, cheaply; search for the cause where that shows an excess.

A look replays the reference plant (a few tenths of a second) and compares the residual with the floor of such windows.
Only an excess, or a kind of window that was never judged, is worth the whole search, which takes seconds, and only in rows
that are younger than the last healthy look: a window that is half old and half new gets a wrong name (a longer delay
was called a longer lag). A cause that stands is searched for again less and less often; what clears it is the cheap look.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Final, Protocol

from gateway.recording.ring import RingReader
from gateway.registers.residual_cause import ResidualCause
from gateway.watch.warning_filter import WarningFilter, WindowVerdict
from gateway.watch.window import Window, window_of

_FRESH_SHARE: Final = 0.6
"""Share of a window that must be younger than the last healthy one: half old and half new has a wrong name."""
_ALL_ROWS: Final = 1 << 30
_LONGEST_PAUSE_S: Final = 600.0  # between searches: a cause that has stood for long is looked at every ten minutes
_MOST_DOUBLINGS: Final = 16  # far beyond the longest pause; the windows of a week are more than a float carries
_WINDOWS_BEFORE_PAUSES: Final = 2
"""Windows in a row that show the same cause, from which on the search pauses longer and longer: more add nothing."""


class WindowComparison(Protocol):
    """What windows are compared with."""

    def why_unsuitable(self, window: Window) -> str:
        """Return why this window cannot be compared; empty where it can."""

    def rms_n(self, window: Window) -> float:
        """Return what is off in it, N; cheap."""

    def floor_n(self, window: Window) -> float | None:
        """Return what is usually off, N; None where that is not known yet."""

    def is_exceeded(self, window: Window, rms_n: float) -> bool:
        """Return whether that is worth a search."""

    def judge(self, window: Window) -> WindowVerdict | None:
        """Search for the cause, which takes seconds; None where this window neither shows one nor shows that there is none."""


@dataclass(frozen=True, slots=True)
class WatchSettings:
    """How often the watch looks, and at how much; of the rig file."""

    window_s: float
    every_s: float


class Watch:
    """Looks at the newest window, and publishes what has changed. clock: monotonic seconds, for the pauses between
    searches.
    """

    def __init__(
        self,
        ring: RingReader,
        comparison: WindowComparison,
        setup: WatchSettings,
        clock: Callable[[], float],
    ) -> None:
        self._ring = ring
        self._comparison = comparison
        self._setup = setup
        self._clock = clock
        self._filter = WarningFilter()
        self._search_s = 0.0
        self._healthy_s = -inf
        self.why_skipped = ""
        self.counters: dict[str, float] = {"looks": 0, "judged": 0, "skipped": 0}

    @property
    def published(self) -> WindowVerdict:
        """The verdict to publish."""
        return self._filter.published

    def check_newest_window(self) -> None:
        """Look once; `published` and `counters` tell."""
        self.counters["looks"] += 1
        window = self._window(self._setup.window_s)
        self.why_skipped = window if isinstance(window, str) else self._comparison.why_unsuitable(window)
        if self.why_skipped or isinstance(window, str):
            self.counters["skipped"] += 1
            return
        rms_n = self._comparison.rms_n(window)
        self.counters["rms_n"] = rms_n
        if not self._comparison.is_exceeded(window, rms_n):
            self._note_healthy(window)
        elif self._clock() >= self._search_s:
            self._search(window)
        if (floor_n := self._comparison.floor_n(window)) is not None:
            self.counters["floor_n"] = floor_n

    def _window(self, window_s: float) -> Window | str:
        return window_of(self._ring.newest(_ALL_ROWS), self._ring.columns, window_s)

    def _note_healthy(self, window: Window) -> None:
        self._healthy_s = window.end_s
        self._filter.add(WindowVerdict(excitation_v=window.excitation_v))

    def _search(self, window: Window) -> None:
        """In what is younger than the last healthy window, once that is half a window."""
        fresh_s = min(self._setup.window_s, window.end_s - self._healthy_s)
        if fresh_s < _FRESH_SHARE * self._setup.window_s:
            return
        fresh = window if fresh_s == self._setup.window_s else self._window(fresh_s)
        if not isinstance(fresh, str):
            self._judge(fresh)

    def _judge(self, window: Window) -> None:
        self.counters["judged"] += 1
        finding = self._comparison.judge(window)
        if finding is None:
            return
        if finding.cause is ResidualCause.NONE:
            self._healthy_s = window.end_s
        self._filter.add(finding)
        if self._filter.agreeing_windows > _WINDOWS_BEFORE_PAUSES:
            doubled = min(_MOST_DOUBLINGS, self._filter.agreeing_windows - _WINDOWS_BEFORE_PAUSES)
            pause_s = self._setup.every_s * 2.0**doubled
            self._search_s = self._clock() + min(_LONGEST_PAUSE_S, pause_s)
