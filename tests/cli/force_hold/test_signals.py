"""Which signals end a held force."""

import os
import signal
import subprocess
import sys
import threading
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.cli.verbs.operation.hold import _handle_signals


@pytest.mark.parametrize(("is_ignored", "stops"), [(False, True), (True, False)])
def test_a_closed_terminal_ends_a_hold_unless_nohup_says_otherwise(is_ignored: bool, stops: bool) -> None:
    beat: Any = SimpleNamespace(stopping=threading.Event(), dropping=threading.Event(), is_alive=lambda: True)
    handler = signal.SIG_IGN if is_ignored else signal.SIG_DFL
    before = signal.signal(signal.SIGHUP, handler)
    try:
        with _handle_signals(beat):
            os.kill(os.getpid(), signal.SIGHUP)
            assert beat.stopping.is_set() == stops
            os.kill(os.getpid(), signal.SIGTERM)
            os.kill(os.getpid(), signal.SIGINT)
            assert beat.stopping.is_set() and beat.dropping.is_set()
        assert signal.getsignal(signal.SIGHUP) is handler
    finally:
        signal.signal(signal.SIGHUP, before)


HARMLESS = {signal.SIGCHLD, signal.SIGCONT, signal.SIGURG, signal.SIGWINCH}
DEFECTS = {signal.SIGSEGV, signal.SIGBUS, signal.SIGFPE, signal.SIGILL, signal.SIGTRAP, signal.SIGSYS}
OWN = {signal.SIGHUP, signal.SIGINT, signal.SIGTERM, signal.SIGTTIN, signal.SIGTTOU}  # other tests
IGNORED_BY_PYTHON = {signal.SIGPIPE, signal.SIGXFSZ}
OTHERS = signal.valid_signals() - HARMLESS - DEFECTS - OWN - IGNORED_BY_PYTHON - {signal.SIGKILL, signal.SIGSTOP}


@pytest.mark.parametrize("number", sorted(OTHERS))
@pytest.mark.parametrize(("is_ignored", "stops"), [(False, True), (True, False)])
def test_a_hold_that_would_be_suspended_or_killed_lets_go_instead(is_ignored: bool, stops: bool, number: int) -> None:
    """Behind Ctrl-Z, Ctrl-\\, the end of `ulimit -t` and the signal of a timer or a stranger the tool pressed on, where the rig
    has no lease, and nobody watched it; with one it was a fault A310."""
    beat: Any = SimpleNamespace(stopping=threading.Event(), dropping=threading.Event(), is_alive=lambda: True)
    suspended = threading.Event()
    handler = signal.SIG_IGN if is_ignored else lambda *_: suspended.set()
    before = signal.signal(number, handler)
    try:
        with _handle_signals(beat):
            os.kill(os.getpid(), number)
            assert (beat.stopping.is_set(), beat.dropping.is_set(), suspended.is_set()) == (stops, False, False)
        assert signal.getsignal(number) is handler
    finally:
        signal.signal(number, before)


SHOWING = """
import os, threading
from types import SimpleNamespace
from gateway.cli.verbs.operation.hold import _handle_signals
beat = SimpleNamespace(stopping=threading.Event(), dropping=threading.Event(), is_alive=lambda: False)
beat.stopping.set()
reader, writer = os.pipe()
with _handle_signals(beat):
    print("here", flush=True)
    while True:
        os.write(writer, bytes(4096))
"""


def test_once_the_force_is_let_go_a_signal_ends_what_nobody_reads() -> None:
    """A pipe whose reader is paused: neither Ctrl-C nor SIGTERM ended it any more. Takes half a second: a process."""
    with subprocess.Popen([sys.executable, "-c", SHOWING], stdout=subprocess.PIPE) as holding:
        try:
            assert holding.stdout and holding.stdout.readline() == b"here\n"
            holding.send_signal(signal.SIGTERM)
            assert holding.wait(5.0) == -signal.SIGTERM
        finally:
            holding.kill()
