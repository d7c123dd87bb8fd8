"""Real processes, really killed: at seeded moments of their start, and while they work."""

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable

import psutil
import pytest

from tests.end_to_end.conftest import RunningGateway

OFF, HOLDING, FAULT = 0, 3, 4
RESTARTS = 5
CONTROL = "gateway.service.control_process"


def child_of(gateway: RunningGateway, module: str, other_than: int = 0, within_s: float = 10.0) -> psutil.Process:
    """The guardian's child that runs this module, as soon as there is one."""
    deadline_s = time.monotonic() + within_s
    while time.monotonic() < deadline_s:
        for child in psutil.Process(gateway.process.pid).children():
            if child.pid != other_than and module in command_of(child):
                return child
        time.sleep(0.001)
    raise AssertionError(f"no {module} within {within_s} s: {gateway.log.read_text()}")


def command_of(process: psutil.Process) -> list[str]:
    try:
        return list(process.cmdline())
    except psutil.Error:
        return []


def until(condition: Callable[[], bool], within_s: float = 10.0) -> None:
    deadline_s = time.monotonic() + within_s
    while not condition():
        assert time.monotonic() < deadline_s
        time.sleep(0.005)


def reconnect(gateway: RunningGateway) -> None:
    gateway.next_ready()
    gateway.client.close()
    assert gateway.client.connect()


def test_a_control_process_killed_at_any_moment_of_its_start_comes_up_in_the_end(running):
    """As often as the guardian starts one again within a minute."""
    moment = random.Random(11)
    killed = 0
    for _ in range(RESTARTS):
        control = child_of(running, CONTROL, other_than=killed)
        killed = control.pid
        time.sleep(moment.uniform(0.0, 0.15))
        control.kill()
        control.wait(5)
    running.client.close()
    until(running.client.connect)
    assert running.status()["state"] == OFF
    assert running.words(111, 1)[0] & 1, "restarted"
    assert running.log.read_text().count("A401") == RESTARTS
    assert running.process.poll() is None


@pytest.mark.skipif(os.geteuid() != 0 or len(os.sched_getaffinity(0)) < 2, reason="needs SCHED_FIFO and a second core")
def test_a_machine_that_does_not_let_the_loop_run_is_named_as_the_cause(shared):
    """One core for control, taken from it for longer than stall_s by a process that has every priority."""
    core = min(os.sched_getaffinity(0))
    control = shared.ready["pids"]["control"]
    os.sched_setaffinity(control, {core})
    hog = (
        f"import os, time; os.sched_setaffinity(0, {{{core}}}); "
        "os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(50)); end_s = time.monotonic() + 0.6\n"
        "while time.monotonic() < end_s: pass"
    )
    subprocess.run([sys.executable, "-c", hog], check=True)
    line = shared.said("A401", within_s=5.0)
    print(line)
    assert "(A403)" in line
    reconnect(shared)
    assert shared.words(110, 1) == [16], "machine_busy"
    assert shared.words(111, 1)[0] & 1, "restarted"
    assert any("A403" in note for note in shared.ready["notes"])


def test_whoever_else_dies_the_gateway_goes_on(rested):
    assert_a_simulated_rig_comes_back_and_presses_again(rested)
    assert_a_restart_without_fork_server_only_takes_longer(rested)


def assert_a_restart_without_fork_server_only_takes_longer(running: RunningGateway) -> None:
    os.kill(running.ready["pids"]["fork_server"], signal.SIGKILL)
    assert "another one in 5 s" in running.said("A407")
    os.kill(running.ready["pids"]["control"], signal.SIGKILL)
    reconnect(running)
    assert "fork_server" not in running.ready["pids"]
    assert running.status()["state"] == OFF
    assert not running.write(0, 1, 1000).isError()
    running.wait_until(lambda status: status["state"] == HOLDING)


def assert_a_simulated_rig_comes_back_and_presses_again(running: RunningGateway) -> None:
    assert not running.write(0, 1, 1000).isError()
    running.wait_until(lambda status: status["state"] == HOLDING)
    os.kill(running.ready["pids"]["rig"], signal.SIGKILL)
    running.wait_until(lambda status: status["state"] == FAULT)
    assert "started again" in running.said("A408")
    until(lambda: not running.write(0, 2, 0).isError())
    running.wait_until(lambda status: status["state"] == OFF)
    until(lambda: not running.write(0, 1, 1000).isError())
    running.wait_until(lambda status: status["state"] == HOLDING)
    assert running.process.poll() is None
