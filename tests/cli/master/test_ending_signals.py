"""What ends a verb from outside: as Ctrl-C, not within a request, and what nohup has shut out not at all."""

import contextlib
import signal
from collections.abc import Iterator

import pytest

from gateway.cli.master.ending_signals import signals_as_ctrl_c, signals_held_back, watch_to_the_end

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    before = {number: signal.getsignal(number) for number in ENDING}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", ENDING)
def test_every_end_from_outside_comes_as_ctrl_c_and_is_then_as_it_was(number: signal.Signals) -> None:
    before = signal.getsignal(number)
    with pytest.raises(KeyboardInterrupt), signals_as_ctrl_c():
        signal.raise_signal(number)
    assert signal.getsignal(number) == before


@pytest.mark.parametrize("number", ENDING)
def test_a_request_that_is_under_way_is_ended_behind_it(number: signal.Signals) -> None:
    done = []
    with pytest.raises(KeyboardInterrupt), signals_held_back():
        signal.raise_signal(number)
        done.append("request")
    assert done == ["request"]


def test_what_was_ignored_before_stays_so() -> None:
    """nohup, and a job in the background, whose Ctrl-C is for others."""
    done = []
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    with contextlib.suppress(KeyboardInterrupt), signals_as_ctrl_c(), signals_held_back():
        signal.raise_signal(signal.SIGHUP)
        done.append("request")
    assert done == ["request"]
    with contextlib.suppress(KeyboardInterrupt), signals_as_ctrl_c():
        signal.raise_signal(signal.SIGHUP)
        done.append("what goes on")
    assert done == ["request", "what goes on"]


def test_neither_the_beginning_nor_the_stop_is_cut_in_the_middle() -> None:
    done = []

    def begin() -> None:
        signal.raise_signal(signal.SIGTERM)
        done.append("begun")

    def stop() -> None:
        signal.raise_signal(signal.SIGINT)  # somebody is impatient
        done.append("stopped")

    with pytest.raises(KeyboardInterrupt):
        watch_to_the_end(begin, lambda: done.append("watched"), stop)
    assert done == ["begun", "stopped"]


def test_a_terminal_that_is_gone_ends_what_presses_and_an_end_of_its_own_stops_nothing() -> None:
    done = []

    def watch() -> None:
        raise OSError

    assert not watch_to_the_end(lambda: None, watch, lambda: done.append("stopped"))
    assert watch_to_the_end(lambda: None, lambda: None, lambda: done.append("stopped again"))
    assert done == ["stopped"]
