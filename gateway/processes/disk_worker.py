"""Work that waits for a disk, in a thread of its own, so that the control loop does not."""

import asyncio
import contextlib
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

Work = Callable[[], Any]
Done = Callable[[Any], None]
"""done(result), or done(exception) when the work raised one."""


class DiskWorker:
    """One thread; what it is given runs one after the other. Called in a running loop, where `done` is called back."""

    def __init__(self) -> None:
        self._threads = ThreadPoolExecutor(max_workers=1, thread_name_prefix="calibration")

    def __call__(self, work: Work, done: Done) -> None:
        loop = asyncio.get_running_loop()

        def come_back(future: Future[Any]) -> None:
            with contextlib.suppress(RuntimeError):  # the loop is closed: nobody wants to know any more
                loop.call_soon_threadsafe(done, future.exception() or future.result())

        self._threads.submit(work).add_done_callback(come_back)

    def begin(self, work: Callable[[], object]) -> None:
        """Begin this, too: nobody waits for it, and it minds its own failures. Also outside of a loop."""
        self._threads.submit(work)

    def close(self) -> None:
        """Take nothing more; what runs comes to its end, and the process waits for it."""
        self._threads.shutdown(wait=False)
