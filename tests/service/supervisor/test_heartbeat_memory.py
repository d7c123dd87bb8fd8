"""A loop that beats in shared memory: the guardian looks when the next beat is overdue, and is woken by none."""

import math
import os
from collections.abc import Iterator
from itertools import pairwise
from types import SimpleNamespace
from typing import cast

import pytest

from gateway.processes.exit_cause import EndCause, Ending
from gateway.processes.scheduling.scheduler_counters import ProcessorTime
from gateway.processes.systemd.service_manager import ServiceManager
from gateway.service.heartbeat_memory import HeartbeatMemory
from gateway.service.supervisor.child_process import Child
from gateway.service.supervisor.heartbeat import Heartbeat
from tests.service.supervisor.guarded import Scene, port
from tests.service.supervisor.scripted_children import assert_comes_up, lives, scene

__all__ = ["port", "scene"]
STALL_S = 0.1


@pytest.fixture
def beating(scene, port) -> Iterator[tuple[Scene, HeartbeatMemory]]:
    """A guardian whose control is up, and control's end of the memory."""
    one = scene(lives(port))
    one.guardian.share_memory()
    memory = HeartbeatMemory(one.guardian.beat)
    assert_comes_up(one)
    assert one.starter.arguments[0]["beat"] == one.guardian.beat
    yield one, memory
    memory.close()


def test_a_beat_is_the_time_that_the_other_end_reads() -> None:
    descriptor = os.memfd_create("beat")
    ours, theirs = HeartbeatMemory(descriptor), HeartbeatMemory(descriptor)
    assert theirs.beat_s == 0.0
    ours.beat(12.5)
    assert theirs.beat_s == 12.5
    for end in (ours, theirs):
        end.close()
    os.close(descriptor)


def beat_while_it_waits(one: Scene, memory: HeartbeatMemory, last_s: float) -> list[float]:
    """Let the loop beat each 10 ms until last_s. Returns the times at which the guardian has looked, as it runs."""
    looks: list[float] = []

    def wait(descriptors: list[int], timeout_s: float) -> set[int]:
        ready = one.wait(descriptors, timeout_s)
        looks.append(one.now_s)
        memory.beat(min(0.01 * math.floor(100.0 * one.now_s + 1e-6), last_s))
        return ready

    one.guardian.wait = wait
    return looks


def test_a_loop_that_beats_is_left_alone_and_looked_at_seldom(beating):
    one, memory = beating
    looks = beat_while_it_waits(one, memory, 200.0)
    one.run(lambda: one.now_s > 101.0)
    assert len(one.starter.started) == 1, one.said
    assert 9 <= len(looks) <= 14, "about once in 0.1 s, however often it beats"


def test_a_service_manager_hears_of_the_loop_in_time_however_long_a_stall_may_last(beating):
    one, memory = beating
    one.guardian.control.heartbeat.stall_s = 20.0
    one.guardian.manager = ServiceManager(watchdog_s=3.0)
    fed: list[float] = []
    one.guardian.manager._say = lambda words: fed.append(one.now_s)  # type: ignore[method-assign,assignment]
    beat_while_it_waits(one, memory, 200.0)
    one.run(lambda: one.now_s > 115.0)
    assert len(one.starter.started) == 1, one.said
    assert max(later - before for before, later in pairwise(fed)) < 3.0
    assert len(fed) >= 5


def test_silence_counts_from_the_last_beat(beating):
    one, memory = beating
    beat_while_it_waits(one, memory, 100.07)
    assert one.run(lambda: len(one.starter.started) == 2) is None
    assert one.now_s == pytest.approx(100.07 + STALL_S)
    assert Ending.from_json(one.starter.arguments[1]["restarted"]).cause is EndCause.STALLED


def test_a_time_that_has_not_come_counts_as_now_and_once(beating):
    one, memory = beating
    memory.beat(1e9)
    assert one.run(lambda: len(one.starter.started) == 2) is None
    assert one.now_s <= 100.0 + 2 * STALL_S + 1e-6


def test_what_is_no_time_is_no_beat(beating):
    one, memory = beating
    memory.beat(math.nan)
    assert one.run(lambda: len(one.starter.started) == 2) is None
    assert one.now_s == pytest.approx(100.0 + STALL_S)


def test_what_a_dead_process_has_left_is_no_beat_of_the_next(beating):
    one, memory = beating
    memory.beat(100.05)
    one.run(lambda: len(one.starter.started) == 2)
    assert_comes_up(one)
    ready_s = one.guardian.control.heartbeat.heard_s
    assert one.run(lambda: len(one.starter.started) == 3) is None
    assert one.now_s == pytest.approx(ready_s + STALL_S)


def test_a_guardian_that_wakes_late_waits_once_more_and_not_again() -> None:
    """The machine stood still for both, or so it seems; a loop that is silent then is silent by itself."""
    heartbeat, control = Heartbeat(), cast(Child, SimpleNamespace(counters=None))
    heartbeat.stall_s = 0.1
    heartbeat.record_beat(control, 10.0)
    assert not heartbeat.is_overdue(10.09)
    assert not heartbeat.is_overdue(10.5), "woken late"
    assert heartbeat.due_s == pytest.approx(10.52), "not as long as a whole stall"
    assert heartbeat.is_overdue(10.9), "late again"
    assert "900 ms without a tick" in heartbeat.why_silent(control, 10.9)().text, "since the beat, not since the waking"
    heartbeat.record_beat(control, 11.0)
    assert not heartbeat.is_overdue(11.5), "after a beat it has that chance anew"
    heartbeat.reset()
    heartbeat.record_beat(control, 12.0)
    assert not heartbeat.is_overdue(12.5), "and so has the next process"


def test_the_turn_that_a_kill_ends_is_counted_too() -> None:
    """A process that waits for a processor has waited as long as the kernel says once it got one, if only to be killed."""
    readings = iter([ProcessorTime(1.0, 5.0), ProcessorTime(1.0, 5.1)])
    counters = SimpleNamespace(read=lambda: next(readings), state=lambda: next(letters))
    letters = iter(["R", "Z"])
    heartbeat, control = Heartbeat(), cast(Child, SimpleNamespace(counters=counters))
    heartbeat.record_beat(control, 10.0)
    why = heartbeat.why_silent(control, 10.1)
    assert next(readings) == ProcessorTime(1.0, 5.1), "not read before the kill"
    readings = iter([ProcessorTime(1.0, 5.1)])
    assert why().cause is EndCause.MACHINE_BUSY


def test_a_silence_for_which_the_processor_was_withheld_is_none_of_the_loop_s(monkeypatch: pytest.MonkeyPatch) -> None:
    noted_s: list[float] = []
    kernel = SimpleNamespace(note=noted_s.append, lately=lambda: (0.1, "the host did it"))
    monkeypatch.setattr("gateway.service.supervisor.heartbeat.WithheldTime", lambda: kernel)
    heartbeat, control = Heartbeat(), cast(Child, SimpleNamespace(counters=None))
    heartbeat.record_beat(control, 10.0)
    ending = heartbeat.why_silent(control, 10.12)()
    assert noted_s == [10.0]
    assert ending.cause is EndCause.MACHINE_BUSY and "the host did it" in ending.text
