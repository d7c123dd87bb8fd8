"""How the guardian waits: for descriptors, and for signals as one of them. Standard library only."""

import contextlib
import select
import signal
import socket
import time
from collections.abc import Callable
from math import isinf
from types import TracebackType
from typing import Final, Self

_SIGNALS: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_STRAY: Final = (
    signal.SIGUSR1,
    signal.SIGUSR2,
    signal.SIGALRM,
    signal.SIGVTALRM,
    signal.SIGPROF,
    signal.SIGPOLL,
    signal.SIGPWR,
    signal.SIGXCPU,
    signal.SIGTSTP,
    signal.SIGTTIN,
    signal.SIGTTOU,
)
"""Mean nothing to us, come from tools that rotate logs, ask other programs to reload or count processor time, and would end who
does not ignore them, without the safe voltage; or stop him (Ctrl-Z, a word from the background): then the force goes on and
nobody watches it. Children inherit it."""
_AT_ONCE_S: Final = 0.05
"""A hand that presses Ctrl-C twice takes longer."""
_LONGEST_S: Final = 3600.0
_MOST_SIGNALS: Final = 64


def wait_readable(descriptors: list[int], timeout_s: float) -> set[int]:
    """Return the descriptors that are readable or at their end; none when the time is over.
    A descriptor may have any number (select: 1024)."""
    poll = select.poll()
    for descriptor in descriptors:
        poll.register(descriptor, select.POLLIN)
    longest_s = _LONGEST_S if isinf(timeout_s) else timeout_s
    return {descriptor for descriptor, _ in poll.poll(max(0.0, longest_s) * 1e3)}


class StopSignals:
    """Tells which of the signals that ask for a stop ask anew. Nobody has asked twice where a terminal closes, whose shell says
    SIGHUP and, when that has ended, the kernel, where a session ends, which says SIGTERM beside it, or where `timeout` tells
    its child and then its group, the child once more. clock: in seconds."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._last, self._last_s = 0, 0.0

    def asks_anew(self, number: int) -> bool:
        """Take the next signal; return whether it is more than what was asked before it."""
        last, last_s = self._last, self._last_s
        self._last, self._last_s = number, self._clock()
        if number == signal.SIGHUP:
            return not last
        return last != signal.SIGHUP and (number != last or self._last_s - last_s > _AT_ONCE_S)


class SignalPipe:
    """SIGINT, SIGTERM and SIGHUP as readable bytes: nothing of ours runs inside a signal handler. Stray signals are ignored,
    and SIGHUP where who starts us ignores it: nohup says that the end of its terminal is not ours.

    Who starts us may have signals blocked (a thread of a Qt or Java program), and that is inherited: nothing but SIGKILL would
    stop us and our children then. Or he ignores the ends of children (`trap '' CHLD`), which is inherited too: the kernel
    keeps no exit code then, and a gateway whose rig file is at fault would be started again and again.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._reader, self._writer = socket.socketpair()
        self._stops = StopSignals(clock)
        for end in (self._reader, self._writer):
            end.setblocking(False)

    @property
    def descriptor(self) -> int:
        """Descriptor that becomes readable when a signal arrives."""
        return self._reader.fileno()

    def take(self) -> int:
        """Return how many stops have been asked for since the last call."""
        with contextlib.suppress(OSError):
            return sum(map(self._stops.asks_anew, self._reader.recv(_MOST_SIGNALS)))
        return 0

    def __enter__(self) -> Self:
        signal.set_wakeup_fd(self._writer.fileno(), warn_on_full_buffer=False)  # first: a handler does nothing
        for number in _SIGNALS:
            if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
                signal.signal(number, lambda *_: None)
        for number in _STRAY:
            signal.signal(number, signal.SIG_IGN)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_SETMASK, ())
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        signal.set_wakeup_fd(-1)
        for number in (*_SIGNALS, *_STRAY):
            signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
        self.close()

    def close(self) -> None:
        """Close both ends."""
        self._reader.close()
        self._writer.close()
