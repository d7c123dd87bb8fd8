"""The guardian's part in a child that control can do without: it is started again
with growing pauses, given up in time, and never makes the guardian fail."""

import os
import socket
from dataclasses import dataclass, field
from itertools import accumulate
from math import inf
from types import SimpleNamespace

import pytest

from gateway.service.supervisor import other_children
from gateway.service.supervisor.child_process import LOST
from gateway.service.supervisor.optional_child import OptionalChildSupervisor
from gateway.service.supervisor.other_children import OtherChildren
from gateway.service.supervisor.restart_policy import HELPER_PAUSES_S


@dataclass
class FakeChild:
    """A child that dies when told; `died` is any number that is its own."""

    died: int
    code: int = 1
    pid: int = 4711
    closed: bool = False
    ended: bool = False

    def wait(self) -> int:
        return self.code

    def close(self) -> None:
        self.closed = True

    def end(self) -> None:
        self.ended = True


@dataclass
class FakeStarter:
    children: list[FakeChild] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    error: OSError | None = None

    def spawn(self) -> FakeChild:
        if self.error:
            raise self.error
        self.children.append(FakeChild(100 + len(self.children)))
        return self.children[-1]


@pytest.fixture
def starter() -> FakeStarter:
    return FakeStarter()


@pytest.fixture
def supervisor(starter: FakeStarter) -> OptionalChildSupervisor:
    return OptionalChildSupervisor("the page", starter.spawn, starter.said.append)  # type: ignore[arg-type]


def dies(supervisor: OptionalChildSupervisor, now_s: float) -> None:
    supervisor.poll_child([*supervisor.sources], now_s)


def test_a_dead_child_is_started_again_later_each_time_and_then_no_more(supervisor, starter):
    now_s = 0.0
    supervisor.start(now_s)
    for number, pause_s in enumerate(HELPER_PAUSES_S, 1):
        now_s += 1.0
        dies(supervisor, now_s)
        assert supervisor.due_s == now_s + pause_s
        assert supervisor.sources == []
        supervisor.poll_child([], now_s + pause_s - 0.01)
        assert len(starter.children) == number
        now_s += pause_s
        supervisor.poll_child([], now_s)
        assert len(starter.children) == number + 1
    dies(supervisor, now_s + 1.0)
    assert supervisor.due_s == inf
    assert all(child.closed for child in starter.children)
    assert [line[:4] for line in starter.said] == ["A346"] * 4
    assert starter.said[-1].startswith("A346 the page ended (exit 1) 4 times: it stays off")
    supervisor.start(now_s + 2.0)
    assert len(starter.children) == 4, "a restarted control does not wake it"


def test_behind_the_last_death_who_calls_is_refused_and_who_waits_is_sent_away():
    """A browser waited without an end: the port listened on, for nobody."""

    def refuse(name, arguments):
        raise OSError(11, "Resource temporarily unavailable")

    starter = SimpleNamespace(sources=[], due_s=inf, poll_child=lambda readable, now_s: None, optional=refuse)
    children = OtherChildren(starter, lambda cause, sentence: None, lambda answer: None)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        address = listener.getsockname()
        children.provide_optional("web", {"listen": listener.fileno()}, 0.0)
        waiting = socket.create_connection(address, 5.0)
        for now_s in accumulate(HELPER_PAUSES_S):
            socket.create_connection(address, 5.0).close()
            children.poll_children(set(), now_s)
        with waiting, pytest.raises(ConnectionError):
            assert waiting.recv(1) == b"never"
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(address, 5.0)
        assert os.fstat(listener.fileno()), "the next control process is told of it: it opens no other"


def test_a_long_life_forgives_earlier_deaths(supervisor, starter):
    supervisor.start(0.0)
    for day in range(1, 9):
        dies(supervisor, day * 86400.0)
        supervisor.poll_child([], day * 86400.0 + HELPER_PAUSES_S[0])
    assert len(starter.children) == 9


def test_a_start_that_fails_is_a_death_and_no_exception(supervisor, starter):
    starter.error = OSError(11, "Resource temporarily unavailable")
    supervisor.start(0.0)
    assert supervisor.pid is None
    assert supervisor.due_s == HELPER_PAUSES_S[0]
    starter.error = None
    supervisor.poll_child([], HELPER_PAUSES_S[0])
    assert supervisor.pid == 4711


def test_what_lives_is_left_alone_and_ended_once(supervisor, starter):
    supervisor.start(0.0)
    supervisor.start(1.0)
    supervisor.poll_child([os.getpid()], 2.0)
    assert len(starter.children) == 1
    supervisor.end()
    supervisor.end()
    assert starter.children[0].ended
    assert supervisor.sources == []


def test_a_long_life_is_counted_from_its_beginning(supervisor, starter):
    """The machine's clock has run for days."""
    now_s = 1e6
    supervisor.start(now_s)
    for pause_s in (*HELPER_PAUSES_S, 0.0):
        dies(supervisor, now_s)
        now_s += pause_s
        supervisor.poll_child([], now_s)
    assert supervisor.due_s == inf
    assert "it stays off" in starter.said[-1]


def test_a_child_that_nobody_could_ask_is_said_to_have_no_exit_code(supervisor, starter):
    supervisor.start(0.0)
    starter.children[0].code = LOST
    dies(supervisor, 1.0)
    assert "(no exit code)" in starter.said[0]


def test_behind_each_wait_it_is_counted_whom_the_kernel_has_killed(monkeypatch):
    """Else a kill by hand would be told with the shortage of an hour ago as its reason."""
    looks = []
    monkeypatch.setattr(other_children, "memory_kills", SimpleNamespace(look=lambda: looks.append(1)))
    starter = SimpleNamespace(sources=[], due_s=inf, poll_child=lambda readable, now_s: None)
    children = OtherChildren(starter, lambda cause, sentence: None, lambda answer: None)
    for now_s in (1.0, 2.0):
        children.poll_children(set(), now_s)
    assert len(looks) == 2
