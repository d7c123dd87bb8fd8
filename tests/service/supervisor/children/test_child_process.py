"""A child of the guardian as the kernel sees it: what it inherits, how it ends, and what is left of it."""

import errno
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from gateway.processes.scheduling.scheduler_counters import SchedulerCounters
from gateway.service.supervisor import child_process
from gateway.service.supervisor.child_process import (
    LOST,
    Child,
    MemoryKills,
    count_memory_kills,
    describe_exit,
    reap_orphans,
    spawn_child,
)
from gateway.service.supervisor.event_wait import wait_readable
from tests.processes.held_program import held_program
from tests.service.supervisor.scripted_children import open_descriptors

ROOM = 300
Start = Callable[..., Child]
_READY = "import os, signal, sys, time; line = int(sys.argv[1]); os.write(line, b'x'); "
WAITS = "time.sleep(60)"
STUBBORN = "signal.signal(signal.SIGTERM, signal.SIG_IGN); "


@pytest.fixture
def start(monkeypatch: pytest.MonkeyPatch) -> Iterator[Start]:
    """Start these lines of Python as a child, which says one word once they run; whoever still lives is killed in the end."""
    started: list[Child] = []

    def begin(lines: str, *shared: int, before: str = "") -> Child:
        with monkeypatch.context() as patch:
            code = _READY.replace("os.write", f"{before}os.write", 1)
            patch.setattr(child_process, "module_command", lambda _: [sys.executable, "-S", "-E", "-c", code + lines])
            started.append(spawn_child("module", {"rig": "demo"}, *shared, room=ROOM))
        assert wait_readable([started[-1].link.fileno()], 10.0)
        return started[-1]

    yield begin
    for child in started:
        child.kill()
        child.wait()
        child.close()


def process_file(child: Child, name: str) -> Path:
    return Path(f"/proc/{child.pid}/{name}")


def test_a_terminal_reaches_the_guardian_alone(start: Start) -> None:
    """Ctrl-C and the end of the terminal are answered by a ramp; a child that they reach ends at once, with its force."""
    saved, reader_and_writer = os.dup(0), os.pipe()
    os.dup2(reader_and_writer[0], 0)  # who reads a terminal in the background is stopped for it
    child = start(WAITS)
    os.dup2(saved, 0)
    for descriptor in (saved, *reader_and_writer):
        os.close(descriptor)
    assert os.getsid(child.pid) == child.pid
    (blocked,) = [
        line.split()[1] for line in process_file(child, "status").read_text().splitlines() if line.startswith("SigBlk")
    ]
    assert int(blocked, 16) == sum(1 << (number - 1) for number in (signal.SIGHUP, signal.SIGINT))
    assert process_file(child, "fd/0").readlink() == Path(os.devnull)
    assert len(process_file(child, "cmdline").read_bytes().split(b"\0")[-2]) == ROOM


def test_a_child_inherits_what_it_is_given_and_nothing_else_of_us(start: Start, tmp_path: Path) -> None:
    """Of a port's lock, for one: it would be held by who does not know of it."""
    with (tmp_path / "given").open("w") as given, (tmp_path / "kept").open("w") as kept:
        child = start(WAITS, given.fileno())
        (number,) = [
            int(one.name) for one in process_file(child, "fd").iterdir() if one.readlink().is_relative_to(tmp_path)
        ]
        assert number == given.fileno()
        assert not os.get_inheritable(given.fileno())
        assert process_file(child, f"fd/{number}").readlink() != Path(kept.name)


def test_a_child_is_asked_before_it_is_killed(start: Start, monkeypatch) -> None:
    monkeypatch.setattr(child_process, "_END_BOUND_S", 30.0)  # a busy machine may keep it from answering for a second
    child = start(WAITS, before="signal.signal(signal.SIGTERM, lambda *_: os._exit(7)); ")
    child.end()
    assert child.wait() == 7


