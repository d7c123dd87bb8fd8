"""The prepared process is a convenience: whatever becomes of it, children are started."""

from collections.abc import Iterator
from math import inf
from pathlib import Path

import pytest

from gateway.processes import message_link
from gateway.service.supervisor import child_starter, fork_server
from gateway.service.supervisor.child_starter import ChildStarter
from gateway.service.supervisor.restart_policy import HELPER_PAUSES_S
from tests.service.supervisor.guarded import FakeChild

ARGUMENTS = {"rig": "demo", "ring": None}


@pytest.fixture
def spawned(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[tuple[str, FakeChild]]]:
    """What was started the long way; the fork server is one of them."""
    made: list[tuple[str, FakeChild]] = []

    def spawn(module: str, *_: object, **__: object) -> FakeChild:
        child = FakeChild(len(made))
        child.attach(0)
        made.append((module, child))
        return child

    monkeypatch.setattr(child_starter, "spawn_child", spawn)
    monkeypatch.setattr(fork_server, "become_subreaper", lambda: True)
    yield made
    for _, child in made:
        child.dies(0)
        child.close()


@pytest.fixture
def kept(spawned: list[tuple[str, FakeChild]]) -> tuple[ChildStarter, list[str]]:
    said: list[str] = []
    one = ChildStarter("demo", simulate=True, state=Path("state"), say=said.append)
    one.open()
    return one, said


def modules(spawned: list[tuple[str, FakeChild]]) -> list[str]:
    return [module.rpartition(".")[2] for module, _ in spawned]


def test_control_is_asked_of_the_prepared_process(kept, spawned):
    one, _ = kept
    child = one.control(ARGUMENTS)
    (asked,) = spawned[0][1].hears()
    assert (asked.tag, asked.body) == (message_link.FORK, {"module": fork_server.CONTROL, "arguments": ARGUMENTS})
    assert len(asked.descriptors) == 1, "the child's end of its line"
    asked.drop_descriptors()
    assert message_link.receive(child.link) is None, "a server that drops it ends the line: nobody waits"
    child.close()
    assert modules(spawned) == ["fork_server"]


def test_after_a_stillbirth_one_child_is_started_the_long_way(kept, spawned):
    one, said = kept
    one.on_not_born()
    one.control(ARGUMENTS)
    one.control(ARGUMENTS).close()
    assert modules(spawned) == ["fork_server", "control_process"]
    assert said == []
    for message in spawned[0][1].hears():
        message.drop_descriptors()


def test_a_server_that_is_gone_costs_no_start(kept, spawned):
    one, _ = kept
    spawned[0][1].dies(-9)
    one.control(ARGUMENTS)
    one.rig(prepared=True)
    one.rig(prepared=False)
    assert modules(spawned) == ["fork_server", "control_process", "simulated_rig", "simulated_rig"]


def test_a_server_that_keeps_dying_is_given_up_in_the_end(kept, spawned):
    one, said = kept
    now_s = 0.0
    for pause_s in HELPER_PAUSES_S:
        spawned[-1][1].dies(-9)
        one.poll_child(set(one.sources), now_s)
        assert one.due_s == now_s + pause_s
        now_s += pause_s
        one.poll_child(set(), now_s)
    spawned[-1][1].dies(-9)
    one.poll_child(set(one.sources), now_s)
    assert (one.due_s, one.sources, one.server_pid) == (inf, [], None)
    assert modules(spawned) == ["fork_server"] * 4
    assert [line[:4] for line in said] == ["A407"] * 4
    assert "it stays off" in said[-1]
