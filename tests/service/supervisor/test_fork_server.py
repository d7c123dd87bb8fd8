"""A forked child begins only when the guardian follows it: one that was given up must not become a second control."""

import os
import socket
from collections.abc import Iterator
from pathlib import Path

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
