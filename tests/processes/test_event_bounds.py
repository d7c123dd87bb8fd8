"""What is left out of a log and counted, and what is read of a file that gets another name meanwhile."""

import fcntl
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from gateway.processes import event_log
from gateway.processes.event import EventRecord, encode_event, make_event
from gateway.processes.event_file import KEPT, NAME, EventFile, EventReader
from gateway.processes.event_log import EventLog
from tests.processes.test_event_log import Clock, texts


def line(text: str) -> bytes:
    return encode_event(make_event(0.0, "control", "cause", text))


class Terminal:
    """A log on a clock of its own, and what came to the terminal until it was left."""

    def __init__(self) -> None:
        self.clock, self.lines = Clock(), list[str]()
        self.log = EventLog(self.lines.append, self.clock)

    def say(self, at_s: float, *causes: str) -> None:
        self.clock.now_s = at_s
        for cause in causes:
            self.log(cause, cause)

    def look(self, at_s: float) -> None:
        """The round that the writer makes when nothing has come for a second."""
        self.clock.now_s = at_s
        self.log._tell_left_out()

    def said(self) -> list[str]:
        with self.log:
            pass
        return texts(self.lines)


def test_what_is_left_out_of_a_second_is_counted_when_it_is_over() -> None:
    """However often somebody looks before."""
    terminal = Terminal()
    terminal.say(0.0, *["x"] * 15)
    terminal.look(0.5)
    terminal.say(0.9, *["x"] * 10)
    terminal.look(1.1)
    assert terminal.said()[10:] == ["15 more lines of 'x' left out"]


def test_a_flood_is_still_one_in_the_next_second_whoever_looked_between_and_forgotten_behind_that() -> None:
    terminal = Terminal()
    terminal.say(0.0, *["x"] * 15)
    terminal.look(1.0)
    terminal.say(1.0, *["x"] * 15)
    terminal.look(3.0)
    assert not terminal.log._windows
    assert terminal.said().count("x") == 10 + 1


def test_ten_lines_a_second_are_no_flood_for_a_minute_and_a_cause_that_never_rests_has_one_a_minute_then() -> None:
    """A robot whose setpoints are refused ten times a second had replaced all that was kept of other events in three hours."""
    terminal = Terminal()
    for tick in range(10 * 3600):
        terminal.say(0.1 * tick, "x")
    lines = terminal.said()
    assert lines[:600] == ["x"] * 600
    assert 2 * 58 <= len(lines[600:]) <= 2 * 60
    assert lines[600:604] == ["x", "599 more lines of 'x' left out"] * 2


def test_a_cause_that_has_rested_has_all_its_lines_again_and_other_causes_have_theirs_meanwhile() -> None:
    terminal = Terminal()
    for tick in range(1000):
        terminal.say(0.1 * tick, "x")
    terminal.say(100.0, "A303 other")
    terminal.look(130.0)
    terminal.look(200.0)
    assert not terminal.log._windows
    terminal.say(200.0, *["x"] * 10)
    lines = terminal.said()
    assert lines[-10:] == ["x"] * 10 and "A303 other" in lines
    assert sum(line == "x" for line in lines) == 600 + 1 + 10


def test_another_code_of_the_same_cause_is_told_at_once_in_a_long_flood_and_two_in_turn_have_ten_lines_a_second() -> (
    None
):
    """Of faults that come and are reset all night, the one that is another."""
    clock, lines = Clock(), list[str]()
    with EventLog(lines.append, clock) as log:
        for tick in range(800):
            clock.now_s = 0.5 * tick
            log("control", "A310 master lost")
        log("control", "A303 gain")
        for tick in range(100):
            clock.now_s += 0.01
            log("control", f"A3{10 + tick % 2} in turn")
    told = texts(lines)
    assert told.count("A310 master lost") < 605 and told.count("A303 gain") == 1
    assert told[told.index("A303 gain") - 1].startswith("A310 ") and "left out" in told[told.index("A303 gain") - 1]
    assert sum(line.endswith("in turn") for line in told) <= 20


def test_two_codes_within_a_second_are_no_flood_of_the_one_that_comes_last() -> None:
    """Few enough of a second, and the flood of a code alone has one line a minute behind 600 of them."""
    terminal = Terminal()
    for second in range(250):
        terminal.clock.now_s = float(second)
        for code in ("A310", "A310", "W204", "A310"):
            terminal.log("control", f"{code} by turns")
    assert sum(line.endswith("by turns") for line in terminal.said()) == 1000


def test_what_is_left_out_does_not_count_among_the_lines_of_a_long_flood() -> None:
    """Hundreds in a second are a burst, and the next second has a line all the same."""
    terminal = Terminal()
    for second in range(4):
        terminal.say(float(second), *["x"] * 700)
    assert terminal.said().count("x") == 10 + 1 + 1 + 1