def test_a_child_that_leaves_the_signal_to_others_ends_by_the_end_of_its_line(start: Start, monkeypatch) -> None:
    """The simulated rig does: a stop of the gateway, which every process may be told, is not yet its own."""
    monkeypatch.setattr(child_process, "_END_BOUND_S", 10.0)
    child = start("os.read(line, 1); os._exit(7)", before=STUBBORN)
    child.end()
    assert child.wait() == 7


def test_a_child_that_does_not_do_as_it_is_asked_is_killed_and_leaves_nothing(start: Start, monkeypatch) -> None:
    monkeypatch.setattr(child_process, "_END_BOUND_S", 0.02)
    before = open_descriptors()
    child = start(WAITS, before=STUBBORN)
    child.end()
    assert child.wait(0.0) == -signal.SIGKILL
    assert not Path(f"/proc/{child.pid}").exists(), "no zombie either"
    assert open_descriptors() == before


def test_a_wait_ends_with_the_process_or_with_its_bound(start: Start) -> None:
    child = start("os.read(line, 1); time.sleep(0.05); os._exit(3)")
    assert child.wait(0.01) == LOST
    child.link.send(b"x")
    assert child.wait(10.0) == 3
    assert child.wait(0.0) == 3, "and it is known from then on"


def test_a_child_that_somebody_else_has_reaped_is_lost_and_no_exception(start: Start) -> None:
    child = start("os._exit(3)")
    os.waitpid(child.pid, 0)
    assert child.wait() == LOST


def test_nobody_is_killed_for_a_child_that_is_gone_or_not_born(start: Start, monkeypatch) -> None:
    """Its number may be another program's by now; and 0 is whoever is in our own group."""
    child = start("os._exit(0)")
    child.wait()
    ours, theirs = child_process.guardian_link.create_link()
    unborn = Child(ours)
    killed: list[tuple[int, ...]] = []
    with monkeypatch.context() as patch:
        patch.setattr(os, "kill", lambda *told: killed.append(told))
        for one in (child, unborn):
            one.kill()
            one.end()
    assert not killed
    theirs.close()


