"""The whole terminal as a page that is drawn again and again: only lines that have changed are put into colours and written.

Of rich's own live display a frame cost more than all else the monitor does; here most lines of a frame cost a comparison.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.text import Text


class Screen:
    """Shows lines from the terminal's top; it remembers what is there."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._shown: list[Text] = []
        self._size = (0, 0)

    @contextmanager
    def open(self) -> Iterator[None]:
        """Take the terminal in this block; it is as before afterwards, cursor and all."""
        self._console.set_alt_screen(True)
        self._console.show_cursor(False)
        try:
            yield
        finally:
            self._console.set_alt_screen(False)
            self._console.show_cursor(True)

    def show(self, lines: Sequence[Text], size: tuple[int, int]) -> None:
        """Show these lines to the terminal, which has this many columns and rows."""
        begin = ""
        if size != self._size:
            self._shown, self._size, begin = [], size, "\x1b[2J"
        lines = lines[: size[1]]
        changed = [at for at, line in enumerate(lines) if at >= len(self._shown) or line != self._shown[at]]
        words = [f"\x1b[{at + 1};1H{self._colour(lines[at])}\x1b[K" for at in changed]
        end = f"\x1b[{len(lines) + 1};1H\x1b[J" if len(self._shown) > len(lines) else ""
        self._shown = list(lines)
        if text := begin + "".join(words) + end:
            self._console.file.write(text)
            self._console.file.flush()

    def _colour(self, line: Text) -> str:
        with self._console.capture() as captured:
            self._console.print(line, end="", soft_wrap=True)
        return captured.get()
