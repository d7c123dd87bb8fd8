"""What a process has to say to people: on stderr (of a service: in the journal) and in the state directory's event file, and
the loop waits for neither.

A paused terminal blocks its writer, and so may a disk; each has a queue and a thread of its own. At most 10 lines a
second per cause, and 1 while a flood goes on from second to second: a client that sends garbage makes less than 1 MB of log and
events a minute, and the number of lines left out is said. A cause that has had 600 lines of one code without two seconds of
rest, such as a robot whose setpoints are refused all night, has one a minute from then on: it would have taken the place of
every other event within hours. Causes carry addresses, so that they are without number; only those of the last two seconds are
kept. A disk that takes no events is said once, on stderr (E150): nothing else depends on it.
"""

import contextlib
import errno
import queue
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import Final, Self

from gateway.plain_file import tell_place_and_refusal
from gateway.processes.event import EventRecord, encode_event, format_event, make_event
from gateway.processes.event_file import EventFile
from gateway.processes.systemd.journal import journal_writer

LINES_PER_S: Final = 10
FLOODED_LINES_PER_S: Final = 1
_WINDOW_S: Final = 1.0
_FLOOD_ENDS_S: Final = 2.0  # from the beginning of its last full second
_CODE_LENGTH: Final = 4  # of W204
_LONG_LINES: Final = 600
_LONG_WINDOW_S: Final = 60.0
_LONGEST_QUEUE: Final = 1000
_MOST_CAUSES: Final = 1000
_END_BOUND_S: Final = 1.0
_ROUND_S: Final = 1.0


class EventLog:
    """log(cause, sentence) from any thread; log.note(cause, sentence) for the file alone.

    The cause's first word is the event's; all of it is what lines are limited by. clock: monotonic, wall: since the epoch, s.
    """

    def __init__(
        self,
        write: Callable[[str], object] | None = None,
        clock: Callable[[], float] = time.monotonic,
        *,
        source: str = "control",
        file: EventFile | None = None,
        wall: Callable[[], float] = time.time,
    ) -> None:
        self._clock, self._wall, self._source = clock, wall, source
        self._windows: dict[str, _RateWindow] = {}
        self._lock = threading.Lock()
        self._terminal = QueuedWriter("terminal", _terminal_writer(write), self._event, self._tell_left_out)
        self._file = file
        to_disk = _EventFileWriter(file, self._terminal.put, self._event) if file else None
        self._disk = QueuedWriter("events", to_disk, self._event) if to_disk else None

    def __call__(self, cause: str, sentence: str) -> None:
        self._say(self._source, cause, sentence)

    def speaking_for(self, source: str) -> Callable[[str, str], None]:
        """Return the same log for what another process has found and told this one."""
        return lambda cause, sentence: self._say(source, cause, sentence)

    def note(self, cause: str, sentence: str) -> None:
        """Write an event to the file only, where the terminal shows it already; to the terminal where the file does not take
        it. Not limited."""
        if self._disk:
            self._disk.put(_NotedEvent(*self._event(cause, sentence)))

    def __enter__(self) -> Self:
        for drain in self._drains():
            drain.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """What is said until now is still written, unless a terminal or a disk takes nothing for a second."""
        self._tell_left_out(at_the_end=True)
        for drain in self._drains():
            drain.end()
        if self._file and self._disk and not self._disk.is_alive:
            self._file.close()

    def _drains(self) -> tuple["QueuedWriter", ...]:
        return (self._terminal, self._disk) if self._disk else (self._terminal,)

    def _say(self, source: str, cause: str, sentence: str) -> None:
        now_s = self._clock()
        with self._lock:
            window, code = self._windows.get(cause), sentence[:_CODE_LENGTH]
            if window is None or window.is_over(now_s) or window.hides(code):
                if window is None and len(self._windows) >= _MOST_CAUSES:
                    self._forget_old(now_s)
                self._put_left_out(cause, window)
                self._windows[cause] = window = _window_after(window, now_s, source, code)
            window.count += 1
            window.is_mixed |= code != window.code
            window.sentence = sentence
        if window.count <= window.lines:
            self._put(self._event(cause, sentence, source))

    def _tell_left_out(self, *, at_the_end: bool = False) -> None:
        """A flood that has ended is counted too."""
        now_s = self._clock()
        with self._lock:
            for cause, window in tuple(self._windows.items()):
                if at_the_end or window.is_over(now_s):
                    self._put_left_out(cause, window)
                if window.is_past(now_s):
                    del self._windows[cause]

    def _put_left_out(self, cause: str, window: "_RateWindow | None") -> None:
        """With the code of what is left out, so that it is found where that is looked for."""
        if window is not None and window.count > window.lines and not window.is_told:
            window.is_told = True
            code = self._event(cause, window.sentence).code
            sentence = f"{window.count - window.lines} more lines of {cause!r} left out"
            self._put(self._event(cause, f"{code} {sentence}" if code else sentence, window.source))

    def _forget_old(self, now_s: float) -> None:
        """What was left out of a forgotten cause is told now: nobody comes back to it."""
        recent = {cause: window for cause, window in self._windows.items() if not window.is_over(now_s)}
        kept = recent if len(recent) < _MOST_CAUSES else {}
        for cause, window in self._windows.items():
            if cause not in kept:
                self._put_left_out(cause, window)
        self._windows = kept

    def _event(self, cause: str, sentence: str, source: str = "") -> EventRecord:
        return make_event(self._wall(), source or self._source, cause, sentence)

    def _put(self, event: EventRecord) -> None:
        for drain in self._drains():
            drain.put(event)


