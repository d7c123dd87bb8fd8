"""What is said to people: limited per cause, graded by its code, and nobody who does not take it holds up the loop."""

import queue
import threading
from pathlib import Path

import pytest

from gateway.cli.errors import translate_error
from gateway.codes.all_codes import CATALOGUE
from gateway.codes.faults import FaultCode
from gateway.codes.warning_bits import WarningBit
from gateway.processes import event_log
from gateway.processes.event import (
    WARNING_ALARMS,
    EventRecord,
    make_event,
    severity_of,
)
from gateway.processes.event_file import EventFile, EventReader
from gateway.processes.event_log import EventLog

NOON_S = 1_795_348_800.25


class Clock:
    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def kept(directory: Path) -> list[EventRecord]:
    with EventReader(directory) as reader:
        return list(reader.read_stored())


class BlockedTerminal:
    """A terminal that takes nothing until it is released."""

    def __init__(self) -> None:
        self.release = threading.Event()
        self.lines: list[str] = []

    def write(self, line: str) -> None:
        self.release.wait(10)
        self.lines.append(line)


def texts(lines: list[str]) -> list[str]:
    """The sentences alone: `TIME severity cause SENTENCE`."""
    return [line.rstrip("\n").split(maxsplit=3)[3] for line in lines]


def said(clock: Clock, *events: tuple[float, str, str]) -> list[str]:
    lines: list[str] = []
    with EventLog(lines.append, clock, wall=lambda: NOON_S) as log:
        for at_s, cause, sentence in events:
            clock.now_s = at_s
            log(cause, sentence)
    return lines


def test_a_line_has_its_time_in_utc_one_severity_its_cause_its_code_and_the_sentence() -> None:
    lines = said(Clock(), (0.0, "refusal 10.0.0.5 out_of_range", "W204 force_setpoint = 65.00 N"))
    assert lines == ["2026-11-22T12:00:00.250Z warning refusal W204 force_setpoint = 65.00 N\n"]


def test_what_is_said_is_written_in_order() -> None:
    assert texts(said(Clock(), (0.0, "a", "one"), (0.0, "b", "two"), (0.1, "a", "three"))) == ["one", "two", "three"]


def test_ten_lines_a_second_of_a_cause_and_the_rest_is_counted() -> None:
    flood = ((0.001 * index, "flood x", f"W204 line {index}") for index in range(500))
    lines = texts(said(Clock(), *flood, (1.2, "flood x", "W204 after")))
    assert lines[:10] == [f"W204 line {index}" for index in range(10)]
    assert lines[10:] == ["W204 490 more lines of 'flood x' left out", "W204 after"]


def test_a_flood_that_goes_on_has_one_line_a_second_until_it_has_been_calm() -> None:
    flood = [(0.01 * index, "flood", "x") for index in range(600)]
    lines = texts(said(Clock(), *flood, *((7.5 + 0.01 * index, "flood", "y") for index in range(12))))
    told = [line for line in lines if "left out" in line]
    assert told == [
        "90 more lines of 'flood' left out",
        *["99 more lines of 'flood' left out"] * 5,
        "2 more lines of 'flood' left out",
    ]
    assert lines.count("x") == 10 + 5
    assert lines.count("y") == 10


def test_a_flood_that_has_ended_is_counted_too() -> None:
    assert texts(said(Clock(), *((0.0, "flood", "x") for _ in range(25))))[10:] == ["15 more lines of 'flood' left out"]


def test_a_flood_of_one_cause_does_not_hide_another() -> None:
    lines = texts(said(Clock(), *((0.0, "flood", "x") for _ in range(100)), (0.0, "fault", "A303 three times")))
    assert lines[10] == "A303 three times"


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


@pytest.mark.parametrize("others_s", [0.5, 1.5], ids=["in the same second", "later"])
def test_what_was_left_out_is_told_however_many_causes_come_behind_it(
    monkeypatch: pytest.MonkeyPatch, others_s: float
) -> None:
    monkeypatch.setattr(event_log, "_MOST_CAUSES", 20)
    others = ((others_s, f"refusal 10.0.0.1:{index}", "other") for index in range(50))
    lines = texts(said(Clock(), *((0.0, "flood", "x") for _ in range(25)), *others))
    assert [line for line in lines if line not in ("x", "other")] == ["15 more lines of 'flood' left out"]
    assert lines.count("x") == 10 and lines.count("other") == 50


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
        log._terminal._events.put(None, timeout=1.0)  # the writer was left behind: it ends now
    except queue.Full:
        pass
    log._terminal._thread.join(3)
    return found


