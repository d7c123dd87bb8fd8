"""Virtual time for asyncio: loops that never wait, all on one clock, which leaps from one event to the next.

Tasks and futures are asyncio's own. What is to be done stands in one queue for all loops, in the order of its time,
and of its asking where the time is the same; so nothing here depends on how fast the machine is, and a turn costs a
microsecond. Nothing comes from real descriptors: they can be opened and closed (a unix socket that listens), and stay quiet.
"""

import asyncio
import contextvars
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from heapq import heappop, heappush
from itertools import count
from typing import Any

import pytest

BEGIN_S = 1000.0
EPOCH_S = 1.7e9


class Handle(list[Any]):
    """[time, place, callback, arguments, loop, context]: in place of asyncio's, for the gate makes millions of them, and a list
    is made and compared at once. A callback for which no context is given runs in the one that all share: here nobody sets a
    variable of it. A cancelled timer has no callback, and is passed over when it is due."""

    __slots__ = ()

    def __repr__(self) -> str:
        return f"<{self[2]!r} at {self[0]:g} s>"

    def cancel(self) -> None:
        self[2:4] = None, ()

    def tell(self, error: Exception) -> None:
        """Tell the loop what the callback has raised, as asyncio's handle does."""
        self[4].call_exception_handler({"message": f"Exception in {self!r}", "exception": error, "handle": self})


class VirtualClock:
    """Stands for the kernel's clocks, and runs what is due by them: ready, in the order of its asking, and timers, in the order
    of their times, then of their places. jump_s: what an operator has set the wall clock by."""

    def __init__(self) -> None:
        self.now_s = BEGIN_S
        self.jump_s = 0.0
        self.ready: deque[Handle] = deque()
        self.timers: list[Handle] = []
        self.places = count()

    def monotonic(self) -> float:
        return self.now_s

    def wall(self) -> float:
        return EPOCH_S + self.now_s + self.jump_s

    @contextmanager
    def as_the_kernels(self) -> Iterator[None]:
        """Everybody who asks the module `time` meanwhile is told this time."""
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("time.monotonic", self.monotonic)
            patch.setattr("time.time", self.wall)
            yield

    def run_until(self, end_s: float) -> None:
        """Do everything that is due until then, and let the clock show end_s. What a halted loop has to do waits until it goes
        on. (asyncio shows a handle's loop nowhere.)"""
        ready, timers = self.ready, self.timers
        running: VirtualLoop | None = None
        try:
            while True:
                if ready:
                    handle = ready.popleft()
                elif timers and timers[0][0] <= end_s:
                    handle = heappop(timers)
                    if handle[0] > self.now_s:
                        self.now_s = handle[0]
                else:
                    self.now_s = max(self.now_s, end_s)
                    return
                _, _, callback, arguments, loop, context = handle
                if loop.is_halted:
                    loop.waiting.append(handle)
                elif callback is not None:
                    if loop is not running and loop.has_tasks:
                        running = loop
                        asyncio._set_running_loop(loop)
                    try:
                        if context is None:
                            callback(*arguments)
                        else:
                            context.run(callback, *arguments)
                    except Exception as error:
                        handle.tell(error)
        finally:
            asyncio._set_running_loop(None)


class VirtualLoop(asyncio.SelectorEventLoop):
    """One process's loop. servers: those that listen, by port; is_halted: it does nothing, what becomes due waits; has_tasks:
    what it calls may ask asyncio for the running loop, which takes a system call to set at each change."""

    def __init__(self, clock: VirtualClock, *, has_tasks: bool = True) -> None:
        super().__init__()
        self.clock = clock
        self.servers: dict[int, Any] = {}
        self.is_halted = False
        self.has_tasks = has_tasks
        self.waiting: list[Handle] = []

    def time(self) -> float:
        return self.clock.now_s

    def halt(self) -> None:
        """Stop as SIGSTOP stops a process, or SIGKILL."""
        self.is_halted = True

    def go_on(self) -> None:
        """Do what has become due meanwhile, in its order, and go on."""
        self.is_halted = False
        self.clock.ready.extend(self.waiting)
        self.waiting.clear()

    def call_soon(  # type: ignore[override]
        self, callback: Callable[..., Any], *args: Any, context: contextvars.Context | None = None
    ) -> Handle:
        handle = Handle((0.0, 0, callback, args, self, context))
        self.clock.ready.append(handle)
        return handle

    call_soon_threadsafe = call_soon  # type: ignore[assignment]  # there are no threads

    def call_later(  # type: ignore[override]
        self, delay: float, callback: Callable[..., Any], *args: Any, context: contextvars.Context | None = None
    ) -> Handle:
        clock = self.clock
        handle = Handle((clock.now_s + delay, next(clock.places), callback, args, self, context))
        heappush(clock.timers, handle)
        return handle

    def call_at(  # type: ignore[override]
        self, when: float, callback: Callable[..., Any], *args: Any, context: contextvars.Context | None = None
    ) -> Handle:
        clock = self.clock
        handle = Handle((when, next(clock.places), callback, args, self, context))
        heappush(clock.timers, handle)
        return handle
