"""How the guardian waits: for descriptors, and for signals as one of them. Standard library only."""

import contextlib
import select
import signal
import socket
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
    signal.SIGTSTP,
    signal.SIGTTIN,
    signal.SIGTTOU,
)
"""Mean nothing to us, come from tools that rotate logs or ask other programs to reload, and would end who does not ignore them,
without the safe voltage; or stop him (Ctrl-Z, a word from the background): then the force goes on and nobody watches it.
Children inherit it."""
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


class SignalPipe:
    """SIGINT, SIGTERM and SIGHUP as readable bytes: nothing of ours runs inside a signal handler. Stray signals are ignored,
    and SIGHUP where who starts us ignores it: nohup says that the end of its terminal is not ours.

    Who starts us may have signals blocked (a thread of a Qt or Java program), and that is inherited: nothing but SIGKILL would
    stop us and our children then. Or he ignores the ends of children (`trap '' CHLD`), which is inherited too: the kernel
    keeps no exit code then, and a gateway whose rig file is at fault would be started again and again.

    A terminal that closes says SIGHUP twice, by its shell and, when that has ended, by the kernel; the end of a session says
    SIGTERM beside it. Nobody has asked twice then, so SIGHUP counts as the first of the others does, and never beside it.
    """

    def __init__(self) -> None:
        self._reader, self._writer = socket.socketpair()
        self._asked = self._told = 0
        for end in (self._reader, self._writer):
            end.setblocking(False)

    @property
    def descriptor(self) -> int:
        """Descriptor that becomes readable when a signal arrives."""
        return self._reader.fileno()

    def take(self) -> int:
        """Return how many stops have been asked for since the last call."""
        numbers, before = b"", self._told
        with contextlib.suppress(OSError):
            numbers = self._reader.recv(_MOST_SIGNALS)
        self._asked += len(numbers) - numbers.count(signal.SIGHUP)
        self._told = max(self._asked, before, int(signal.SIGHUP in numbers))
        return self._told - before

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