@dataclass(slots=True)
class _RateWindow:
    """One second of one cause, or one minute of a long flood: how many lines it may have and had, the last of them, and how
    many of its code it has had before without a rest. is_mixed: others came, too."""

    began_s: float
    source: str
    code: str
    lines: int = LINES_PER_S
    lasts_s: float = _WINDOW_S
    had: int = 0
    count: int = 0
    sentence: str = ""
    is_told: bool = False
    is_mixed: bool = False

    def hides(self, code: str) -> bool:
        """Decide whether what is new would be left out for a long flood of another code."""
        return self.lasts_s > _WINDOW_S and code != self.code

    def is_over(self, now_s: float) -> bool:
        """Decide whether another one is next."""
        return now_s - self.began_s >= self.lasts_s

    def is_past(self, now_s: float) -> bool:
        """Decide whether the cause has been calm since."""
        return now_s - self.began_s >= self.lasts_s + _FLOOD_ENDS_S - _WINDOW_S


def _window_after(before: _RateWindow | None, now_s: float, source: str, code: str) -> _RateWindow:
    """Return the next one of a cause: with few lines where the one just before had too many."""
    if before is None or before.is_past(now_s) or before.hides(code):
        return _RateWindow(now_s, source, code)
    is_same = code == before.code and not before.is_mixed
    had = before.had + min(before.count, before.lines) if is_same else 0
    if had >= _LONG_LINES:
        return _RateWindow(now_s, source, code, FLOODED_LINES_PER_S, _LONG_WINDOW_S, had)
    lines = FLOODED_LINES_PER_S if before.count > before.lines else LINES_PER_S
    return _RateWindow(now_s, source, code, lines, had=had)


class QueuedWriter:
    """A queue and the thread that empties it into `write`, whose OSError and ValueError (a terminal that is gone) nobody minds.

    What does not fit in the queue is left out; the registers still show the cause, and how many there were is said where they
    are missing. event: makes that one; each_round: called when nothing has come for a second.
    """

    def __init__(
        self,
        name: str,
        write: Callable[[EventRecord], object],
        event: Callable[[str, str], EventRecord],
        each_round: Callable[[], None] | None = None,
    ) -> None:
        self._write, self._event = write, event
        self._each_round = each_round
        self._left_out = 0
        self._lock = threading.Lock()
        self._events: queue.Queue[EventRecord | None] = queue.Queue(_LONGEST_QUEUE)
        self._thread = threading.Thread(target=self._run, name=f"event-log {name}", daemon=True)

    @property
    def is_alive(self) -> bool:
        """Decide whether the writing thread runs."""
        return self._thread.is_alive()

    def start(self) -> None:
        """Start the writing thread. OSError where the machine refuses one."""
        try:
            self._thread.start()
        except RuntimeError as error:
            raise OSError(
                errno.EAGAIN, f"no thread for the log: {error}; too few processes or tasks allowed?"
            ) from None

    def put(self, event: EventRecord) -> None:
        """Queue an event; a full queue drops it, and counts."""
        with self._lock:
            if self._events.qsize() + bool(self._left_out) >= _LONGEST_QUEUE:  # a count takes no event's place
                self._left_out += 1
                return
            self._put_left_out()
            self._events.put_nowait(event)

    def end(self) -> None:
        """Write what is in the queue, then end, if that takes no longer than a second."""
        with contextlib.suppress(queue.Full):
            self._put_left_out(_END_BOUND_S)
            self._events.put(None, timeout=_END_BOUND_S)
        self._thread.join(_END_BOUND_S)

    def _put_left_out(self, timeout_s: float | None = None) -> None:
        """Say how many events did not fit, before whatever comes behind them. Raises queue.Full."""
        if self._left_out:
            sentence = f"{self._left_out} more lines left out: those before them were not written yet"
            self._events.put(self._event("events", sentence), timeout=timeout_s)
            self._left_out = 0

    def _run(self) -> None:
        while True:
            try:
                event = self._events.get(timeout=_ROUND_S if self._each_round else None)
            except queue.Empty:
                if self._each_round:
                    self._each_round()
                continue
            if event is None:
                return
            with contextlib.suppress(OSError, ValueError):
                self._write(event)


def _terminal_writer(write: Callable[[str], object] | None) -> Callable[[EventRecord], object]:
    """Where people look: `write`, else the journal where stderr is its stream, else stderr."""
    to_journal = None if write else journal_writer()
    to_terminal = write or sys.stderr.write
    return to_journal or (lambda event: to_terminal(format_event(event) + "\n"))


class _NotedEvent(EventRecord):
    """One that the terminal has not been given."""


class _EventFileWriter:
    """Events to the file; the first that it does not take raises the alarm, the first that it takes again ends it. tell: what
    the terminal is given."""

    def __init__(
        self, file: EventFile, tell: Callable[[EventRecord], None], event: Callable[[str, str], EventRecord]
    ) -> None:
        self._file, self._tell, self._event = file, tell, event
        self._lost = 0

    def __call__(self, event: EventRecord) -> None:
        try:
            self._file.append(encode_event(event))
        except OSError as error:
            self._lost += 1
            if self._lost == 1:
                sentence = (
                    f"E150 events are not kept: {tell_place_and_refusal(error)}; control goes on, stderr has them"
                )
                self._tell(self._event("events", sentence))
            if isinstance(event, _NotedEvent):  # the sentence above says that it is there
                self._tell(event)
            return
        if self._lost:
            sentence = f"E150 {self._lost} events were not kept before this one"
            self._file.append(encode_event(self._event("events", sentence)))  # where this fails it is told later
            self._lost = 0