def test_what_is_left_out_is_told_by_the_code_of_the_last_and_as_its_process_says_it(tmp_path: Path) -> None:
    with EventLog(lambda line: None, Clock(), file=EventFile(tmp_path)) as log:
        say = log.speaking_for("watch")
        for code in ["W204"] * 10 + ["W201"] * 5:
            say("refusal", f"{code} x")
    with EventReader(tmp_path) as reader:
        *_, told = reader.read_stored()
    assert (told.code, told.source, told.text) == ("W201", "watch", "5 more lines of 'refusal' left out")


def test_ten_lines_a_second_are_no_flood() -> None:
    terminal = Terminal()
    for second in range(5):
        terminal.say(float(second), *["x"] * 10)
    assert terminal.said() == ["x"] * 50


def test_of_more_causes_than_are_kept_the_recent_ones_stay_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(event_log, "_MOST_CAUSES", 20)
    terminal = Terminal()
    terminal.say(0.0, *(f"old {number}" for number in range(19)))
    terminal.say(1.5, *["x"] * 25)
    terminal.say(1.6, "new")
    terminal.say(1.7, *["x"] * 25)
    assert terminal.said().count("x") == 10


def test_causes_that_all_come_at_once_need_no_more_memory() -> None:
    terminal = Terminal()
    terminal.say(0.0, *(f"cause {number}" for number in range(3000)))
    assert len(terminal.log._windows) <= 1000
    terminal.said()


# -- the file


def read(reader: EventReader) -> list[str]:
    return [event.text for event in reader.read_new()]


def test_who_does_not_hold_the_file_s_lock_gives_it_no_other_name(tmp_path: Path) -> None:
    """Another process is at it, or reads: two that held it at once would give two names; the file grows longer meanwhile."""
    file = EventFile(tmp_path, longest_bytes=200)
    file.append(line("one"))
    holder = os.open(tmp_path / NAME, os.O_RDONLY)
    fcntl.flock(holder, fcntl.LOCK_SH)
    for _ in range(5):
        file.append(line("more"))
    assert [path.name for path in tmp_path.iterdir()] == [NAME]
    os.close(holder)
    file.append(line("last"))
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"{NAME}.1"]
    file.close()


def test_what_comes_right_before_a_file_gets_its_new_name_is_read(tmp_path: Path) -> None:
    file = EventFile(tmp_path)

    class Overtaken(EventReader):
        """Between this reader's two looks another process writes, and gives the file its old name."""

        is_overtaken = False

        def _whole_lines(self) -> Iterator[EventRecord]:
            yield from super()._whole_lines()
            if not self.is_overtaken:
                self.is_overtaken = True
                file.append(line("late"))
                (tmp_path / NAME).rename(tmp_path / f"{NAME}.1")
                file.append(line("new"))

    file.append(line("first"))
    with Overtaken(tmp_path) as reader:
        assert [*(event.text for event in reader.read_stored()), *read(reader)] == ["first", "late", "new"]
    file.close()


def test_a_torn_end_of_the_old_file_spoils_nothing_of_the_new_one(tmp_path: Path) -> None:
    (tmp_path / NAME).write_bytes(line("first") + line("torn")[:9])
    with EventReader(tmp_path) as reader:
        assert [event.text for event in reader.read_stored()] == ["first"]
        (tmp_path / NAME).rename(tmp_path / f"{NAME}.1")
        (tmp_path / NAME).write_bytes(line("new"))
        assert read(reader) == ["new"]


def test_every_old_file_is_read_oldest_first_and_one_of_two_names_once(tmp_path: Path) -> None:
    """One that gets its next number while they are opened is met twice."""
    for number in range(KEPT + 1):
        (tmp_path / (f"{NAME}.{number}" if number else NAME)).write_bytes(line(str(number)))
    (tmp_path / f"{NAME}.2").unlink()
    os.link(tmp_path / f"{NAME}.1", tmp_path / f"{NAME}.2")
    with EventReader(tmp_path) as reader:
        assert [event.text for event in reader.read_stored()] == ["4", "3", "1", "0"]


def test_files_beside_one_that_is_refused_are_closed(tmp_path: Path) -> None:
    (tmp_path / NAME).write_bytes(line("new"))
    (tmp_path / f"{NAME}.1").mkdir()
    before = sorted(Path("/proc/self/fd").iterdir())
    with pytest.raises(OSError, match="a directory") as refused, EventReader(tmp_path) as reader:
        list(reader.read_stored())
    assert sorted(Path("/proc/self/fd").iterdir()) == before, refused.value
