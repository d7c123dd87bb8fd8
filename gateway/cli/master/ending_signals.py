"""What ends a verb from outside while the gateway presses for it: Ctrl-C, SIGTERM, a closed terminal (not with nohup).

All come as KeyboardInterrupt, so that who has begun something stops it, and not at once while a request is under way: one that
is cut in the middle may have begun what nobody would stop.
"""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final

_ENDING: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def signals_as_ctrl_c() -> Iterator[None]:
    """Have every end from outside raise KeyboardInterrupt."""
    with _handled_by(signal.default_int_handler):
        yield


@contextmanager
def signals_held_back() -> Iterator[None]:
    """Let nothing from outside end the block, but KeyboardInterrupt right behind it."""
    heard: list[int] = []
    with _handled_by(lambda number, frame: heard.append(number)):
        yield
    if heard:
        raise KeyboardInterrupt


def watch_to_the_end(begin: Callable[[], None], watch: Callable[[], None], stop: Callable[[], None]) -> bool:
    """Begin what presses and watch it; False where something from outside has ended that before: it is stopped then."""
    with signals_as_ctrl_c():
        try:
            with signals_held_back():
                begin()
            watch()
        except (KeyboardInterrupt, OSError):  # OSError: the terminal is gone, and nobody sees it any more
            with signals_held_back():
                stop()
            return False
    return True


@contextmanager
def _handled_by(handler: Callable[[int, Any], Any]) -> Iterator[None]:
    before = {number: signal.getsignal(number) for number in _ENDING}
    heard = [number for number, own in before.items() if own is not signal.SIG_IGN]  # nohup, a job in the background
    for number in heard:
        signal.signal(number, handler)
    try:
        yield
    finally:
        for number in heard:
            signal.signal(number, before[number])
