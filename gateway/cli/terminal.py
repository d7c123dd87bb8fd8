"""What the terminal can do."""

import os
from typing import IO


def can_write_over(stream: IO[str]) -> bool:
    """Decide whether a line can be drawn over the one before it: a dumb terminal (in Emacs) shows the orders to do so."""
    return stream.isatty() and os.environ.get("TERM") != "dumb"
