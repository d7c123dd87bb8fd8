"""A forked child begins only when the guardian follows it: one that was given up must not become a second control."""

import ctypes
import errno
import gc
import json
import os
import socket
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.processes import message_link
from gateway.service.supervisor import fork_server
from gateway.service.supervisor.child_process import Child
from gateway.service.supervisor.event_wait import wait_readable

Ends = tuple[Child, socket.socket]


@pytest.fixture
def ends() -> Iterator[Ends]:
    """The guardian's side of a child, and the child's end of the line."""
    ours, theirs = message_link.create_link()
    child = Child(ours)
    yield child, theirs
    child.close()
    theirs.close()


def test_a_child_that_is_followed_begins(ends: Ends) -> None:
    child, theirs = ends
    child.adopt(os.getpid())
    assert child.pid == os.getpid()
    assert fork_server.is_adopted(theirs)
    assert message_link.receive(child.link) == message_link.Message(message_link.BORN, {"pid": os.getpid()})


def test_a_child_that_was_given_up_before_its_birth_ends(ends: Ends) -> None:
    child, theirs = ends
    child.close()
    assert not fork_server.is_adopted(theirs)


@pytest.mark.parametrize("is_read", [False, True])
def test_a_child_that_is_given_up_between_birth_and_adoption_ends(ends: Ends, is_read: bool) -> None:
    """Its word may have been read, or lie in a line that is closed."""
    child, theirs = ends
    pid = os.fork()
    if pid == 0:
        child.link.close()
        os._exit(17 if fork_server.is_adopted(theirs) else 0)
    theirs.close()
    assert wait_readable([child.link.fileno()], 5.0)
    if is_read:
        assert message_link.receive(child.link) == message_link.Message(message_link.BORN, {"pid": pid})
    child.close()
    assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0


def test_a_child_that_is_told_to_stop_before_it_begins_ends(ends: Ends) -> None:
    child, theirs = ends
    message_link.send(child.link, message_link.RIG, {"ptys": {"output": "/dev/pts/1"}})
    message_link.send(child.link, message_link.STOP)
    assert not fork_server.is_adopted(theirs)


def test_where_the_rig_has_moved_to_does_not_keep_a_child_from_beginning(ends: Ends) -> None:
    """It asks for it when it needs it."""
    child, theirs = ends
    message_link.send(child.link, message_link.RIG, {"ptys": {"output": "/dev/pts/1"}})
    child.adopt(os.getpid())
    assert fork_server.is_adopted(theirs)


def test_what_the_server_forked_and_nobody_follows_any_more_begins_nothing(tmp_path: Path, monkeypatch) -> None:
    """It has told of its birth; the guardian gives it up in the same moment."""
    began = tmp_path / "began"
    monkeypatch.setattr(fork_server, "import_module", lambda name: began.touch())
    ours, theirs = message_link.create_link()
    server = os.fork()
    if server == 0:
        ours.close()
        fork_server.serve(theirs)
        os._exit(0)
    theirs.close()
    line = fork_server.request_child(ours, fork_server.CONTROL, {})
    assert wait_readable([line.fileno()], 10.0)
    attach = message_link.receive(line)
    assert attach and attach.tag == message_link.BORN
    died = os.pidfd_open(attach.body["pid"])
    line.close()
    assert wait_readable([died], 10.0)
    assert not began.exists()
    os.close(died)
    ours.close()
    assert os.waitstatus_to_exitcode(os.waitpid(server, 0)[1]) == 0


def sockets() -> int:
    """How many this process has."""
    return sum(one.is_socket() for one in Path("/proc/self/fd").iterdir())


def _child_that_tells(words: list[str]) -> int:
    """Plays a child's module: what it is, and what it was given, as its second word; its exit code is 7."""
    given = json.loads(words[1])
    files = {name: os.fstat(given[name]).st_ino for name in fork_server.SHARED if name in given}
    line = socket.socket(fileno=int(words[0]))
    numbers = len([*Path("/proc/self/fd").iterdir()])
    facts = {"session": os.getsid(0), "parent": os.getppid(), "files": files, "open": numbers, "sockets": sockets()}
    message_link.send(line, "?", facts)
    return 7


def _serve(theirs: socket.socket) -> None:
    """The server's whole life, in a process of its own; the second request finds no process left on the machine."""
    fork, forks = os.fork, iter([True, False, True])
    fork_server.import_module = lambda _: SimpleNamespace(main=_child_that_tells)  # type: ignore[assignment]

    def sometimes() -> int:
        """The first of the two forks of each child is by the server, the second is not this process's."""
        if os.getpid() == server and not next(forks):
            raise BlockingIOError("Resource temporarily unavailable")
        return fork()

    server, os.fork = os.getpid(), sometimes
    fork_server.serve(theirs)


@pytest.fixture
def served() -> Iterator[tuple[socket.socket, int]]:
    """The guardian's end of the line to a server that lives, and its process number; we are who gets its orphans."""
    assert fork_server.become_subreaper()
    ours, theirs = message_link.create_link()
    if (server := os.fork()) == 0:
        ours.close()
        _serve(theirs)
        os._exit(5)
    theirs.close()
    yield ours, server
    ours.close()
    assert os.waitstatus_to_exitcode(os.waitpid(server, 0)[1]) == 5, "it ends with the guardian"
    ctypes.CDLL(None).prctl(36, 0, 0, 0, 0)


