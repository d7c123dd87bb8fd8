"""How far a long calculation is, on stderr from its first second on: one line that is rewritten on a terminal, else a line
now and then; and a Ctrl-C that ends it wherever it is."""

import shutil
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import IO, Any, Final

from gateway.progress import Progress, listen

_QUIET_S: Final = 1.0  # what is shorter needs no words
_REWRITTEN_S: Final = 0.2
_NOW_AND_THEN_S: Final = 5.0
_CLEAR: Final = "\r\x1b[2K"


@contextmanager
def show_progress(task: str) -> Iterator[None]:
    """Show what the calculation in this block reports. task: what it does, in a word. KeyboardInterrupt at Ctrl-C."""
    line = ProgressLine(task, sys.stderr)
    with _interruptible() as check, line.keep_writing():

        def show(progress: Progress) -> None:
            check()
            line.text = str(progress)

        with listen(show):
            yield


class ProgressLine:
    """Writes the newest text beside the task and its seconds. text: what it is at; may be set at any time."""

    def __init__(self, task: str, stream: IO[str], clock: Callable[[], float] = time.monotonic) -> None:
        self.text = ""
        self._task = task
        self._stream = stream
        self._is_terminal = stream.isatty()
        self._clock = clock
        self._began_s = clock()
        self._is_over = threading.Event()

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

    def sentence(self) -> str:
        """Return what is shown now."""
        spent_s = self._clock() - self._began_s
        return f"{self._task}, {spent_s:.0f} s" + (f": {self.text}" if self.text else "")

    def _write_on(self) -> None:
        pause_s, is_written = _QUIET_S, False
        while not self._is_over.wait(pause_s):
            if self._is_terminal:
                width = shutil.get_terminal_size().columns - 1
                self._write(f"{_CLEAR}{self.sentence()[:width]}")
            else:
                self._write(f"{self.sentence()}\n")
            pause_s, is_written = _REWRITTEN_S if self._is_terminal else _NOW_AND_THEN_S, True
        if is_written and self._is_terminal:
            self._write(_CLEAR)

    def _write(self, text: str) -> None:
        try:
            self._stream.write(text)
            self._stream.flush()
        except (OSError, ValueError):  # nobody reads any more
            self._is_over.set()


@contextmanager
def _interruptible() -> Iterator[Callable[[], None]]:
    """Give a function that raises KeyboardInterrupt once Ctrl-C was pressed, however long ago.

    Python raises it where it happens to be, and where that is a callback of a library it is swallowed, with a traceback.
    """
    pressed = threading.Event()

    def check() -> None:
        if pressed.is_set():
            raise KeyboardInterrupt

    def on_interrupt(number: int, frame: FrameType | None) -> None:
        pressed.set()
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
