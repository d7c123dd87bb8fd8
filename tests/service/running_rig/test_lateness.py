"""What kept our loop, or the process behind a simulated rig, from running: read from ticks and from the kernel's counters."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest

from gateway.control.blame_for_silence import Held
from gateway.devices.force_reading import ForceReading
from gateway.processes.scheduling.scheduler_counters import SchedulerCounters
from gateway.processes.scheduling.withheld_time import WithheldTime
from gateway.service.running_rig.lateness import Lateness
from gateway.service.running_rig.running_rig import RunningRig
from tests.service.rigs import demo
from tests.service.wired import Wired

TICK_S = 0.01
PID = 7


class Kernel:
    """A rig's process whose counters the test writes, beside a loop that ticks."""

    def __init__(self, folder: Path) -> None:
        self._process = folder / str(PID)
        self._process.mkdir()
        self.now_s, self.waited_s = 100.0, 5.0
        self.ran_ns, self.rig_waited_ns = 9_000_000_000, 3_000_000_000  # of a process that has run for long
        self.write("S")
        self.withheld = 0.0, ""
        counter = SimpleNamespace(note=lambda now_s: None, lately=lambda: self.withheld)
        self.lateness = Lateness(TICK_S, cast(WithheldTime, counter))
        self.lateness.follow_rig(SchedulerCounters(PID, folder))

    def write(self, state: str) -> None:
        (self._process / "schedstat").write_text(f"{self.ran_ns} {self.rig_waited_ns} 1\n")
        (self._process / "stat").write_text(f"{PID} (rig) {state} 1\n")

    def ticks(self, count: int, *, rig_runs: bool = True, rig_waits_s: float = 0.0) -> None:
        for _ in range(count):
            self.now_s += TICK_S
            self.ran_ns += 100_000 if rig_runs else 0
            self.rig_waited_ns += round(rig_waits_s * 1e9)
            self.write("S")
            self.lateness.tick(self.now_s, self.waited_s)

    def stall(self, seconds: float, waited_s: float) -> None:
        """Our loop does not come by."""
        self.now_s += seconds
        self.waited_s += waited_s

    def held(self, silent_s: float) -> Held:
        return self.lateness.since(self.now_s - silent_s, self.now_s, self.waited_s)


@pytest.fixture
def kernel(tmp_path: Path) -> Iterator[Kernel]:
    one = Kernel(tmp_path)
    one.ticks(50)
    yield one
    one.lateness.close()


def test_a_loop_and_a_rig_that_come_in_time_explain_no_silence(kernel: Kernel) -> None:
    assert kernel.held(0.3) == Held(loop_waited_s=0.0)


@pytest.mark.parametrize("is_over", [True, False])
def test_a_loop_that_came_late_says_how_late_and_how_much_it_waited(kernel: Kernel, is_over: bool) -> None:
    kernel.stall(0.25, waited_s=0.2)
    if is_over:
        kernel.ticks(1)
    held = kernel.held(0.25 + is_over * TICK_S)
    assert held.loop_late_s == pytest.approx(0.24 + 0.01 * is_over, abs=0.011)
    assert held.loop_waited_s == pytest.approx(0.2, abs=0.02)
    kernel.ticks(100)
    assert kernel.held(0.5).loop_late_s == 0.0, "what was before the silence explains nothing"


def test_a_loop_has_waited_for_no_longer_than_it_is_late(kernel: Kernel) -> None:
    """It waited in its own period, too."""
    kernel.stall(0.25, waited_s=0.25)
    held = kernel.held(0.25)
    assert held.loop_waited_s == held.loop_late_s == pytest.approx(0.24)


def test_where_the_kernel_counts_no_turns_a_late_loop_is_late_all_the_same(kernel: Kernel) -> None:
    kernel.ticks(5)
    kernel.stall(0.3, 0.2)
    held = kernel.lateness.since(kernel.now_s - 0.3, kernel.now_s, None)
    assert held.loop_late_s == pytest.approx(0.29) and held.loop_waited_s is None


def test_a_rig_that_takes_the_place_of_a_stopped_one_was_not_stopped(kernel: Kernel, tmp_path: Path) -> None:
    for _ in range(10):
        kernel.ticks(1, rig_runs=False)
        kernel.write("T")
        kernel.lateness.tick(kernel.now_s, kernel.waited_s)
    assert kernel.held(0.1).rig_stopped_s > 0.0
    kernel.lateness.follow_rig(SchedulerCounters(PID, tmp_path))
    kernel.ticks(2)
    assert kernel.held(0.1).rig_stopped_s == 0.0


