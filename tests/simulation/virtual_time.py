"""Virtual time for asyncio: loops that never wait, all on one clock, which leaps from one event to the next.

The loops are asyncio's own; only their clock and their selector are ours. Real descriptors (a unix socket that listens) still
work, and are looked at now and then; nothing here depends on how fast the machine is.
"""

import asyncio
import heapq
import selectors
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

BEGIN_S = 1000.0
EPOCH_S = 1.7e9
TURNS_UNASKED = 64


class VirtualClock:
    """Stands for the kernel's clocks. jump_s: what an operator has set the wall clock by."""

    def __init__(self) -> None:
        self.now_s = BEGIN_S
        self.jump_s = 0.0

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


class _PollingSelector(selectors.DefaultSelector):
    """Asks the kernel now and then only: nearly nothing here comes through it."""

    turns = 0

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        self.turns += 1
        return super().select(0) if self.turns % TURNS_UNASKED == 0 else []


class VirtualLoop(asyncio.SelectorEventLoop):
    """One process's loop. servers: those that listen, by port."""

    def __init__(self, clock: VirtualClock) -> None:
        super().__init__(_PollingSelector())
        self._virtual_clock = clock
        self.servers: dict[int, Any] = {}

    def time(self) -> float:
        return self._virtual_clock.now_s

    @property
    def is_busy(self) -> bool:
        """Something can be done now. (The queue and the heap of timers are asyncio's own: it shows them nowhere.)"""
        return bool(self._ready) or self.due_s <= self.time()  # type: ignore[attr-defined]

    @property
    def due_s(self) -> float:
        """When its next timer is due."""
        timers: list[asyncio.TimerHandle] = self._scheduled  # type: ignore[attr-defined]
        while timers and timers[0].cancelled():
            heapq.heappop(timers)._scheduled = False  # type: ignore[attr-defined]
            self._timer_cancelled_count -= 1  # type: ignore[attr-defined]
        return timers[0].when() if timers else float("inf")

    def turn(self) -> None:
        """Do what can be done now, once. `run_forever` makes all ready for a long run each time, a third of the whole."""
        asyncio._set_running_loop(self)
        try:
            self._run_once()  # type: ignore[attr-defined]
        finally:
            asyncio._set_running_loop(None)


def run_all(clock: VirtualClock, loops: list[VirtualLoop], end_s: float) -> None:
    """Run these loops until the clock shows end_s. The list may change meanwhile: a process dies, another is started."""
    while True:
        while busy := [loop for loop in loops if loop.is_busy]:
            for loop in busy:
                if loop in loops:
                    loop.turn()
        due_s = min(loop.due_s for loop in loops)
        if due_s > end_s:
            clock.now_s = end_s
            return
        clock.now_s = max(clock.now_s, due_s)