def test_a_program_whose_disk_hangs_is_not_waited_for(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The guardian saw no control die, nor said the safe voltage, for as long as the disk took to open a helper's program."""
    program = tmp_path / "program"
    program.write_text("#!/bin/sh\nexit 7\n")
    program.chmod(0o700)
    with held_program(program) as disk:
        monkeypatch.setattr(child_process, "module_command", lambda _: [str(program)])
        child = spawn_child("module", {})
        while len(held := {one.name for one in process_file(child, "fd").iterdir()}) > 4 and disk.poll() is None:
            time.sleep(0.001)
        is_hung = disk.poll() is None
        disk.communicate()
        assert child.wait(10.0) == 7
        child.close()
    assert is_hung, "it came back behind the disk alone, or has kept more of ours than three streams and its line"
    assert {"0", "1", "2"} < held


def test_a_program_that_is_not_there_ends_as_a_shell_tells_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(child_process, "module_command", lambda _: [str(tmp_path / "none")])
    child = spawn_child("module", {})
    assert child.wait(10.0) == 127
    child.close()
    assert "No such file" in capfd.readouterr().err


def no_room(*_: object, **__: object) -> int:
    raise OSError(errno.EMFILE, "Too many open files")


def test_a_child_that_cannot_be_followed_does_not_stay(start: Start, monkeypatch) -> None:
    spawned: list[int] = []
    fork, before = os.fork, open_descriptors()

    def noted() -> int:
        if pid := fork():
            spawned.append(pid)
        return pid

    monkeypatch.setattr(os, "fork", noted)
    monkeypatch.setattr(os, "pidfd_open", no_room)
    with pytest.raises(OSError, match="Too many"):
        start("time.sleep(1)")
    try:
        code = os.waitstatus_to_exitcode(os.waitpid(spawned[0], 0)[1])
    except ChildProcessError:
        code = None  # reaped already
    assert code in (None, -signal.SIGTERM, -signal.SIGKILL)
    assert open_descriptors() == before


def test_a_child_that_there_is_no_process_for_leaves_no_descriptor(start: Start, monkeypatch) -> None:
    before = open_descriptors()
    monkeypatch.setattr(os, "fork", no_room)
    with pytest.raises(OSError, match="Too many"):
        start("")
    assert open_descriptors() == before


def test_a_childs_descriptors_are_closed_with_it(start: Start) -> None:
    before = open_descriptors()
    child = start("os._exit(0)")
    assert isinstance(child.counters, SchedulerCounters)
    child.wait()
    child.close()
    assert open_descriptors() == before


def _reaps_one_of_three() -> bool:
    """In a process of its own: an orphan, a child that somebody asks for, and one that lives."""
    orphan, known, living = 0, 0, 0
    if (orphan := os.fork()) == 0:
        os._exit(0)
    if (known := os.fork()) == 0:
        os._exit(3)
    if (living := os.fork()) == 0:
        signal.pause()
    for pid in (orphan, known):
        os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
    reap_orphans({known, living})
    try:
        os.waitpid(orphan, os.WNOHANG)
        return False
    except ChildProcessError:
        pass
    is_spared = os.waitpid(known, os.WNOHANG)[0] == known
    reap_orphans(set())  # one lives still: it is not waited for
    os.kill(living, signal.SIGKILL)
    return is_spared


def test_orphans_are_reaped_and_neither_the_living_nor_the_known_ones() -> None:
    if (pid := os.fork()) == 0:
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(10)
        os._exit(0 if _reaps_one_of_three() else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0


def test_who_is_killed_while_the_kernel_kills_for_want_of_memory_is_told_with_that_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """`control process died; SIGKILL`, and nobody had killed it."""
    killed, now_s = [3], [100.0]
    monkeypatch.setattr(child_process, "memory_kills", MemoryKills(lambda: killed[0], lambda: now_s[0]))
    assert describe_exit(-9) == "SIGKILL", "those of before are not ours"
    killed[0] = 5
    assert describe_exit(-15) == "SIGTERM"
    assert describe_exit(-9).startswith("SIGKILL, while the kernel killed for want of memory")
    now_s[0] += 9.0
    assert "memory" in describe_exit(-9), "the second one of the same shortage"
    now_s[0] += 2.0
    assert describe_exit(-9) == "SIGKILL"


def test_what_the_kernel_killed_an_hour_ago_is_no_reason_of_a_kill_by_hand(monkeypatch: pytest.MonkeyPatch) -> None:
    killed, now_s, reads = [3], [100.0], [0]

    def count() -> int:
        reads[0] += 1
        return killed[0]

    kills = MemoryKills(count, lambda: now_s[0])
    monkeypatch.setattr(child_process, "memory_kills", kills)
    killed[0] = 4
    for _ in range(1000):
        now_s[0] += 0.1
        kills.look()
    assert reads[0] <= 11, "often called, it reads now and then"
    assert describe_exit(-9) == "SIGKILL"
    killed[0] = 5
    assert "memory" in describe_exit(-9)


def test_the_kernel_s_count_of_those_is_read_and_0_where_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Path, "read_text", lambda _path: "nr_free_pages 7\noom_kill 12\noom_kill_other 3\n")
    assert count_memory_kills() == 12
    monkeypatch.setattr(Path, "read_text", lambda _path: "nr_free_pages 7\n")
    assert count_memory_kills() == 0
    monkeypatch.undo()
    known = [line for line in Path("/proc/vmstat").read_text().splitlines() if line.startswith("oom_kill ")]
    assert not known or count_memory_kills() >= int(known[0].split()[1])


@pytest.mark.parametrize(
    ("code", "words"), [(0, "exit 0"), (78, "exit 78"), (-9, "SIGKILL"), (-40, "signal 40"), (LOST, "no exit code")]
)
def test_an_exit_code_in_words(code: int, words: str) -> None:
    assert describe_exit(code) == words
