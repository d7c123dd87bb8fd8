"""A thread that the machine refuses: told as from a disk, and what was refused is not done later either."""

import asyncio
import threading
from typing import Any

import pytest

from gateway.processes.disk_worker import DiskWorker
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


def test_what_is_asked_for_behind_the_end_is_refused_as_by_a_disk_and_never_done() -> None:
    """A commit whose check was under way goes on to its next part, after the rig has closed: no defect of ours."""
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
