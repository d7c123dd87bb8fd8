"""The loop's clock tick, from the kernel.

asyncio's `call_at` rounds to 1 ms, and fires early under uvloop; a timerfd does neither. `os.timerfd_create` exists only
from Python 3.13, so the calls go through ctypes; off Linux the tick falls back to `call_at`, and says so.
"""

import asyncio
import ctypes
import os
import struct
import sys
import time
from collections.abc import Callable
from functools import cache

from gateway.processes.phase_lock import PhaseLock

_CLOCK_MONOTONIC = 1
_ABSOLUTE = 1
_NONBLOCK_CLOEXEC = os.O_NONBLOCK | getattr(os, "O_CLOEXEC", 0)
_EXPIRATIONS = struct.Struct("=Q")


@cache
def _libc() -> ctypes.CDLL:
    return ctypes.CDLL(None, use_errno=True)


def _create_timerfd() -> int:
    """Return a descriptor for `_set_timer`; OSError where the kernel has none."""
    fd = int(_libc().timerfd_create(_CLOCK_MONOTONIC, _NONBLOCK_CLOEXEC))
    if fd < 0:
        raise OSError(ctypes.get_errno(), "timerfd_create")
    return fd


def _set_timer(fd: int, first_s: float, period_s: float) -> None:
    """Let the descriptor become readable at first_s, monotonic, and every period_s from there on; what is past counts."""
    interval = (ctypes.c_long * 4)(*_split(period_s), *_split(first_s))  # it_interval, it_value
    if _libc().timerfd_settime(fd, _ABSOLUTE, interval, None) < 0:
        raise OSError(ctypes.get_errno(), "timerfd_settime")


def _split(time_s: float) -> tuple[int, int]:
    return divmod(round(time_s * 1e9), 1_000_000_000)


class ClockTick:
    """Calls on_tick(expirations, late_s) every period; expirations > 1 means that ticks were missed, late_s is how long
    after its time the newest one is served. is_fallback: use the loop's `call_later`, as off Linux."""

    def __init__(
        self,
        period_s: float,
        on_tick: Callable[[int, float], None],
        *,
        is_fallback: bool = not sys.platform.startswith("linux"),
    ) -> None:
        self.period_s = period_s
        self.is_fallback = is_fallback
        self._on_tick = on_tick
        self._fd = -1
        self._timer: asyncio.TimerHandle | None = None
        self._due_s = 0.0
        self._phase = PhaseLock(period_s)

    def start(self) -> None:
        """Start the timer."""
        loop = asyncio.get_running_loop()
        if self.is_fallback:
            self._due_s = time.monotonic() + self.period_s
            self._timer = loop.call_later(self.period_s, self._on_fallback)
            return
        self._due_s = time.monotonic()
        self._fd = _create_timerfd()
        _set_timer(self._fd, self._due_s + self.period_s, self.period_s)
        loop.add_reader(self._fd, self._on_expired)

    def follow(self, arrival_s: float | None) -> None:
        """Come right behind what arrives as often as the tick, or half as often, and so on: see phase_lock. arrival_s: when the
        newest came, monotonic, which may be told again; None: nothing comes of its own accord."""
        if self._fd < 0 or arrival_s is None:
            return
        if shift_s := self._phase.shift_s(arrival_s, self._due_s):
            self._due_s += shift_s
            _set_timer(self._fd, self._due_s + self.period_s, self.period_s)  # one that is due by then comes at once

    def close(self) -> None:
        """Stop the timer."""
        if self._timer:
            self._timer.cancel()
        if self._fd >= 0:
            asyncio.get_running_loop().remove_reader(self._fd)
            os.close(self._fd)
            self._fd = -1

    def _on_expired(self) -> None:
        try:
            (expirations,) = _EXPIRATIONS.unpack(os.read(self._fd, 8))
        except BlockingIOError:
            return
        self._due_s += expirations * self.period_s
        self._on_tick(expirations, time.monotonic() - self._due_s)

    def _on_fallback(self) -> None:
        now_s = time.monotonic()
        expirations = 1 + int(max(0.0, now_s - self._due_s) / self.period_s)
        self._due_s += expirations * self.period_s
        self._timer = asyncio.get_running_loop().call_later(max(0.0, self._due_s - now_s), self._on_fallback)
        self._on_tick(expirations, max(0.0, now_s - self._due_s + self.period_s))
