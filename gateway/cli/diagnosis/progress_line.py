"""How far a long calculation is, on stderr from its first second on: what is done, its share and the time left, in one line
that is rewritten on a terminal, else a line for each stage; and a Ctrl-C that ends it wherever it is. Standard library only:
the set-up shows itself by it before anything is installed.
"""

import select
import shutil
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from types import FrameType
from typing import IO, Any, Final

from gateway.cli.terminal import can_write_over
from gateway.progress import Progress, listen

_QUIET_S: Final = 1.0  # what is shorter needs no words
_REWRITTEN_S: Final = 0.2
_TOLD_S: Final = 1.0  # of a stage, before its speed says anything
_CLEAR: Final = "\r\x1b[2K"


@contextmanager
def show_progress(task: str) -> Iterator[None]:
    """Show what the calculation in this block reports. task: what it does, in a word. KeyboardInterrupt at Ctrl-C.

    What it prints meanwhile on the same terminal stands above the line.
    """
    line = ProgressLine(task, sys.stderr)
    with _interruptible() as check, line.keep_writing():

        def show(progress: Progress) -> None:
            check()
            line.tell(progress)

        with listen(show), redirect_stdout(_AboveLine(sys.stdout, line)):
            yield


class ProgressLine:
    """Writes the newest stage beside the task and its seconds."""

    def __init__(self, task: str, stream: IO[str], clock: Callable[[], float] = time.monotonic) -> None:
        self._task = task
        self._stream = stream
        self._is_terminal = can_write_over(stream)
        self._clock = clock
        self._began_s = clock()
        self._progress = Progress("")
        self._stage_began = (self._began_s, 0)
        self._advanced_s = self._began_s
        self._is_over = threading.Event()
        self._writing = threading.Lock()
        self._is_shown = False

    def tell(self, progress: Progress) -> None:
        """Take what it is at; from any thread, at any time."""
        is_another = (progress.stage, progress.of) != (self._progress.stage, self._progress.of)
        if is_another or progress.done != self._progress.done:
            self._advanced_s = self._clock()
        if is_another:
            self._stage_began = (self._advanced_s, progress.done)
        self._progress = progress

    @contextmanager
    def keep_writing(self) -> Iterator[None]:
        """Write from a thread of its own, for what calculates says nothing for seconds now and then."""
        writer = threading.Thread(target=self._write_on, daemon=True)
        writer.start()
        try:
            yield
        finally:
            self._is_over.set()
            writer.join()

    def sentence(self, width: int = 1000) -> str:
        """Return what is shown now: `fitting, 12 s, 40 %, 0:18 left: models and orders: 16 of 40`; where that is wider than the
        terminal, without the task and its seconds, then without the time left."""
        now_s, progress = self._clock(), self._progress
        share = f"{100 * progress.done // progress.of} %" if progress.of else ""
        left, stage = self._time_left(now_s), str(progress) if progress.stage else ""
        heads = [f"{self._task}, {now_s - self._began_s:.0f} s", ""]
        choices = [", ".join(part for part in (head, share, left) if part) for head in heads] + [share]
        sentences = [": ".join(part for part in (choice, stage) if part) for choice in choices]
        return next((one for one in sentences if len(one) <= width), f"{sentences[-1][: width - 1]}…")

    def _time_left(self, now_s: float) -> str:
        """Return what the stage still takes at its present speed, less what the part that is being done has taken, at most as
        long as one takes; nothing before that can be told."""
        began_s, done_then = self._stage_began
        done = self._progress.done - done_then
        if done <= 0 or now_s - began_s < _TOLD_S:
            return ""
        part_s = (self._advanced_s - began_s) / done
        left_s = round(part_s * (self._progress.of - self._progress.done) - min(now_s - self._advanced_s, part_s))
        left_s = max(left_s, 0)
        return f"{left_s // 60}:{left_s % 60:02d} left"

    def clear(self) -> None:
        """Remove the line, for what is printed where it stands; it comes back by itself."""
        with self._writing:
            if self._is_shown:
                self._write(_CLEAR)
                self._is_shown = False

    def _write_on(self) -> None:
        pause_s, told = _QUIET_S, ""
        while not self._is_over.wait(pause_s):
            pause_s = _REWRITTEN_S
            if self._is_terminal:
                width = shutil.get_terminal_size().columns - 1
                with self._writing:
                    self._is_shown = True
                    self._write(f"{_CLEAR}{self.sentence(width)}")
            elif self._progress.stage != told:
                told = self._progress.stage
                self._write(f"{self.sentence()}\n")
        self.clear()

    def _write(self, text: str) -> None:
        """Leave out what would have to wait for a reader: who ends this block waits for the writer."""
        try:
            if not takes_more(self._stream):
                return
            self._stream.write(text)
            self._stream.flush()
        except (OSError, ValueError):  # nobody reads any more
            self._is_over.set()


def takes_more(stream: IO[str], within_s: float = 0.0) -> bool:
    """Decide whether a line can be written at once, or within so many s: not to a full pipe, nor to a terminal that is held
    by Ctrl-S."""
    try:
        poll = select.poll()
        poll.register(stream, select.POLLOUT)
    except (OSError, ValueError, TypeError):  # no file: it is in memory, or closed, which writing tells
        return True
    return bool(poll.poll(round(within_s * 1e3)))


class _AboveLine:
    """A stream that has the line removed before something else stands there, where both are on the terminal."""

    def __init__(self, stream: IO[str], line: ProgressLine) -> None:
        self._stream = stream
        self._line = line

    def write(self, text: str) -> int:
        """Write the text where the line was."""
        if self._stream.isatty():
            self._line.clear()
        return self._stream.write(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextmanager
def _interruptible() -> Iterator[Callable[[], None]]:
    """Give a function that raises KeyboardInterrupt once Ctrl-C was pressed, however long ago.

    Python raises it where it happens to be, and where that is a callback of a library it is swallowed, with a traceback.
    """
    is_pressed = False  # no Event, whose lock a second Ctrl-C would wait for where it interrupts the first one

    def check() -> None:
        if is_pressed:
            raise KeyboardInterrupt

    def on_interrupt(number: int, frame: FrameType | None) -> None:
        nonlocal is_pressed
        is_pressed = True
        raise KeyboardInterrupt

    with handle_interrupt(on_interrupt), _silent_when_swallowed():
        yield check
        check()


@contextmanager
def _silent_when_swallowed() -> Iterator[None]:
    """Print no traceback of a KeyboardInterrupt that a callback has swallowed: what comes next raises it again."""
    before = sys.unraisablehook

    def hook(unraisable: Any) -> None:
        if not isinstance(unraisable.exc_value, KeyboardInterrupt):
            before(unraisable)

    sys.unraisablehook = hook
    try:
        yield
    finally:
        sys.unraisablehook = before


@contextmanager
def handle_interrupt(handler: Callable[[int, FrameType | None], None]) -> Iterator[None]:
    """Have Ctrl-C handled otherwise in this block; nothing changes where it is ignored, or outside of the main thread."""
    if threading.current_thread() is not threading.main_thread() or signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        yield
        return
    before = signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
