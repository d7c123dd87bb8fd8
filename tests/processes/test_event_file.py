"""What a process says stands in the state directory, one event per line, whatever kills a writer or fills a disk."""

import errno
import json
import os
import queue
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from gateway.processes import event_file
from gateway.processes.event import (
    EventRecord,
    encode_event,
    format_event,
    make_event,
    parse_event,
)
from gateway.processes.event_file import KEPT, EventFile, EventReader
from gateway.processes.event_log import EventLog, QueuedWriter
from tests.other_kinds import MAKERS, put
from tests.processes.test_event_log import NOON_S, kept


def event(text: str, source: str = "control") -> EventRecord:
    return make_event(NOON_S, source, "test", text)


def test_the_file_has_one_json_object_per_line(tmp_path: Path) -> None:
    with EventLog(lambda line: None, source="guardian", file=EventFile(tmp_path), wall=lambda: NOON_S) as log:
        log("restart", "A401 control died:\n  Traceback \x1b[2J ü\ud800")
        log.speaking_for("watch")("residual", "A345 friction")
        log.note("start", "ready")
    lines = (tmp_path / "events.jsonl").read_text("ascii").splitlines()
    assert [json.loads(line)["source"] for line in lines] == ["guardian", "watch", "guardian"]
    assert json.loads(lines[0]) == {
        "time": "2026-11-22T12:00:00.250Z",
        "severity": "error",
        "code": "A401",
        "cause": "restart",
        "text": "control died:\n  Traceback \x1b[2J ü\ud800",
        "source": "guardian",
    }
    assert (tmp_path / "events.jsonl").stat().st_mode & 0o777 == 0o600


@pytest.mark.parametrize("kind", MAKERS)
def test_a_log_waits_for_no_file_that_is_none_and_says_so(kind: str, tmp_path: Path) -> None:
    """A pipe kept its thread for ever, unsaid, and the end of the log waited for it."""
    put(kind, tmp_path / "events.jsonl")
    lines: queue.Queue[str] = queue.Queue()
    with EventLog(lines.put, file=EventFile(tmp_path)) as log:
        log.note("start", "ready")
        assert f"E150 events are not kept: {tmp_path}/events.jsonl: it is {kind}" in lines.get(timeout=5)


def test_a_file_that_cannot_be_reached_is_named(tmp_path: Path) -> None:
    """A link to a disk that is not mounted: 'No such file or directory' was all, in the log of a gateway with several."""
    (tmp_path / "events.jsonl").symlink_to(tmp_path / "not mounted" / "events.jsonl")
    lines: queue.Queue[str] = queue.Queue()
    with EventLog(lines.put, file=EventFile(tmp_path)) as log:
        log.note("start", "ready")
        assert f"E150 events are not kept: {tmp_path}/events.jsonl: {os.strerror(errno.ENOENT)};" in lines.get(
            timeout=5
        )


def test_what_is_noted_is_not_on_the_terminal(tmp_path: Path) -> None:
    lines: list[str] = []
    with EventLog(lines.append, file=EventFile(tmp_path)) as log:
        log.note("start", "ready")
    assert (lines, len(kept(tmp_path))) == ([], 1)


def test_a_line_for_people_moves_no_cursor_and_stays_one_event() -> None:
    line = format_event(event("E150 one\ntwo \x1b[2J\r\x9b\u2028\n"))
    assert line.endswith("E150 one\n    two \\x1b[2J\\x0d\\x9b\\x2028")


def test_a_sentence_without_end_is_cut() -> None:
    assert len(encode_event(event("W204 " + "x" * 10_000_000))) < 20_000


def torn_forms() -> Iterator[bytes]:
    whole = encode_event(event("W204 whole"))
    yield from (whole[:cut] for cut in range(len(whole) - 1))
    yield from (b"\x00" * 100, b"[" * 100_000, b'{"time": "x"}', b'{"time": "x", "severity": 1}', b"\xff\xfe", b"7")
    for part in ("severity", "code"):  # a number in the place of a text
        yield encode_event(event("W204 whole")._replace(**{part: 7})).rstrip()


