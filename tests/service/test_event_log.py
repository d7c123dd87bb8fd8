"""Sentences for people: limited per cause, and nobody who does not read them can hold up the loop."""

import queue
import threading

import pytest

from gateway.service.event_log import EventLog


class Clock:
    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


class BlockedTerminal:
    """A terminal that takes nothing until it is released."""

    def __init__(self) -> None:
        self.release = threading.Event()
        self.lines: list[str] = []

    def write(self, line: str) -> None:
        self.release.wait(10)
        self.lines.append(line)


def said(clock: Clock, *events: tuple[float, str, str]) -> list[str]:
    lines: list[str] = []
    with EventLog(lines.append, clock) as log:
        for at_s, cause, sentence in events:
            clock.now_s = at_s
            log(cause, sentence)
    return lines


def test_what_is_said_is_written_in_order() -> None:
    assert said(Clock(), (0.0, "a", "one"), (0.0, "b", "two"), (0.1, "a", "three")) == ["one\n", "two\n", "three\n"]


def test_ten_lines_a_second_of_a_cause_and_the_rest_is_counted() -> None:
    lines = said(Clock(), *((0.001 * index, "flood", f"line {index}") for index in range(500)), (1.2, "flood", "after"))
    assert lines[:10] == [f"line {index}\n" for index in range(10)]
    assert lines[10:] == ["... 490 more lines of 'flood' left out\n", "after\n"]


def test_a_flood_of_one_cause_does_not_hide_another() -> None:
    lines = said(Clock(), *((0.0, "flood", "x") for _ in range(100)), (0.0, "fault", "A303"))
    assert lines[-1] == "A303\n"


def test_eleven_lines_in_eleven_tenths_of_a_second_are_all_written() -> None:
    assert len(said(Clock(), *((0.11 * index, "calm", "x") for index in range(11)))) == 11


def test_ever_new_causes_need_no_more_memory() -> None:
    """I12: a client that comes back with a new port for each refusal is still one client with one memory."""
    clock, log = Clock(), EventLog(lambda line: None)
    log._clock = clock
    for index in range(20_000):
        clock.now_s = 0.01 * index
        log(f"refusal 10.0.0.1:{index}", "W204")
    assert len(log._windows) <= 2000
    with log:
        pass


def flooded(log: EventLog, terminal: BlockedTerminal) -> tuple[bool, bool]:
    """Says more than the queue holds, in a thread of its own: whether saying it came to an end, and leaving the log."""
    said, left = threading.Event(), threading.Event()

    def scene() -> None:
        with log:
            for index in range(5000):
                log(f"cause {index}", "sentence")
            said.set()
        left.set()

    thread = threading.Thread(target=scene, daemon=True)
    thread.start()
    found = said.wait(3), left.wait(3)
    terminal.release.set()
    thread.join(3)
    try:
        log._lines.put(None, timeout=1.0)  # the writer was left behind: it ends now
    except queue.Full:
        pass
    log._thread.join(3)
    return found


def test_a_terminal_that_takes_nothing_holds_up_neither_the_caller_nor_the_end() -> None:
    terminal = BlockedTerminal()
    said, left = flooded(EventLog(terminal.write), terminal)
    assert said, "the caller waits for the terminal"
    assert left, "leaving the log waits for the terminal"
    assert 1 <= len(terminal.lines) <= 1001


@pytest.mark.parametrize("error", [BrokenPipeError(), ValueError("I/O operation on closed file")])
def test_a_terminal_that_went_away_stops_nothing(error: Exception) -> None:
    tried: list[str] = []

    def gone(line: str) -> None:
        tried.append(line)
        raise error

    with EventLog(gone) as log:
        for index in range(3000):
            log(f"cause {index}", "sentence")
    assert len(tried) > 1, "the writer ended with the first error"
    assert not log._thread.is_alive()
