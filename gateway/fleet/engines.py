"""Who computes: this process, processes beside it, or a Dask cluster. The same function, the same rows.

Decisions
- A function and a task go in, a row comes out, whichever finishes first: who asks puts rows in order. Nothing else travels.
- What the function raises is an error row of that recording, made where it was raised: an exception that cannot be pickled
  would take a worker with it.
- A process that dies takes no row with it. The standard library's pool ends as a whole then: it is made anew, and what was
  being computed is tried once more, one at a time, so that a recording that kills its worker is known and blamed alone.
- The standard library's pool is the default, not Dask's own: it needs nothing installed, and a death costs seconds.
"""

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from functools import partial
from typing import Any, Final

from gateway.extras import import_library
from gateway.fleet.tasks import Row, Task, error_row

Compute = Callable[[Task], Row]
Engine = Callable[[Compute, Sequence[Task]], Iterator[tuple[Task, Row]]]
KILLED: Final = "E192 the process that computed it died twice: see the kernel's log (dmesg), out of memory?"
_AHEAD: Final = 2  # tasks per worker that are handed over before a row is waited for
_CLUSTER_RETRIES: Final = 2
_CONNECT_S: Final = 10.0


class EngineError(Exception):
    """The engine cannot be had; the text begins with its code."""


def compute_row(compute: Compute, task: Task) -> Row:
    """Return the row of a task, whatever happens."""
    try:
        return compute(task)
    except Exception as error:  # of one recording among thousands: its row says so
        return error_row(task, error)


def run_serially(compute: Compute, tasks: Sequence[Task]) -> Iterator[tuple[Task, Row]]:
    """Compute one after the other, here."""
    for task in tasks:
        yield task, compute_row(compute, task)


def processes(workers: int) -> Engine:
    """Return the engine that computes in so many processes of this machine."""
    return partial(_run_in_processes, workers)


def cluster(address: str) -> Engine:
    """Return the engine that computes on the Dask cluster at this address (tcp://HOST:PORT)."""
    return partial(_run_on_cluster, address)


def _run_in_processes(workers: int, compute: Compute, tasks: Sequence[Task]) -> Iterator[tuple[Task, Row]]:
    waiting, blamed = list(reversed(tasks)), list[Task]()
    while waiting:
        with _pool(workers) as pool:
            running: dict[Future[Row], Task] = {}
            try:
                while waiting or running:
                    while waiting and len(running) < _AHEAD * workers:
                        task = waiting.pop()
                        running[pool.submit(compute_row, compute, task)] = task
                    for done in wait(running, return_when=FIRST_COMPLETED).done:
                        row = done.result()
                        yield running.pop(done), row
            except BrokenProcessPool:
                blamed += running.values()
    for task in blamed:
        yield task, _alone(compute, task)


def _alone(compute: Compute, task: Task) -> Row:
    """In a process that nobody else uses: one that dies now, and again, died of this recording."""
    for _ in range(2):
        with _pool(1) as pool, suppress(BrokenProcessPool):
            return pool.submit(compute_row, compute, task).result()
    return error_row(task, KILLED)


def _pool(workers: int) -> ProcessPoolExecutor:
    """A fork of a process that has threads may hang: spawned, each imports what it needs once."""
    return ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn"))


def _run_on_cluster(address: str, compute: Compute, tasks: Sequence[Task]) -> Iterator[tuple[Task, Row]]:
    distributed: Any = import_library("distributed")
    try:
        client = distributed.Client(address, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, TimeoutError) as error:
        raise EngineError(f"E191 no Dask scheduler answers on {address} ({error}): dask scheduler starts one") from None
    with client:
        of_future = {
            client.submit(compute_row, compute, task, key=f"row-{place}-{task.sha256}", retries=_CLUSTER_RETRIES): task
            for place, task in enumerate(tasks)
        }
        for future in distributed.as_completed(list(of_future), loop=client.loop):
            task = of_future[future]
            failure = future.exception()
            yield task, error_row(task, _reason(failure)) if failure else future.result()


def _reason(failure: BaseException) -> BaseException | str:
    """Only a death is one: a worker of another version, say, fails without having computed anything."""
    return KILLED if type(failure).__name__ == "KilledWorker" else failure
