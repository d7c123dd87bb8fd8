"""A silent loop: was it not let run, or did it not want to? And what priority our processes take."""

import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from gateway.codes.explanation import BUSY_CURE
from gateway.processes.exit_cause import EndCause
from gateway.processes.scheduling import priority
from gateway.processes.scheduling.scheduler_counters import (
    ProcessorTime,
    SchedulerCounters,
    Silence,
    explain_silence,
    load_of_machine,
    time_between,
)
from gateway.service.supervisor.restart_policy import RestartPolicy

BUSY, STALLED, STOPPED = EndCause.MACHINE_BUSY, EndCause.STALLED, EndCause.STOPPED


@pytest.mark.parametrize(
    ("ran_s", "waited_s", "state", "cause"),
    [
        (0.002, 0.100, "R", BUSY),
        (0.030, 0.070, "R", BUSY),
        (0.030, 0.060, "S", BUSY),  # it got its turn in the end, and sleeps now
        (0.100, 0.002, "R", STALLED),  # it calculates
        (0.000, 0.000, "S", STALLED),  # it waits for something
        (0.000, 0.000, "D", STALLED),
        (0.000, 0.010, "S", STALLED),
        (0.000, 0.000, "T", STOPPED),
        (0.000, 0.100, "t", STOPPED),  # whatever it waited for besides
    ],
)
def test_the_largest_part_of_a_silence_is_its_cause(ran_s: float, waited_s: float, state: str, cause: EndCause) -> None:
    ending = explain_silence(
        Silence(0.104, 0.1, ProcessorTime(ran_s, waited_s), state, was_late=False), "load 8.40 on 2 cores"
    )
    assert ending.cause is cause
    assert "104 ms without a tick, allowed 100 ms (stall_s)" in ending.text
    if cause is BUSY:
        assert f"waited {waited_s * 1e3:.0f} ms for a processor, ran {ran_s * 1e3:.0f} ms" in ending.text
        assert "load 8.40 on 2 cores" in ending.text
        assert "--realtime" in ending.text
    assert ("for a disk or a driver" in ending.text) is (state == "D")


@pytest.mark.parametrize(("was_late", "cause"), [(True, BUSY), (False, STALLED)])
def test_a_kernel_that_counts_nothing_leaves_our_own_lateness(was_late: bool, cause: EndCause) -> None:
    told = explain_silence(Silence(0.2, 0.1, None, "", was_late), "the load is not known")
    assert told.cause is cause and (BUSY_CURE in told.sentence) is was_late


def test_what_the_kernel_says_is_read_as_it_stands(tmp_path: Path) -> None:
    process = tmp_path / "7"
    process.mkdir()
    (process / "schedstat").write_text("1500000000 250000000 42\n")
    (process / "stat").write_text("7 (a )b( c) D 1 7 7 0\n")
    turns = SchedulerCounters(7, tmp_path)
    assert turns.read() == ProcessorTime(1.5, 0.25)
    assert turns.state() == "D"
    assert time_between(ProcessorTime(1.0, 0.25), turns.read()) == ProcessorTime(0.5, 0.0)
    turns.close()
    assert turns.read() is None


def test_a_kernel_without_counters_is_no_error(tmp_path: Path) -> None:
    turns = SchedulerCounters(7, tmp_path)
    assert turns.read() is None
    assert turns.state() == ""
    assert time_between(ProcessorTime(), turns.read()) is None
    turns.close()
    assert load_of_machine(tmp_path) == "the load is not known"


def test_the_load_is_told_in_numbers(tmp_path: Path) -> None:
    (tmp_path / "loadavg").write_text("8.40 2.10 1.05 3/120 4711\n")
    assert load_of_machine(tmp_path).startswith("load 8.40 on ")
    (tmp_path / "pressure").mkdir()
    (tmp_path / "pressure" / "cpu").write_text("some avg10=62.30 avg60=10.00 avg300=2.00 total=117352184\n")
    assert load_of_machine(tmp_path).endswith("cores, pressure 62 %")


