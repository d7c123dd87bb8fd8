"""What a handler of a signal sets hangs nowhere, wherever the signal comes in."""

import signal
import sys
import threading
from collections.abc import Iterator
from types import FrameType, SimpleNamespace
from typing import Any

import pytest

from gateway.cli.force_hold.heartbeat import HeartbeatThread
from gateway.cli.force_hold.sequence import HoldRun
from gateway.defaults import REGISTER_MAP
from gateway.profiles import load_register_map

HANG_S = 10.0  # a lock of one's own is waited for without an end


@pytest.fixture
def beat() -> HeartbeatThread:
    client: Any = SimpleNamespace(register_map=load_register_map(REGISTER_MAP))
    return HeartbeatThread(client, HoldRun(1.0, heartbeat=0, resets=False), None, lambda: 0.0)


@pytest.fixture
def no_hang() -> Iterator[None]:
    def hangs(number: int, frame: object) -> None:
        raise AssertionError("it hangs")

    before = signal.signal(signal.SIGALRM, hangs)
    signal.setitimer(signal.ITIMER_REAL, HANG_S)
    yield
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize("name", ["stopping", "dropping"])
@pytest.mark.usefixtures("no_hang")
def test_a_signal_at_any_line_of_the_setting_of_a_flag_does_not_hang(beat: HeartbeatThread, name: str) -> None:
    """The flags were Events: two signals close together, or one at the end of a hold, waited for their own thread's lock."""
    flag, lines = getattr(beat, name), 0

    def at_each_line(frame: FrameType, event: str, argument: object) -> Any:
        nonlocal lines
        if event == "line":
            lines += 1
            signal.raise_signal(signal.SIGUSR1)
        return at_each_line

    handler = signal.signal(signal.SIGUSR1, lambda *_: flag.set())
    tracer = sys.gettrace()
    sys.settrace(at_each_line)
    try:
        flag.set()
    finally:
        sys.settrace(tracer)
        signal.signal(signal.SIGUSR1, handler)
    assert flag.is_set() and lines >= 2


def test_a_flag_wakes_who_waits_and_says_so_to_who_comes_later(beat: HeartbeatThread) -> None:
    woken: list[bool] = []
    waits = threading.Thread(target=lambda: woken.append(beat.dropping.wait(60.0)))
    waits.start()
    beat.dropping.set()
    waits.join(HANG_S)
    assert woken == [True] and beat.dropping.wait(60.0)
    assert not beat.stopping.wait(0.0) and not beat.stopping.is_set()
