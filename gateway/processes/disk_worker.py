"""Work that waits for a disk, in a thread of its own, so that the control loop does not.

A machine may refuse a thread (no memory, a container with few processes): the work is not done then, now or later, and
whoever asked for it gets an OSError, as from a disk.

Work calculates too (a check of coefficients 10 ms, a plant's file longer), and Python lets a thread that calculates keep the
interpreter for 5 ms while the loop has something to do: each reading and tick meanwhile came 5 ms late (median of 300
wake-ups), now 0.4.
"""

import asyncio
import contextlib
import errno
import sys
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Final

Work = Callable[[], Any]
Done = Callable[[Any], None]
"""done(result), or done(exception) when the work raised one."""

THREAD_NAME = "disk"
"""How the names of these threads begin, for whoever looks at the process."""

_LOOP_WAITS_S: Final = 200e-6
_MOST_ENDS: Final = 8


def keep_end(ends: dict[str, dict[str, Any]], job: int, **how: Any) -> None:
    """Keep how a job ended, by its number as JSON has it, of the last eight: who began it asks again in a while, and by then
    another one's may have ended, too."""
    ends[str(job)] = how
    ends.pop(str(job - _MOST_ENDS), None)


class DiskWorker:
    """One thread; what it is given runs one after the other. Called in a running loop, where `done` is called back."""

    def __init__(self) -> None:
        self._threads = ThreadPoolExecutor(max_workers=1, thread_name_prefix=THREAD_NAME)
        self._has_thread = False

    def __call__(self, work: Work, done: Done) -> None:
        loop = asyncio.get_running_loop()

        def come_back(future: Future[Any]) -> None:
            with contextlib.suppress(RuntimeError):  # the loop is closed: nobody wants to know any more
                loop.call_soon_threadsafe(done, future.exception() or future.result())

        try:
            self._need_thread()
            begun = self._submit(work)
        except OSError as error:
            loop.call_soon(done, error)
            return
        begun.add_done_callback(come_back)

    def begin(self, work: Callable[[], object]) -> None:
        """Begin this, too: nobody waits for it, and it minds its own failures. OSError where it cannot begin. Also outside of a
        loop."""
        self._need_thread()
        self._submit(work)

    def _need_thread(self) -> None:
        """The executor starts its thread with the first work, and keeps that work for later where it cannot: so the first does
        nothing."""
        if self._has_thread:
            return
        sys.setswitchinterval(_LOOP_WAITS_S)
        self._submit(lambda: None)
        self._has_thread = True

    def _submit(self, work: Work) -> Future[Any]:
        """What is asked for behind the end is refused, too: what was under way may ask for its next part then."""
        try:
            return self._threads.submit(work)
        except RuntimeError as error:
            raise OSError(errno.EAGAIN, f"no thread for the disk: {error}") from None

    def close(self) -> None:
        """Take nothing more; what runs comes to its end, and the process waits for it."""
        self._threads.shutdown(wait=False)