def born_child(server: socket.socket, ring: int, beat: int) -> tuple[Child, dict[str, Any], int]:
    """Ask for a child and follow it: what it tells of itself, and its exit code."""
    child = Child(fork_server.request_child(server, "module", {"ring": ring, "beat": beat}, ring, beat))
    assert wait_readable([child.link.fileno()], 10.0)
    born = message_link.receive(child.link)
    assert born and born.tag == message_link.BORN
    child.adopt(born.body["pid"])
    assert wait_readable([child.link.fileno()], 10.0)
    told = message_link.receive(child.link)
    assert told
    code = child.wait(10.0)
    child.close()
    return child, told.body, code


def test_a_forked_child_is_the_guardians_own_and_has_what_it_was_given(
    served: tuple[socket.socket, int], tmp_path: Path
) -> None:
    """A session of its own, the guardian for a parent, who reads its exit code, and the memories under numbers of its own."""
    server, server_pid = served
    with (tmp_path / "ring").open("w") as ring, (tmp_path / "beat").open("w") as beat:
        child, told, code = born_child(server, ring.fileno(), beat.fileno())
        assert code == 7
        assert (told["session"], told["parent"]) == (child.pid, os.getpid())
        assert told["files"] == {"ring": os.fstat(ring.fileno()).st_ino, "beat": os.fstat(beat.fileno()).st_ino}
        line = fork_server.request_child(server, "module", {})
        assert wait_readable([line.fileno()], 10.0)
        assert message_link.receive(line) is None, "no process is to be had: told by the end of the line"
        line.close()
        _, later, _ = born_child(server, ring.fileno(), beat.fileno())
        assert told["sockets"] == sockets(), "one line each: the server's own is the server's"
        assert later["open"] == told["open"], "the server keeps none of what it hands on"
        children = Path(f"/proc/{server_pid}/task/{server_pid}/children")
        ends_s = time.monotonic() + 10.0
        while children.read_text() and time.monotonic() < ends_s:  # the child may have run before the server did
            time.sleep(0.001)
        assert children.read_text() == "", "no zombies either"


def test_what_a_child_imports_may_use_all_processors_and_the_server_one_thread(monkeypatch) -> None:
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    seen: list[str | None] = []

    def prepare(_: object) -> None:
        seen.append(os.environ.get("OPENBLAS_NUM_THREADS"))

    monkeypatch.setattr(fork_server, "import_module", lambda _: SimpleNamespace(prepare=prepare))
    fork_server.prepare({})
    gc.unfreeze()
    assert seen == ["1"]
    assert "OPENBLAS_NUM_THREADS" not in os.environ


def test_no_garbage_is_looked_for_until_all_is_read_and_then_in_what_is_new_only(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    looked, frozen = list[bool](), list[bool]()

    def read(*_: object) -> SimpleNamespace:
        looked.append(gc.isenabled())
        return SimpleNamespace(prepare=read)

    monkeypatch.setattr(fork_server, "import_module", read)
    monkeypatch.setattr(gc, "freeze", lambda: frozen.append(gc.isenabled()))
    fork_server.prepare({})
    assert looked == [False, False, False] and frozen == [False] and gc.isenabled()


@pytest.mark.parametrize(
    ("error", "is_told"),
    [
        (BlockingIOError(errno.EAGAIN, "no thread for the log"), True),
        (OSError(errno.EMFILE, "Too many open files"), True),
        (MemoryError(), True),
        (OSError(errno.EINVAL, "of our own making"), False),
        (KeyError("ours"), False),
    ],
)
def test_a_child_for_which_the_machine_has_too_little_says_so_and_any_other_end_is_traced(
    error: Exception, is_told: bool, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Below `ulimit -v 150000` six tracebacks stood in the log of a start."""

    def fail(*_: object) -> int:
        raise error

    monkeypatch.setattr(fork_server, "_run_child", fail)
    theirs, ended = os.pipe()
    fork_server._fork(SimpleNamespace(close=lambda: None), SimpleNamespace())  # type: ignore[arg-type]
    os.close(ended)
    assert os.read(theirs, 1) == b""  # as soon as the child, which has the other end too, has ended
    os.close(theirs)
    said = capfd.readouterr().err
    assert said.startswith("E106 it does not start (") is is_told and ("Traceback" in said) is not is_told


def test_a_process_that_is_started_by_itself_says_so_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """The simulated rig ended in a traceback where a container allowed nine tasks."""
    monkeypatch.setattr("sys.argv", ["a module", "7", "{}"])

    def fail(number: int) -> Callable[[list[str]], int]:
        def main(arguments: list[str]) -> int:
            assert arguments == ["7", "{}"]
            raise OSError(number, "as told")

        return main

    with pytest.raises(SystemExit, match=r"^E106 it does not start \(as told\)"):
        fork_server.run_main(fail(errno.EAGAIN))
    with pytest.raises(OSError, match="as told"):
        fork_server.run_main(fail(errno.EBADF))
    with pytest.raises(SystemExit, match=r"^69$"):
        fork_server.run_main(lambda _: 69)
