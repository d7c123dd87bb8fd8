"""Signals of the guardian: what stops it arrives as bytes; what means nothing to it ends neither it nor its children."""

import os
import select
import signal
import subprocess
import sys
from math import inf
from types import SimpleNamespace

import pytest

from gateway.service.supervisor.event_wait import SignalPipe, wait_readable

_STRAY = ("SIGUSR1", "SIGUSR2", "SIGALRM", "SIGVTALRM", "SIGPROF", "SIGPOLL", "SIGPWR", "SIGXCPU")
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


def test_every_stray_signal_is_ignored_and_none_is_a_stop(as_at_start):
    """Each of them in every run: of those below, whose children cost time, a push takes some."""
    with SignalPipe() as signals:
        for number in map(signal.Signals.__getitem__, _STRAY + _STOPS):
            assert signal.getsignal(number) is signal.SIG_IGN, f"{number.name} would end or stop this test run"
            os.kill(os.getpid(), number)
        assert signals.take() == 0


@pytest.mark.sampled
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


def test_the_exit_code_of_a_child_is_heard_where_who_started_us_ignores_the_ends_of_his():
    """Control said that the rig file is at fault, by its exit code, and was started again five times for it."""
    before = signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    try:
        with SignalPipe():
            pid = os.posix_spawn(sys.executable, [sys.executable, "-S", "-c", "raise SystemExit(78)"], os.environ)
            assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 78
    finally:
        signal.signal(signal.SIGCHLD, before)


def test_a_stop_that_comes_while_signals_begin_to_be_heard_is_heard(monkeypatch):
    """Between the handler, which does nothing, and the pipe it was swallowed: `systemctl stop` right behind a start waited for
    its own time-out."""
    act = signal.signal

    def handled(number, handler):
        before = act(number, handler)
        if number == signal.SIGTERM:
            os.kill(os.getpid(), number)
        return before

    with monkeypatch.context() as patch:
        patch.setattr(signal, "signal", handled)
        signals = SignalPipe().__enter__()
    assert signals.take() == 1
    signals.__exit__(None, None, None)


def test_two_signals_at_once_are_two():
    """The second one says that nothing is to be waited for."""
    with SignalPipe() as signals:
        os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGTERM)
        assert signals.take() == 2
        assert signals.take() == 0
    assert signal.set_wakeup_fd(-1) == -1, "its end of the pipe is closed: nothing is written there any more"


HUP, INT, TERM = signal.SIGHUP, signal.SIGINT, signal.SIGTERM


@pytest.mark.parametrize(
    ("numbers", "apart_s"),
    [((HUP, HUP), 1.0), ((HUP, TERM, HUP), 1.0), ((TERM, HUP, HUP), 1.0), ((TERM, TERM), 0.02), ((INT, INT), 0.02)],
)
def test_what_is_said_more_than_once_by_one_end_asks_once(numbers, apart_s):
    """A terminal that closes, a session that ends, `timeout`: what came second skipped the ramp, and the force fell at once."""
    now_s = 100.0
    with SignalPipe(lambda: now_s) as signals:
        heard = 0
        for number in numbers:
            now_s += apart_s
            os.kill(os.getpid(), number)
            heard += signals.take()
        assert heard == 1
        for _ in range(2):
            now_s += 0.1
            os.kill(os.getpid(), INT)
            heard += signals.take()
        assert heard >= 2, "whoever asks again waits for nothing"


def test_who_is_started_in_the_background_hears_what_stops_it():
    """A shell ignores SIGINT for a job that it starts with &; only nohup's word counts."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with SignalPipe() as signals:
            os.kill(os.getpid(), signal.SIGINT)
            assert signals.take() == 1
    finally:
        signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("timeout_s", [-1.0, -1e-9, 0.0, inf, 1e9])
def test_a_wait_is_never_without_an_end(timeout_s, monkeypatch):
    """For poll a negative time is for ever, and there is a longest one."""
    asked = []
    poll = SimpleNamespace(register=lambda *_: None, poll=lambda ms: asked.append(ms) or [])
    monkeypatch.setattr(select, "poll", lambda: poll)
    assert wait_readable([0], timeout_s) == set()
    assert 0.0 <= asked[0] < inf
