"""Virtual time for asyncio: loops that never wait, all on one clock, which leaps from one event to the next.

Tasks, futures and handles are asyncio's own. What is to be done stands in one queue for all loops, in the order of its time,
and of its asking where the time is the same; so nothing here depends on how fast the machine is, and a turn costs a few
microseconds. Nothing comes from real descriptors: they can be opened and closed (a unix socket that listens), and stay quiet.
"""

import asyncio
import contextvars
import heapq
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

BEGIN_S = 1000.0
EPOCH_S = 1.7e9


class VirtualClock:
    """Stands for the kernel's clocks, and runs what is due by them. jump_s: what an operator has set the wall clock by."""

    def __init__(self) -> None:
        self.now_s = BEGIN_S
        self.jump_s = 0.0
        self._ready: deque[asyncio.Handle] = deque()
        self._timers: list[tuple[float, int, asyncio.Handle]] = []
        self._asked = 0

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

    def add(self, handle: asyncio.Handle) -> None:
        """Have this done as soon as everything is done that was asked for before."""
        self._ready.append(handle)

    def add_timer(self, when_s: float, handle: asyncio.Handle) -> None:
        """Have this done at this time."""
        self._asked += 1
        heapq.heappush(self._timers, (when_s, self._asked, handle))

    def run_until(self, end_s: float) -> None:
        """Do everything that is due until then, and let the clock show end_s. What a halted loop has to do waits until it goes
        on. (asyncio shows a handle's loop nowhere.)"""
        ready, timers = self._ready, self._timers
        running: VirtualLoop | None = None
        try:
            while True:
                if ready:
                    handle = ready.popleft()
                elif timers and timers[0][0] <= end_s:
                    when_s, _, handle = heapq.heappop(timers)
                    self.now_s = max(self.now_s, when_s)
                else:
                    self.now_s = max(self.now_s, end_s)
                    return
                loop: VirtualLoop = handle._loop  # type: ignore[attr-defined]
                if loop.is_halted:
                    loop.waiting.append(handle)
                elif not handle.cancelled():
                    if loop is not running:
                        running = loop
                        asyncio._set_running_loop(loop)
                    handle._run()
        finally:
            asyncio._set_running_loop(None)


class VirtualLoop(asyncio.SelectorEventLoop):
    """One process's loop. servers: those that listen, by port; is_halted: it does nothing, what becomes due waits."""

    def __init__(self, clock: VirtualClock) -> None:
        super().__init__()
        self._virtual_clock = clock
        self.servers: dict[int, Any] = {}
        self.is_halted = False
        self.waiting: list[asyncio.Handle] = []

    def time(self) -> float:
        return self._virtual_clock.now_s

    def halt(self) -> None:
        """Stop as SIGSTOP stops a process, or SIGKILL."""
        self.is_halted = True

    def go_on(self) -> None:
        """Do what has become due meanwhile, in its order, and go on."""
        self.is_halted = False
        for handle in self.waiting:
            self._virtual_clock.add(handle)
        self.waiting.clear()

    def call_soon(
        self, callback: Callable[..., Any], *args: Any, context: contextvars.Context | None = None
    ) -> asyncio.Handle:
        handle = asyncio.Handle(callback, args, self, context)
        self._virtual_clock.add(handle)
        return handle

    call_soon_threadsafe = call_soon  # there are no threads

    def call_later(
        self, delay: float, callback: Callable[..., Any], *args: Any, context: contextvars.Context | None = None
    ) -> asyncio.TimerHandle:
        return self.call_at(self.time() + delay, callback, *args, context=context)

    def call_at(
        self, when: float, callback: Callable[..., Any], *args: Any, context: contextvars.Context | None = None
    ) -> asyncio.TimerHandle:
        handle = asyncio.TimerHandle(when, callback, args, self, context)
        self._virtual_clock.add_timer(when, handle)
        return handle

    def _timer_handle_cancelled(self, handle: asyncio.TimerHandle) -> None:
        """A cancelled timer is passed over when it is due."""
