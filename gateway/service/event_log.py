"""Sentences for people, on stderr, without ever making the control loop wait for a terminal.

A paused terminal blocks its writer; so lines go to a thread through a queue. At most 10 lines a second per cause: a
flooding client cannot fill a disk, and the number of lines left out is said. Causes carry addresses, so that they are
without number; only those of the last second are kept.
"""

import contextlib
import queue
import sys
import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import Self

_LINES_PER_S = 10
_LONGEST_QUEUE = 1000
_MOST_CAUSES = 1000
_END_BOUND_S = 1.0


class EventLog:
    """log(cause, sentence) from the loop; a daemon thread writes."""

    def __init__(
        self, write: Callable[[str], object] | None = None, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._write = write or sys.stderr.write
        self._clock = clock
        self._lines: queue.Queue[str | None] = queue.Queue(_LONGEST_QUEUE)
        self._windows: dict[str, tuple[float, int]] = {}
        self._thread = threading.Thread(target=self._drain, name="event-log", daemon=True)

    def __call__(self, cause: str, sentence: str) -> None:
        now_s = self._clock()
        began_s, count = self._windows.get(cause, (now_s, 0))
        if now_s - began_s >= 1.0:
            if count > _LINES_PER_S:
                self._put(f"... {count - _LINES_PER_S} more lines of {cause!r} left out")
            began_s, count = now_s, 0
        if cause not in self._windows and len(self._windows) >= _MOST_CAUSES:
            self._forget_old(now_s)
        self._windows[cause] = (began_s, count + 1)
        if count < _LINES_PER_S:
            self._put(sentence)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """What is said until now is still written, unless the terminal takes nothing for a second."""
        with contextlib.suppress(queue.Full):
            self._lines.put(None, timeout=_END_BOUND_S)
        self._thread.join(_END_BOUND_S)

    def _forget_old(self, now_s: float) -> None:
        recent = {cause: window for cause, window in self._windows.items() if now_s - window[0] < 1.0}
        self._windows = recent if len(recent) < _MOST_CAUSES else {}

    def _put(self, line: str) -> None:
        try:
            self._lines.put_nowait(line)
        except queue.Full:
            pass  # a terminal that takes nothing gets nothing; the registers still show the cause

    def _drain(self) -> None:
        while (line := self._lines.get()) is not None:
            with contextlib.suppress(OSError, ValueError):  # a terminal that went away
                self._write(line + "\n")