def test_a_terminal_that_takes_nothing_holds_up_neither_the_caller_nor_the_end_nor_the_file(tmp_path: Path) -> None:
    terminal = BlockedTerminal()
    said, left = flooded(EventLog(terminal.write, file=EventFile(tmp_path)), terminal)
    assert said, "the caller waits for the terminal"
    assert left, "leaving the log waits for the terminal"
    assert 1 <= len(terminal.lines) <= 1001
    assert len(kept(tmp_path)) >= 1000


def test_what_did_not_fit_is_counted_where_it_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A terminal that was held up: the last of what it shows is followed by how much it does not."""
    monkeypatch.setattr(event_log, "_LONGEST_QUEUE", 5)
    lines: list[str] = []
    log = EventLog(lines.append)
    for index in range(8):
        log(f"cause {index}", f"line {index}")
    assert log._terminal._events.qsize() == 5
    log._terminal._events.get_nowait()
    log("cause 8", "line 8")
    assert log._terminal._events.qsize() == 4, "the count takes no event's place"
    log._terminal._events.get_nowait()
    log("cause 9", "line 9")
    with log:
        pass
    assert texts(lines)[3:] == ["4 more lines left out: those before them were not written yet", "line 9"]


def test_what_did_not_fit_until_the_end_is_counted_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(event_log, "_LONGEST_QUEUE", 5)
    lines: list[str] = []
    log = EventLog(lines.append)
    for index in range(8):
        log(f"cause {index}", f"line {index}")
    with log:
        pass
    assert texts(lines)[5:] == ["3 more lines left out: those before them were not written yet"]


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
    assert not log._terminal.is_alive


# -- severity


@pytest.mark.parametrize(
    ("sentence", "severity", "code", "text"),
    [
        ("W204 too much", "warning", "W204", "too much"),
        ("A313 too much force", "error", "A313", "too much force"),
        ("E402 the disk is full", "error", "E402", "the disk is full"),
        ("A345 friction", "warning", "A345", "friction"),
        ("enabled by 10.0.0.5, error, fault", "info", None, "enabled by 10.0.0.5, error, fault"),
        ("A31 and W2040 are no codes", "info", None, "A31 and W2040 are no codes"),
        ("", "info", None, ""),
    ],
)
def test_the_code_alone_decides_the_severity(sentence: str, severity: str, code: str | None, text: str) -> None:
    assert make_event(NOON_S, "control", "x y", sentence)[1:] == (severity, code, "x", text, "control")


def test_every_fault_is_an_error_and_every_refusal_a_warning() -> None:
    assert {severity_of(fault.code) for fault in FaultCode if fault} == {"error"}
    assert {severity_of(code) for code in CATALOGUE if code[0] == "W"} == {"warning"}
    assert {severity_of(code) for code in CATALOGUE if code[0] == "E"} == {"error"}


def test_alarms_that_are_only_warnings_are_those_of_the_catalogue() -> None:
    alarms = {bit.code for bit in WarningBit if bit.code.startswith("A")}  # of the others the letter says so
    only_warnings = alarms - {fault.code for fault in FaultCode} - {"A401"}
    assert only_warnings <= WARNING_ALARMS <= set(CATALOGUE)


def test_what_was_left_out_is_told_once_however_often_it_is_looked_at() -> None:
    clock, lines = Clock(), list[str]()
    with EventLog(lines.append, clock) as log:
        for _ in range(25):
            log("flood", "x")
        for clock.now_s in (1.1, 1.2, 1.9):
            log._tell_left_out()
    assert texts(lines)[10:] == ["15 more lines of 'flood' left out"]


def test_a_machine_that_refuses_a_thread_is_a_refusal_in_words(monkeypatch: pytest.MonkeyPatch) -> None:
    """`run` called it an internal error, and asked for a report."""

    def refuse(thread: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", refuse)
    with pytest.raises(OSError, match="no thread for the log: can't start new thread; too few processes") as refused:
        EventLog().__enter__()
    told = translate_error(refused.value, "run demo", debug=False).format_message()
    assert told.startswith("E106 no thread for the log") and "internal error" not in told
