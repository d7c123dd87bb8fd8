"""Signals of the guardian: what stops it arrives as bytes; what means nothing to it ends neither it nor its children."""

import os
import signal
import subprocess
import sys

import pytest

from gateway.service.supervisor.event_wait import SignalPipe

_STRAY = ("SIGUSR1", "SIGUSR2", "SIGALRM", "SIGVTALRM", "SIGPROF", "SIGPOLL", "SIGPWR")
_STOPS = ("SIGTSTP", "SIGTTIN", "SIGTTOU")
_SURVIVOR = "import os, signal, sys; os.kill(os.getpid(), int(sys.argv[1])); print('alive')"


@pytest.fixture
def as_at_start():
    """An interpreter of its own may come with any of them ignored: begin with what the kernel does."""
    numbers = [signal.Signals[name] for name in _STRAY + _STOPS]
    before = {number: signal.signal(number, signal.SIG_DFL) for number in numbers}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("name", _STRAY + _STOPS)
def test_a_stray_signal_ends_neither_the_guardian_nor_its_children(as_at_start, name):
    number = signal.Signals[name]
    with SignalPipe() as signals:
        assert signal.getsignal(number) is signal.SIG_IGN, "else the next line would end this test run"
        os.kill(os.getpid(), number)
        child = subprocess.run(
            [sys.executable, "-S", "-c", _SURVIVOR, str(int(number))], capture_output=True, text=True
        )
        assert (child.returncode, child.stdout) == (0, "alive\n")
        assert signals.take() == 0, "nobody asked for a stop"
    assert signal.getsignal(number) is signal.SIG_DFL


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_that_asks_for_a_stop_is_one_byte(number):
    with SignalPipe() as signals:
        os.kill(os.getpid(), number)
        assert signals.take() == 1


def test_the_end_of_a_terminal_is_not_ours_where_nohup_says_so():
    """The guardian took the signal that nohup has ignored: whoever logged out ended the gateway."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with SignalPipe() as signals:
            os.kill(os.getpid(), signal.SIGHUP)
            assert signals.take() == 0
    finally:
        signal.signal(signal.SIGHUP, before)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_that_who_started_us_had_blocked_is_heard(number):
    before = signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
    try:
        with SignalPipe() as signals:
            os.kill(os.getpid(), number)
            assert signals.take() == 1
            assert signal.pthread_sigmask(signal.SIG_BLOCK, ()) == set(), "children inherit it"
    finally:
        handler = signal.signal(number, signal.SIG_IGN)  # one that still waits is dropped, and ends no test run
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        signal.signal(number, handler)
