"""Keys of the terminal that the monitor runs in: one at a time, without Enter, and the terminal as it was afterwards."""

import os
import select
import sys
import termios
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

QUIT: Final = b"qQ"


@contextmanager
def take_single_keys() -> Iterator[bool]:
    """Have keys come one by one in this block; give whether there are any: a monitor may run without a keyboard."""
    if not sys.stdin.isatty():
        yield False
        return
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)
    tty.setcbreak(descriptor)
    try:
        yield True
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


def is_quit_pressed(wait_s: float, *, has_keys: bool) -> bool:
    """Wait; return at once, and True, when q is pressed or the terminal is gone."""
    if not has_keys:
        time.sleep(wait_s)
        return False
    end_s = time.monotonic() + wait_s
    while select.select([sys.stdin.fileno()], [], [], max(0.0, end_s - time.monotonic()))[0]:
        pressed = os.read(sys.stdin.fileno(), 64)
        if not pressed or any(key in QUIT for key in pressed):
            return True
    return False
