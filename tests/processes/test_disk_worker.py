"""A thread that the machine refuses: told as from a disk, and what was refused is not done later either."""

import asyncio
import os
import sys
import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest

from gateway.processes.disk_worker import DiskWorker, keep_end
from tests.disk.threads import join_disk_threads


def refuse(thread: threading.Thread) -> None:
    raise RuntimeError("can't start new thread")


def test_work_that_no_thread_can_be_had_for_is_refused_for_good(monkeypatch: pytest.MonkeyPatch) -> None:
    async def main() -> list[Any]:
        worker, ended = DiskWorker(), asyncio.Event()
        told: list[Any] = []
        with monkeypatch.context() as patch:
            patch.setattr(threading.Thread, "start", refuse)
            worker(lambda: done.append("refused"), told.append)
            with pytest.raises(OSError, match="no thread for the disk: can't start new thread"):
                worker.begin(lambda: done.append("refused, too"))
            await asyncio.sleep(0)
        worker(lambda: done.append("done"), lambda result: ended.set())
        await ended.wait()
        worker.close()
        return told

    done: list[str] = []
    (error,) = asyncio.run(main())
    assert isinstance(error, OSError)
    assert done == ["done"]


def test_work_that_fails_comes_back_with_its_error_and_the_next_is_done() -> None:
    """Whoever asked waits for a word: of an upload that a full disk refuses, say, which would be under way for ever."""

    def fail() -> None:
        raise OSError(28, "full")

    async def main() -> list[Any]:
        worker, told, ended = DiskWorker(), list[Any](), asyncio.Event()
        worker(fail, told.append)
        worker(lambda: "done", lambda result: (told.append(result), ended.set()))
        async with asyncio.timeout(10.0):
            await ended.wait()
        worker.close()
        return told

    error, result = asyncio.run(main())
    assert isinstance(error, OSError) and error.errno == 28 and result == "done"


def test_what_is_asked_for_behind_the_end_is_refused_as_by_a_disk_and_never_done() -> None:
    """A commit whose check was under way goes on to its next part, after the rig has closed: no defect of ours."""
    join_disk_threads()  # those of tests before
    done: list[str] = []

    async def main() -> list[Any]:
        worker, ended, told = DiskWorker(), asyncio.Event(), list[Any]()
        worker(lambda: done.append("before"), lambda result: ended.set())
        await ended.wait()
        worker.close()
        worker(lambda: done.append("behind"), told.append)
        with pytest.raises(OSError, match="no thread for the disk: cannot schedule"):
            worker.begin(lambda: done.append("behind, too"))
        await asyncio.sleep(0)
        return told

    (error,) = asyncio.run(main())
    assert isinstance(error, OSError)
    assert join_disk_threads() <= 1
    assert done == ["before"]


@pytest.fixture
def own_turns() -> Iterator[None]:
    """As each process begins; a worker of the gate takes longer ones."""
    before_s, policy = sys.getswitchinterval(), os.sched_getscheduler(0)
    sys.setswitchinterval(5e-3)
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    yield
    sys.setswitchinterval(before_s)
    os.sched_setscheduler(0, policy, os.sched_param(0))


def test_work_that_calculates_does_not_hold_up_the_loop(own_turns: None) -> None:
    """Else it calculates for 5 ms more at each wake-up. Asked is what it has had of a processor meanwhile, which a busy machine
    does not change as it does the time that passes."""

    join_disk_threads()

    async def main() -> list[float]:
        worker, ended, calculated_s = DiskWorker(), threading.Event(), list[float]()
        begun, clock = threading.Event(), list[int]()

        def calculate() -> None:
            clock.append(time.pthread_getcpuclockid(threading.get_ident()))
            begun.set()
            while not ended.is_set():
                pass

        worker.begin(calculate)
        begun.wait()
        for _ in range(40):
            before_s = time.clock_gettime(clock[0])
            await asyncio.sleep(1e-3)
            calculated_s.append(time.clock_gettime(clock[0]) - before_s)
        ended.set()
        worker.close()
        return sorted(calculated_s)

    calculated_s = asyncio.run(main())
    assert join_disk_threads() <= 1
    assert calculated_s[30] < 1.9e-3  # the loop sleeps for one of them


def test_the_ends_of_the_last_eight_jobs_are_known_and_no_more() -> None:
    """They are told with each status: of a year of jobs the answer would outgrow its line."""
    ends: dict[str, dict[str, Any]] = {}
    for job in range(1, 21):
        keep_end(ends, job, said=f"job {job}")
    assert ends == {str(job): {"said": f"job {job}"} for job in range(13, 21)}
