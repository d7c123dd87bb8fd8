"""The prepared process is a convenience: whatever becomes of it, children are started."""

import os
from collections.abc import Iterator
from importlib.util import find_spec
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
def kept(spawned: list[tuple[str, FakeChild]]) -> Iterator[tuple[ChildStarter, list[str]]]:
    said: list[str] = []
    one = ChildStarter("demo", simulate=True, state=Path("state"), say=said.append)
    one.open()
    yield one, said
    one.end()


def modules(spawned: list[tuple[str, FakeChild]]) -> list[str]:
    return [module.rpartition(".")[2] for module, _ in spawned]


def test_control_is_asked_of_the_prepared_process(kept, spawned):
    one, _ = kept
    child = one.control(ARGUMENTS)
    (asked,) = spawned[0][1].hears()
    assert (asked.tag, asked.body["module"]) == (message_link.FORK, fork_server.CONTROL)
    assert asked.body["arguments"].items() >= ARGUMENTS.items()
    assert len(asked.descriptors) == 2, "the child's end of its line, and where the rig is kept"
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
        assert one.due_s == inf, "it is there"
    spawned[-1][1].dies(-9)
    one.poll_child(set(one.sources), now_s)
    assert (one.due_s, one.sources, one.server_pid) == (inf, [], None)
    assert modules(spawned) == ["fork_server"] * 4
    assert [line[:4] for line in said] == ["A407"] * 4
    assert "it stays off" in said[-1]


def test_a_server_that_does_not_answer_is_killed_and_its_successor_is_given_time_again(kept, spawned):
    """Its imports take longer than a fork: from a server that never gave a child more is put up with."""
    one, _ = kept
    at_first_s = one.start_timeout_s
    one.on_born()
    assert one.start_timeout_s < at_first_s
    one.drop_server("does not answer", 0.0)
    assert spawned[0][1].exit_code == -9
    assert spawned[0][1].link.fileno() == -1
    assert one.start_timeout_s == at_first_s


def test_at_the_end_the_server_ends(kept, spawned):
    one, _ = kept
    one.end()
    assert spawned[0][1].exit_code is not None
    assert one.server_pid is None


def test_without_a_subreaper_there_is_no_server(spawned, monkeypatch):
    """What it forks would be nobody's child, and its exit code nobody's to read."""
    monkeypatch.setattr(fork_server, "become_subreaper", lambda: False)
    one = ChildStarter("demo", simulate=True, state=Path("state"), say=pytest.fail)
    one.open()
    assert (modules(spawned), one.due_s) == ([], inf)


def test_a_machine_that_has_no_process_for_the_server_is_no_reason_not_to_begin(monkeypatch):
    def none_left(*_: object, **__: object) -> FakeChild:
        raise BlockingIOError("Resource temporarily unavailable")

    monkeypatch.setattr(child_starter, "spawn_child", none_left)
    monkeypatch.setattr(fork_server, "become_subreaper", lambda: True)
    one = ChildStarter("demo", simulate=True, state=Path("state"), say=pytest.fail)
    one.open()
    assert one.server_pid is None


def test_control_is_forked_with_the_memories_that_it_shares(kept, spawned, tmp_path):
    one, _ = kept
    with (tmp_path / "ring").open("w") as ring, (tmp_path / "beat").open("w") as beat:
        one.control({"rig": "demo", "ring": ring.fileno(), "beat": beat.fileno()}).close()
        (asked,) = spawned[0][1].hears()
        assert [
            os.path.samestat(os.fstat(given), os.fstat(ours.fileno()))
            for given, ours in zip(asked.descriptors[1:3], (ring, beat), strict=True)
        ] == [True, True]
        asked.drop_descriptors()


def test_every_child_that_needs_the_rig_is_given_the_same_memory_of_it(kept, spawned, monkeypatch):
    """Also where the process that has read the rig is gone: it would read other files."""
    one, _ = kept
    passed: list[tuple[dict[str, int], tuple[int, ...]]] = []
    one.control(ARGUMENTS).close()
    one.rig(prepared=True).close()
    first, second = spawned[0][1].hears()
    files = {os.fstat(asked.descriptors[-1]).st_ino for asked in (first, second)}
    for asked in (first, second):
        asked.drop_descriptors()
    monkeypatch.setattr(child_starter, "spawn_child", lambda _, given, *shared: passed.append((given, shared)))
    spawned[0][1].dies(-9)
    one.poll_child(set(one.sources), 0.0)
    one.control(ARGUMENTS)
    ((arguments, shared),) = passed
    assert shared == (arguments["kept_rig"],)
    assert {os.fstat(arguments["kept_rig"]).st_ino} == files


def test_the_rig_is_forked_as_it_was_read_or_read_anew_and_stays_the_same_run(kept, spawned, monkeypatch):
    """What was set on it (`sim set`) is kept for one run of the gateway, in its state directory."""
    one, _ = kept
    told: list[dict] = []
    monkeypatch.setattr(child_starter, "spawn_child", lambda module, arguments, *_: told.append(arguments))
    one.rig(prepared=True).close()
    assert told == []
    (asked,) = spawned[0][1].hears()
    asked.drop_descriptors()
    one.rig(prepared=False)
    assert told == [{name: value for name, value in asked.body["arguments"].items() if name != "kept_rig"}]
    assert (told[0]["rig"], told[0]["simulate"], told[0]["state"]) == ("demo", True, "state")


@pytest.mark.parametrize("name", child_starter.OPTIONAL)
def test_a_child_that_control_can_do_without_shares_the_ring_and_the_socket(kept, monkeypatch, name):
    one, _ = kept
    asked: list[tuple[object, ...]] = []
    monkeypatch.setattr(child_starter, "spawn_child", lambda *words: asked.append(words))
    arguments = {"ring": 0, "listen": 7, "rig": "demo"}
    one.optional(name, arguments)
    one.optional(name, arguments | {"ring": None})
    module = child_starter.OPTIONAL[name]
    assert name in module.rpartition(".")[2]
    assert find_spec(module)
    assert [words[2:] for words in asked] == [(0, 7), (7,)]


@pytest.mark.parametrize("name", child_starter.OPTIONAL)
def test_a_child_that_control_can_do_without_has_the_rig_that_runs(kept, monkeypatch, name):
    """Its files may be half edited when it is started again."""
    one, _ = kept
    asked: list[tuple[dict, tuple[int, ...]]] = []
    monkeypatch.setattr(child_starter, "spawn_child", lambda _, given, *shared: asked.append((given, shared)))
    one.control(ARGUMENTS).close()
    one.optional(name, {"ring": None, "listen": 7, "rig": "demo"})
    ((arguments, shared),) = asked
    assert shared == (7, arguments["kept_rig"])
    assert "memfd:force-gateway" in str(Path(f"/proc/self/fd/{arguments['kept_rig']}").readlink())