def test_what_was_withheld_counts_where_the_loop_came_late(kernel: Kernel) -> None:
    kernel.withheld = 0.1, "the host"
    assert kernel.held(0.3) == Held(loop_waited_s=0.0), "in time all the same"
    kernel.stall(0.12, waited_s=0.0)
    held = kernel.held(0.12)
    assert (held.withheld, held.loop_waited_s) == ((0.1, "the host"), 0.0)


def test_a_rig_that_waits_for_a_processor_is_seen_while_it_waits_and_after(kernel: Kernel) -> None:
    kernel.ticks(20, rig_runs=False)
    kernel.write("R")
    kernel.withheld = 0.15, "a quota"
    assert kernel.held(0.2).rig_waited_s == pytest.approx(0.2, abs=0.011)
    assert kernel.held(0.2).withheld == (0.15, "a quota"), "while it lasts, too"
    kernel.ticks(1, rig_waits_s=0.2)
    assert kernel.held(0.21).rig_waited_s == pytest.approx(0.2, abs=0.011)


@pytest.mark.parametrize(("state", "stopped_s"), [("T", 0.2), ("t", 0.2), ("S", 0.0), ("D", 0.0)])
def test_a_rig_that_sleeps_is_silent_of_its_own(kernel: Kernel, state: str, stopped_s: float) -> None:
    kernel.ticks(20, rig_runs=False)
    kernel.write(state)
    held = kernel.held(0.2)
    assert held.rig_stopped_s == pytest.approx(stopped_s, abs=0.011)
    assert held.rig_waited_s == 0.0


@pytest.mark.parametrize(("state", "stopped_s"), [("T", 0.2), ("S", 0.0)])
def test_a_stop_of_the_rig_is_remembered_when_it_has_ended(kernel: Kernel, state: str, stopped_s: float) -> None:
    """What it answers then is torn, and a motor's cable was blamed."""
    for _ in range(20):
        kernel.now_s += TICK_S
        kernel.write(state)
        kernel.lateness.tick(kernel.now_s, kernel.waited_s)
    kernel.ticks(30)
    assert kernel.held(1.0).rig_stopped_s == pytest.approx(stopped_s, abs=0.015)
    assert kernel.held(0.25).rig_stopped_s == 0.0


def test_a_stopped_process_is_told_from_a_silent_one() -> None:
    process = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    lateness = Lateness(TICK_S, WithheldTime())
    lateness.follow_rig(SchedulerCounters(process.pid))
    try:
        os.kill(process.pid, signal.SIGSTOP)
        os.waitid(os.P_PID, process.pid, os.WSTOPPED)
        for now_s in range(
            500
        ):  # it is told as stopped before it has left its processor, and its last turn is counted then
            lateness.tick(now_s, None)
            held = lateness.since(now_s, now_s + 0.1, None)
            if held.rig_stopped_s:
                break
            time.sleep(0.01)
        assert held.rig_stopped_s == pytest.approx(0.1)
        assert held.loop_waited_s is None
    finally:
        process.kill()
        process.communicate()
        lateness.close()


def test_only_a_cell_that_streams_leads_the_tick() -> None:
    """One that is asked at a tick answers behind it: followed, it would push the tick on and on."""
    wired = Wired()
    assert wired.loop.streamed_s is None
    wired.ready()
    assert wired.loop.streamed_s == pytest.approx(wired.now_s, abs=0.011)
    reading = ForceReading(ask="W?", frame="W {force:+08.2f}", unit="N")
    polled = replace(demo().load_cell.device, stream=None, read_force=reading)
    asked = Wired(replace(demo(), load_cell=replace(demo().load_cell, device=polled, unit=None)))
    asked.until(lambda: asked.loop.sample is not None, 2.0)
    assert asked.loop.streamed_s is None


def test_behind_a_restart_of_the_simulated_rig_the_turns_of_the_new_process_are_counted(tmp_path: Path) -> None:
    """Else a rig that stands still is a wire that is cut."""
    kernel, moved = Kernel(tmp_path), list[dict[str, str]]()
    rig = object.__new__(RunningRig)
    rig.__dict__ |= {
        "_guardian": SimpleNamespace(rig_pid=os.getpid()),
        "_lateness": kernel.lateness,
        "_ports": SimpleNamespace(move=moved.append),
    }
    before = kernel.lateness._rig
    rig.move_ports({"output": "/dev/pts/9"})
    assert moved == [{"output": "/dev/pts/9"}]
    assert kernel.lateness._rig not in (None, before)
    kernel.lateness.close()