def test_whatever_a_killed_writer_leaves_costs_no_other_line(tmp_path: Path) -> None:
    """The next writer's line begins where the torn one ends."""
    for torn in torn_forms():
        path = tmp_path / "events.jsonl"
        path.write_bytes(encode_event(event("one")) + torn + encode_event(event("two")) + torn + b"\n")
        assert [found.text for found in kept(tmp_path)] == ["one", "two"], torn


def test_a_record_in_a_sentence_is_no_record() -> None:
    nested = event("W204 " + encode_event(event("inner")).decode())
    assert parse_event(encode_event(nested)) == nested
    assert parse_event(encode_event(nested)[:-3]) is None


def test_size_and_number_of_files_are_bounded_and_the_newest_lines_stay(tmp_path: Path) -> None:
    file = EventFile(tmp_path, longest_bytes=2000)
    for number in range(500):
        file.append(encode_event(event(f"line {number}")))
    file.close()
    sizes = [path.stat().st_size for path in tmp_path.iterdir()]
    assert len(sizes) == KEPT + 1 and max(sizes) < 2200
    numbers = [int(found.text.split()[1]) for found in kept(tmp_path)]
    assert numbers == list(range(numbers[0], 500))
    assert len(numbers) > 30


WRITER = """
import sys
from pathlib import Path
from gateway.processes.event import encode_event, make_event
from gateway.processes.event_file import EventFile
file = EventFile(Path(sys.argv[1]), longest_bytes=40_000)
for number in range(400):
    file.append(encode_event(make_event(0.0, sys.argv[2], "test", f"{number} " + "x" * 300)))
"""


