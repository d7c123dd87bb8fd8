"""What a long calculation says while it lasts, and that Ctrl-C ends it and leaves nothing behind, whenever it comes."""

import contextlib
import ctypes
import io
import os
import pty
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gateway.diagnosis
from gateway import progress
from gateway.cli.diagnosis import progress_line
from gateway.cli.diagnosis.outputs import write_all
from gateway.cli.diagnosis.progress_line import ProgressLine, show_progress
from gateway.progress import Progress
from tests.cli.verbs.diagnosis.test_diagnose import table
from tests.reports.fake_diagnosis import diagnosis


class Terminal(io.StringIO):
    """Tells when it was written to."""

    def __init__(self, *, is_terminal: bool) -> None:
        super().__init__()
        self.is_terminal = is_terminal
        self.was_written = threading.Semaphore(0)

    def isatty(self) -> bool:
        return self.is_terminal

    def flush(self) -> None:
        self.was_written.release()


@pytest.fixture
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("_QUIET_S", "_REWRITTEN_S"):
        monkeypatch.setattr(progress_line, name, 0.001)


def test_on_a_terminal_the_newest_stage_its_share_and_the_time_left_are_shown_in_one_line(
    at_once: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TERM", "xterm")
    stream = Terminal(is_terminal=True)
    line = ProgressLine("diagnosing", stream, iter(range(10_000)).__next__)
    line.tell(Progress("refining leak", 3, 16))
    with line.keep_writing():
        assert all(stream.was_written.acquire(timeout=10) for _ in range(2))
    shown = stream.getvalue()
    assert shown.startswith("\r\x1b[2Kdiagnosing, 2 s, 18 %: refining leak: 3 of 16\r\x1b[2Kdiagnosing, ")
    assert shown.endswith("\r\x1b[2K"), "nothing of it stays"


def test_a_pipe_gets_a_line_for_each_stage(at_once: None) -> None:
    stream = Terminal(is_terminal=False)
    line = ProgressLine("fitting", stream, iter(range(10_000)).__next__)
    line.tell(Progress("loading"))
    with line.keep_writing():
        assert stream.was_written.acquire(timeout=10)
        line.tell(Progress("solving", 1, 2))
        assert stream.was_written.acquire(timeout=10)
        line.tell(Progress("solving", 2, 2))
        assert not stream.was_written.acquire(timeout=0.02)
    assert [words.partition(": ")[2] for words in stream.getvalue().splitlines()] == ["loading", "solving: 1 of 2"]


def test_a_full_pipe_that_nobody_reads_keeps_nobody_from_the_end(at_once: None) -> None:
    """A Ctrl-C waited for the line to be written, and `record --for` went on."""
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    with contextlib.suppress(BlockingIOError):
        while True:
            os.write(writing, bytes(4096))
    os.set_blocking(writing, True)
    is_said = threading.Event()

    class Line(ProgressLine):
        def sentence(self, width: int = 1000) -> str:
            is_said.set()
            return "record"

    def show() -> None:
        with line.keep_writing():
            line.tell(Progress("record"))
            is_said.wait(10.0)

    with os.fdopen(reading, "rb") as pipe, os.fdopen(writing, "w") as stream:
        line = Line("record", stream)
        shown = threading.Thread(target=show, daemon=True)
        shown.start()
        shown.join(10.0)
        is_over = not shown.is_alive()
        pipe.read(1 << 16)  # so that a writer that waits can end
        shown.join()
    assert is_said.is_set() and is_over


def test_the_time_left_of_what_goes_on_steadily_never_grows() -> None:
    """`record --for 60s` counted whole seconds: 58 s left became 78 within each of the first."""
    now_s = [0.0]
    line, told = ProgressLine("record", Terminal(is_terminal=True), lambda: now_s[0]), list[int]()
    for tenths in range(600):
        now_s[0] = 0.1 * tenths
        if not tenths % 2:
            line.tell(Progress("0001.fgr, seconds", int(now_s[0]), 60))
        if found := re.search(r"(\d+):(\d\d) left", line.sentence()):
            told.append(60 * int(found[1]) + int(found[2]))
    assert len(told) > 500 and told == sorted(told, reverse=True) and told[0] <= 60


def test_the_time_left_is_that_of_the_stage_at_its_present_speed() -> None:
    now_s = [0.0]
    line = ProgressLine("fitting", Terminal(is_terminal=True), lambda: now_s[0])
    line.tell(Progress("loading", 0, 4))
    now_s[0] = 100.0
    line.tell(Progress("solving", 0, 40))
    assert line.sentence() == "fitting, 100 s, 0 %: solving: 0 of 40", "nothing is done of it yet"
    now_s[0] = 110.0
    line.tell(Progress("solving", 4, 40))
    assert line.sentence() == "fitting, 110 s, 10 %, 1:30 left: solving: 4 of 40"
    now_s[0] = 112.0
    assert line.sentence() == "fitting, 112 s, 10 %, 1:28 left: solving: 4 of 40", "nothing is slower yet"
    now_s[0] = 125.0
    assert line.sentence() == "fitting, 125 s, 10 %, 1:28 left: solving: 4 of 40", "the next part takes longer"
    now_s[0] = 110.0
    assert line.sentence(40) == "10 %, 1:30 left: solving: 4 of 40", "on a narrow terminal the stage is not cut"
    assert line.sentence(30) == "10 %: solving: 4 of 40"


def test_what_is_printed_meanwhile_stands_above_the_line(
    at_once: None, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    terminal = Terminal(is_terminal=True)
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(sys, "stdout", terminal)
    monkeypatch.setenv("TERM", "xterm")
    with show_progress("measuring"):
        assert terminal.was_written.acquire(timeout=10)
        print("a row of the table")
    assert "\r\x1b[2Ka row of the table\n" in terminal.getvalue()


def test_items_are_told_of_before_each() -> None:
    told: list[str] = []
    with progress.listen(lambda each: told.append(str(each))):
        assert list(progress.reported("servers", ["ours", "theirs"])) == ["ours", "theirs"]
    assert told == ["servers: 0 of 2", "servers: 1 of 2"]


def test_what_is_quick_says_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with show_progress("diagnosing"):
        progress.report("fitting the base model")
    assert capsys.readouterr().err == ""


def test_stages_come_back_after_what_was_in_between() -> None:
    told: list[str] = []
    with progress.listen(lambda each: told.append(str(each))):
        progress.report("refining")
        progress.advance(3, 16)
        before = progress.current()
        progress.report("preparing", 1, 8)
        progress.resume(before)
    progress.report("nobody listens")
    assert told == ["refining", "refining: 3 of 16", "preparing: 1 of 8", "refining: 3 of 16"]


def press_ctrl_c() -> None:
    os.kill(os.getpid(), signal.SIGINT)


def swallow_ctrl_c() -> None:
    """As a callback of a library does."""
    try:
        press_ctrl_c()
    except KeyboardInterrupt:
        pass
    progress.report("the next stage")


@contextmanager
def pressed_in(method: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Ctrl-C in the middle of a method of paths."""
    original = getattr(Path, method)

    def pressed(self: Path, *arguments: Any, **named: Any) -> Any:
        done = original(self, *arguments, **named)
        press_ctrl_c()
        return done

    with monkeypatch.context() as patch:
        patch.setattr(Path, method, pressed)
        yield


def press_ctrl_c_in_a_callback() -> None:
    """As while loops are compiled: C swallows what its callback raises, and Python prints it."""
    ctypes.CFUNCTYPE(None)(press_ctrl_c)()
    progress.report("the next stage")


@pytest.mark.parametrize("press", [press_ctrl_c, swallow_ctrl_c, press_ctrl_c_in_a_callback])
def test_ctrl_c_while_it_calculates_writes_nothing(
    press: Callable[[], None], tmp_path: Path, call, monkeypatch: pytest.MonkeyPatch
) -> None:
    def diagnose(*_: Any) -> Any:
        press()
        return diagnosis()

    monkeypatch.setattr(gateway.diagnosis, "diagnose", diagnose)
    path = table(tmp_path / "run.csv")
    files = [word for name in ("json", "report", "extend", "plan") for word in (f"--{name}", tmp_path / f"out.{name}")]
    answer = call("diagnose", path, *files)
    assert (answer.exit_code, answer.stderr.strip()) == (1, "Aborted!")
    assert list(tmp_path.iterdir()) == [path]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_ctrl_c_while_files_are_written_leaves_none_and_a_later_one_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    texts = {tmp_path / name: name for name in ("one", "two", "three")}
    with pressed_in("write_text", monkeypatch), pytest.raises(KeyboardInterrupt):
        write_all(texts)
    assert not list(tmp_path.iterdir())
    with pressed_in("replace", monkeypatch):
        write_all(texts)
    assert {path: path.read_text() for path in tmp_path.iterdir()} == texts


@pytest.mark.sampled
@pytest.mark.parametrize("stage", ["preparing the simulation for this machine, once", "diagnosing, "])
def test_ctrl_c_in_the_real_verb(stage: str, tmp_path: Path) -> None:
    """On a terminal, while loops are compiled and in the middle of the search; the line is gone afterwards."""
    path = long_table(tmp_path / "run.csv")
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "gateway", "diagnose", path.name, "--report", "out.html", "--plan", "plan.yaml"]
    environment = os.environ | ({"NUMBA_CACHE_DIR": str(tmp_path / "kept")} if "once" in stage else {})
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=theirs, env=environment, text=True
    ) as process:
        os.close(theirs)
        said = read_until(ours, stage)
        process.send_signal(signal.SIGINT)
        said += read_until(ours, "Aborted!")
        assert process.stdout
        assert process.stdout.read() == ""
    os.close(ours)
    assert process.returncode == -signal.SIGINT
    assert "Traceback" not in said
    assert "\r\x1b[2K\r\nAborted!" in said
    assert {each.name for each in tmp_path.iterdir()} <= {path.name, "kept"}


def long_table(path: Path) -> Path:
    """A recording whose search is far from its end when it is first told of, after a second."""
    rng = np.random.default_rng(1)
    command_v = np.repeat(rng.uniform(0.5, 6.0, 300), 100)
    force_n = 8.0 * command_v + 0.02 * command_v**3 + np.cumsum(rng.normal(0.0, 0.01, command_v.size))
    columns = np.stack(
        [np.arange(command_v.size) * 0.005, command_v, force_n + rng.normal(0.0, 0.1, force_n.size)], axis=1
    )
    np.savetxt(path, columns, fmt="%.4f", delimiter=",", header="time_s,command_v,force_n", comments="")
    return path


def read_until(descriptor: int, words: str) -> str:
    said = ""
    while words not in said:
        try:
            said += os.read(descriptor, 4096).decode()
        except OSError:  # the other end is closed
            break
    assert words in said, said
    return said
