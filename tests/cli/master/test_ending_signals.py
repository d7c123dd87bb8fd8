"""What ends a verb from outside: as Ctrl-C, not within a request, and what nohup has shut out not at all."""

import signal
from collections.abc import Iterator
from typing import Any

import pytest

from gateway.cli.master.ending_signals import signals_as_ctrl_c, watch_to_the_end

ENDING = (
    *(signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP, signal.SIGABRT, signal.SIGALRM),
    *(signal.SIGVTALRM, signal.SIGPROF, signal.SIGUSR1, signal.SIGUSR2, signal.SIGPOLL, signal.SIGPWR, signal.SIGXCPU),
    *(signal.SIGSTKFLT, int(signal.SIGRTMIN), int(signal.SIGRTMAX)),
)


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    """Each test begins with signals that are heard, also in a run under nohup."""
    before = {number: signal.signal(number, signal.SIG_DFL) for number in ENDING}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", ENDING)
def test_every_end_from_outside_comes_as_ctrl_c_and_is_then_as_it_was(number: int) -> None:
    before = signal.getsignal(number)
    with pytest.raises(KeyboardInterrupt), signals_as_ctrl_c():
        signal.raise_signal(number)
    assert signal.getsignal(number) == before


@pytest.mark.parametrize("number", ENDING)
def test_a_request_that_is_under_way_is_ended_behind_it(number: int) -> None:
    done: list[str] = []

    def begin() -> None:
        signal.raise_signal(number)
        done.append("request")

    assert watch_to_the_end(begin, lambda: done.append("watched"), lambda: done.append("stopped")) == number
    assert done == ["request", "stopped"]


@pytest.mark.parametrize("number", ENDING)
def test_a_signal_that_is_said_twice_does_not_take_the_place_of_the_stop(
    number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`timeout`, and a terminal that closes, say it again at once: in 3 of 60 runs it came while the stop was prepared, nothing
    was stopped, and the tool went on pressing."""
    done: list[str] = []
    act = signal.signal

    def watch() -> None:
        monkeypatch.setattr(signal, "signal", again)
        signal.raise_signal(number)

    def again(handled: int, handler: Any) -> Any:
        monkeypatch.setattr(signal, "signal", act)
        signal.raise_signal(number)
        return act(handled, handler)

    assert watch_to_the_end(lambda: None, watch, lambda: done.append("stopped")) == number
    assert done == ["stopped"]


def test_what_was_ignored_before_stays_so() -> None:
    """nohup, and a job in the background, whose Ctrl-C is for others."""
    done: list[str] = []
    signal.signal(signal.SIGHUP, signal.SIG_IGN)

    def go_on(what: str) -> None:
        signal.raise_signal(signal.SIGHUP)
        done.append(what)

    with signals_as_ctrl_c():
        assert not watch_to_the_end(lambda: go_on("request"), lambda: go_on("watched"), lambda: done.append("stopped"))
        go_on("what goes on")
    assert done == ["request", "watched", "what goes on"]


def test_a_job_in_the_background_may_write_to_its_terminal() -> None:
    """Where that is forbidden (`stty tostop`) it was suspended, and the tool pressed on."""
    with signals_as_ctrl_c():
        assert signal.getsignal(signal.SIGTTOU) is signal.SIG_IGN
    assert signal.getsignal(signal.SIGTTOU) is signal.SIG_DFL


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

    assert watch_to_the_end(lambda: None, watch, lambda: done.append("stopped")) == signal.SIGHUP
    assert not watch_to_the_end(lambda: None, lambda: None, lambda: done.append("stopped again"))
    assert done == ["stopped"]