def test_two_processes_that_write_and_rotate_at_once_lose_and_tear_nothing(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(event_file, "KEPT", 60)
    writer = WRITER.replace("file =", "from gateway.processes import event_file\nevent_file.KEPT = 60\nfile =")
    command = [sys.executable, "-c", writer, str(tmp_path)]
    processes = [subprocess.Popen([*command, name]) for name in ("control", "guardian")]
    assert [process.wait(30) for process in processes] == [0, 0]
    found = kept(tmp_path)
    for source in ("control", "guardian"):
        assert [int(each.text.split()[0]) for each in found if each.source == source] == list(range(400))
    raw = b"".join(path.read_bytes() for path in tmp_path.iterdir())
    assert len(raw.splitlines()) == 800
    assert len(list(tmp_path.iterdir())) > 3


def test_a_reader_that_follows_sees_each_line_once_through_rotations(tmp_path: Path) -> None:
    file, reader = EventFile(tmp_path, longest_bytes=1500), EventReader(tmp_path)
    file.append(encode_event(event("0")))
    found = list(reader.read_stored())
    for number in range(1, 60):
        file.append(encode_event(event(str(number))))
        found += reader.read_new()
    with (tmp_path / "events.jsonl").open("ab") as stream:
        line = encode_event(event("late"))
        stream.write(line[:40])
        stream.flush()
        found += reader.read_new()
        stream.write(line[40:])
    found += reader.read_new()
    assert [each.text for each in found] == [*map(str, range(60)), "late"]
    reader.close()
    file.close()


def test_following_begins_before_there_is_a_file(tmp_path: Path) -> None:
    reader = EventReader(tmp_path)
    assert list(reader.read_stored()) == []
    file = EventFile(tmp_path)
    file.append(encode_event(event("first")))
    assert [each.text for each in reader.read_new()] == ["first"]
    reader.close()
    file.close()


class FullDisk(EventFile):
    """A disk that takes nothing while it is full."""

    is_full = True

    def append(self, line: bytes) -> None:
        if self.is_full:
            raise OSError(28, "No space left on device")
        super().append(line)


def test_a_full_disk_is_one_alarm_and_its_end_says_what_is_missing(tmp_path: Path) -> None:
    lines: list[str] = []
    alarmed = threading.Event()

    def write(line: str) -> None:
        lines.append(line)
        if "E150" in line:
            alarmed.set()

    file = FullDisk(tmp_path)
    with EventLog(write, file=file) as log:
        for number in range(7):
            log(f"cause {number}", "sentence")
        assert alarmed.wait(5)
        log._disk.end()  # type: ignore[union-attr]
        file.is_full = False
        log._disk = QueuedWriter("events", log._disk._write, log._event)  # type: ignore[union-attr]
        log._disk.start()
        log("cause", "again")
        log("cause", "and again")
    assert sum("E150" in line for line in lines) == 1
    assert "No space left on device" in next(line for line in lines if "E150" in line)
    assert [each.text for each in kept(tmp_path)] == ["again", "7 events were not kept before this one", "and again"]


def test_what_is_noted_is_on_the_terminal_where_the_file_does_not_take_it(tmp_path: Path) -> None:
    """E150 says so; a restart's reasons for not recording, or for another calibration, stood nowhere."""
    lines: queue.Queue[str] = queue.Queue()
    with EventLog(lines.put, file=FullDisk(tmp_path)) as log:
        log("start", "said")
        log.note("start", "not recording")
        said = [lines.get(timeout=5).rstrip("\n").partition("start ")[2] for _ in range(3)]
    assert sorted(said) == ["", "not recording", "said"], "once each, beside E150"


def test_a_line_that_the_disk_takes_half_of_does_not_spoil_the_next(tmp_path: Path, monkeypatch) -> None:
    file, write = EventFile(tmp_path), os.write
    monkeypatch.setattr(event_file.os, "write", lambda descriptor, data: write(descriptor, data[: len(data) // 2]))
    with pytest.raises(OSError, match="No space"):
        file.append(encode_event(event("half")))
    monkeypatch.undo()
    file.append(encode_event(event("whole")))
    file.close()
    assert [each.text for each in kept(tmp_path)] == ["whole"]
    assert json.loads((tmp_path / "events.jsonl").read_text().splitlines()[-1])["text"] == "whole", "for any tool"


def test_a_state_directory_that_was_removed_is_an_error_of_the_system_and_no_more(tmp_path: Path) -> None:
    file = EventFile(tmp_path / "gone")
    with pytest.raises(FileNotFoundError):
        file.append(encode_event(event("x")))


def test_who_comes_late_to_a_full_file_leaves_the_new_one_its_name(tmp_path: Path) -> None:
    line = encode_event(event("one"))
    late, other = EventFile(tmp_path, 2 * len(line)), EventFile(tmp_path, 2 * len(line))
    late.append(line)
    other.append(line)  # full: it gets its old name
    other.append(line)
    late._rotate()
    other.close()
    assert (tmp_path / "events.jsonl").read_bytes() == line and not (tmp_path / "events.jsonl.2").exists()


def test_who_finds_its_file_renamed_writes_into_the_new_one(tmp_path: Path) -> None:
    """Into the old one, its lines would go away with that before they are old."""
    line = encode_event(event("one"))
    late, other = EventFile(tmp_path, 2 * len(line)), EventFile(tmp_path, 2 * len(line))
    late.append(line)
    other.append(line)  # full: it gets its old name
    late.append(encode_event(event("two")))
    for file in (late, other):
        file.close()
    assert [
        parse_event((tmp_path / name).read_bytes().splitlines()[-1]).text
        for name in (  # type: ignore[union-attr]
            "events.jsonl.1",
            "events.jsonl",
        )
    ] == ["one", "two"]


def test_a_piece_of_a_line_at_the_end_of_an_old_file_costs_the_new_one_nothing(tmp_path: Path) -> None:
    """As a killed writer leaves it."""
    path, reader = tmp_path / "events.jsonl", EventReader(tmp_path)
    path.write_bytes(encode_event(event("one")) + encode_event(event("torn"))[:40])
    found = list(reader.read_stored())
    path.rename(tmp_path / "events.jsonl.1")
    path.write_bytes(encode_event(event("two")))
    found += reader.read_new()
    reader.close()
    assert [each.text for each in found] == ["one", "two"]
