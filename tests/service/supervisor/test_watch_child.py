"""The guardian's part in the residual watch: restarts with growing pauses, gives up in time, never fails itself."""

import os
from dataclasses import dataclass, field
from math import inf

import pytest

from gateway.service.supervisor.watch_child import PAUSES_S, WatchSupervisor


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
class Nursery:
    children: list[FakeChild] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    error: OSError | None = None

    def spawn(self) -> FakeChild:
        if self.error:
            raise self.error
        self.children.append(FakeChild(100 + len(self.children)))
        return self.children[-1]


@pytest.fixture
def nursery() -> Nursery:
    return Nursery()


@pytest.fixture
def keeper(nursery: Nursery) -> WatchSupervisor:
    return WatchSupervisor(nursery.spawn, nursery.said.append)  # type: ignore[arg-type]


def dies(keeper: WatchSupervisor, now_s: float) -> None:
    keeper.follow([*keeper.sources], now_s)


def test_a_dead_watch_is_started_again_later_each_time_and_then_no_more(keeper, nursery):
    now_s = 0.0
    keeper.start(now_s)
    for number, pause_s in enumerate(PAUSES_S, 1):
        now_s += 1.0
        dies(keeper, now_s)
        assert keeper.due_s == now_s + pause_s
        assert keeper.sources == []
        keeper.follow([], now_s + pause_s - 0.01)
        assert len(nursery.children) == number
        now_s += pause_s
        keeper.follow([], now_s)
        assert len(nursery.children) == number + 1
    dies(keeper, now_s + 1.0)
    assert keeper.due_s == inf
    assert all(child.closed for child in nursery.children)
    assert [line[:4] for line in nursery.said] == ["A346"] * 4
    assert "stays off" in nursery.said[-1]
    keeper.start(now_s + 2.0)
    assert len(nursery.children) == 4, "a restarted control does not wake it"


def test_a_long_life_forgives_earlier_deaths(keeper, nursery):
    keeper.start(0.0)
    for day in range(1, 9):
        dies(keeper, day * 86400.0)
        keeper.follow([], day * 86400.0 + PAUSES_S[0])
    assert len(nursery.children) == 9


def test_a_start_that_fails_is_a_death_and_no_exception(keeper, nursery):
    nursery.error = OSError(11, "Resource temporarily unavailable")
    keeper.start(0.0)
    assert keeper.pid is None
    assert keeper.due_s == PAUSES_S[0]
    nursery.error = None
    keeper.follow([], PAUSES_S[0])
    assert keeper.pid == 4711


def test_what_lives_is_left_alone_and_ended_once(keeper, nursery):
    keeper.start(0.0)
    keeper.start(1.0)
    keeper.follow([os.getpid()], 2.0)
    assert len(nursery.children) == 1
    keeper.end()
    keeper.end()
    assert nursery.children[0].ended
    assert keeper.sources == []