def test_a_real_process_that_calculates_is_told_from_one_that_was_stopped() -> None:
    """The counters are read behind the kill, from the zombie: as the guardian does."""
    process = subprocess.Popen([sys.executable, "-c", "print(flush=True)\nwhile True: pass"], stdout=subprocess.PIPE)
    assert process.stdout
    process.stdout.readline()
    turns = SchedulerCounters(process.pid)
    before = turns.read()
    if before is None:
        pytest.skip("this kernel has no schedstat")
    while (used := time_between(before, turns.read())) and used.on_cpu_s < 0.02:
        time.sleep(0.001)
    process.send_signal(signal.SIGSTOP)
    while turns.state() != "T":
        time.sleep(0.001)
    ended = os.pidfd_open(process.pid)
    process.kill()
    os.waitid(os.P_PIDFD, ended, os.WEXITED | os.WNOWAIT)
    used = time_between(before, turns.read())
    assert used
    assert used.on_cpu_s >= 0.02
    turns.close()
    os.close(ended)
    process.wait()
    process.stdout.close()


def test_restarts_are_counted_by_cause_and_given_time_when_none_comes_up() -> None:
    restarts = RestartPolicy()
    pauses = [restarts.count(now_s, EndCause.NOT_STARTED) for now_s in range(5)]
    assert pauses == [0.0, 0.0, 0.25, 0.5, 1.0]
    assert restarts.count(5, BUSY) is None
    assert restarts.causes.most_common(1) == [(EndCause.NOT_STARTED, 5)]
    assert [restarts.count(now_s, BUSY) for now_s in (100, 200, 300, 400)] == [2.0, 4.0, 4.0, 4.0]


def test_what_was_ready_is_started_again_at_once() -> None:
    restarts = RestartPolicy()
    for now_s in (0, 61, 122, 183, 244, 305, 366):
        assert restarts.count(now_s, EndCause.DIED) == 0.0
        restarts.came_up()


def taken(wanted: int, *before: str) -> int:
    """The nice value that a process of its own comes to, after these statements."""
    code = "; ".join(
        [
            "import os, resource",
            "from gateway.processes.scheduling import priority",
            *before,
            f"print(priority.set_nice({wanted}))",
        ]
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, start_new_session=True
    )
    return int(done.stdout)


def test_somebody_who_asked_for_less_keeps_it_and_helpers_go_behind() -> None:
    nice = os.getpriority(os.PRIO_PROCESS, 0)
    less = max(nice, 3)
    assert taken(priority.LOOP_NICE, f"os.nice({less - nice})") == less
    assert taken(priority.HELPER_NICE) == max(nice, priority.HELPER_NICE)


@pytest.mark.skipif(os.geteuid() != 0, reason="as root this test becomes nobody, who has no rights")
def test_who_may_not_stays_where_he_is_in_silence() -> None:
    nice = os.getpriority(os.PRIO_PROCESS, 0)
    assert taken(priority.LOOP_NICE, "resource.setrlimit(resource.RLIMIT_NICE, (0, 0))", "os.setuid(65534)") == nice
    assert taken(priority.LOOP_NICE, f"os.nice({-nice})") == priority.LOOP_NICE


@pytest.mark.parametrize(
    ("soft_limit", "comes_to"), [(0, 0), (20, 0), (24, -4), (40, -10), (resource.RLIM_INFINITY, -10)]
)
def test_who_may_a_little_takes_that(monkeypatch: pytest.MonkeyPatch, soft_limit: int, comes_to: int) -> None:
    """The kernel's rule: a limit of 24 allows -4."""
    has = [0]

    def set_to(which: int, who: int, nice: int) -> None:
        if nice < has[0] and soft_limit != resource.RLIM_INFINITY and 20 - nice > soft_limit:
            raise PermissionError
        has[0] = nice

    monkeypatch.setattr(os, "setpriority", set_to)
    monkeypatch.setattr(os, "getpriority", lambda which, who: has[0])
    monkeypatch.setattr(resource, "getrlimit", lambda which: (soft_limit, soft_limit))
    assert priority.set_nice(priority.LOOP_NICE) == comes_to
