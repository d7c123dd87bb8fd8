"""Which signals end a held force."""

import os
import signal
import threading
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.cli.verbs.operation.hold import _handle_signals


@pytest.mark.parametrize(("is_ignored", "stops"), [(False, True), (True, False)])
def test_a_closed_terminal_ends_a_hold_unless_nohup_says_otherwise(is_ignored: bool, stops: bool) -> None:
    beat: Any = SimpleNamespace(stopping=threading.Event(), dropping=threading.Event())
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


@pytest.mark.parametrize(("is_ignored", "stops"), [(False, True), (True, False)])
def test_a_hold_that_would_be_suspended_lets_go_instead(is_ignored: bool, stops: bool) -> None:
    """Behind Ctrl-Z the tool pressed on, where the rig has no lease, and nobody watched it; with one it was a fault A310."""
    beat: Any = SimpleNamespace(stopping=threading.Event(), dropping=threading.Event())
    suspended = threading.Event()
    handler = signal.SIG_IGN if is_ignored else lambda number, frame: suspended.set()
    before = signal.signal(signal.SIGTSTP, handler)
    try:
        with _handle_signals(beat):
            os.kill(os.getpid(), signal.SIGTSTP)
            assert (beat.stopping.is_set(), beat.dropping.is_set(), suspended.is_set()) == (stops, False, False)
        assert signal.getsignal(signal.SIGTSTP) is handler
    finally:
        signal.signal(signal.SIGTSTP, before)
