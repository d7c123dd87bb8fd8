"""What ends a verb from outside while the gateway presses for it: Ctrl-C, Ctrl-\\, Ctrl-Z, SIGTERM, a closed terminal (not with
nohup), and whatever else would end or suspend this process: nobody would watch the force then, and without a lease it went on.

All come as KeyboardInterrupt, so that who has begun something stops it, and not at once while a request is under way: one that
is cut in the middle may have begun what nobody would stop.
"""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final

from gateway.service.supervisor.event_wait import StopSignals

_NAMES: Final = (
    *("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP", "SIGABRT", "SIGALRM", "SIGVTALRM", "SIGPROF"),
    *("SIGUSR1", "SIGUSR2", "SIGIO", "SIGPWR", "SIGSTKFLT", "SIGXCPU"),
)
"""SIGABRT: of a C library's own abort Python dies nevertheless. SIGXCPU: `ulimit -t`."""
_ENDING: Final = (
    *(number for number in signal.Signals if number.name in _NAMES),  # a machine other than Linux has fewer
    *range(getattr(signal, "SIGRTMIN", 0), getattr(signal, "SIGRTMAX", -1) + 1),
)


@contextmanager
def signals_as_ctrl_c() -> Iterator[None]:
    """Have every end from outside raise KeyboardInterrupt."""
    with handle_ends(signal.default_int_handler):
        yield


def watch_to_the_end(begin: Callable[[], None], watch: Callable[[], None], stop: Callable[[], None]) -> int:
    """Begin what presses and watch it; return 0 at its end, else the number of the signal that has ended it before: it is
    stopped then. One end may say its signal twice, and the second one, close behind the first, must not take the place of the
    stop."""
    ending = _FirstOfAll()
    with handle_ends(ending):
        try:
            begin()
            ending.raise_from_now_on()
            watch()
        except (KeyboardInterrupt, OSError):  # OSError: the terminal is gone, and nobody sees it any more
            ending.is_raised = False
            stop()
            if ending.count > 1:
                raise KeyboardInterrupt from None
            return ending.number
    return 0


class _FirstOfAll:
    """A handler that raises KeyboardInterrupt at the first signal and counts the others; at none while `is_raised` is false.
    number: of the first signal; that of a closed terminal, which may come as an error alone, before there is one."""

    def __init__(self) -> None:
        self.is_raised, self.count, self.number = False, 0, int(signal.SIGHUP)
        self._stops = StopSignals()

    def __call__(self, number: int, frame: object) -> None:
        if not self._stops.asks_anew(number):
            return
        self.count += 1
        if self.count == 1:
            self.number = number
        if self.is_raised and self.count == 1:
            raise KeyboardInterrupt

    def raise_from_now_on(self) -> None:
        """Raise for the one that has come already, too."""
        self.is_raised = True
        if self.count:
            raise KeyboardInterrupt


@contextmanager
def handle_ends(handler: Callable[[int, Any], Any], always: tuple[int, ...] = ()) -> Iterator[None]:
    """Give every end from outside to this handler, but what was ignored before (nohup, a background job) unless it is one
    of `always`. A job in the background that may not write to its terminal (`stty tostop`) writes: it would be suspended."""
    before = {number: signal.getsignal(number) for number in (*_ENDING, signal.SIGTTOU)}
    for number, own in before.items():
        if number == signal.SIGTTOU:
            signal.signal(number, signal.SIG_IGN)
        elif number in always or own is not signal.SIG_IGN:
            signal.signal(number, handler)
    try:
        yield
    finally:
        for number, own in before.items():
            signal.signal(number, own or signal.SIG_DFL)  # None: a handler of C, such as that of PYTHONDEVMODE
