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

_CLOCK_MONOTONIC = 1
_NONBLOCK_CLOEXEC = os.O_NONBLOCK | getattr(os, "O_CLOEXEC", 0)
_EXPIRATIONS = struct.Struct("=Q")


def _create_timerfd(period_s: float) -> int:
    """Return a descriptor that becomes readable every period_s; OSError where the kernel has none."""
    libc = ctypes.CDLL(None, use_errno=True)
    fd = int(libc.timerfd_create(_CLOCK_MONOTONIC, _NONBLOCK_CLOEXEC))
    if fd < 0:
        raise OSError(ctypes.get_errno(), "timerfd_create")
    seconds, nanoseconds = divmod(round(period_s * 1e9), 1_000_000_000)
    interval = (ctypes.c_long * 4)(seconds, nanoseconds, seconds, nanoseconds)  # it_interval, it_value
    if libc.timerfd_settime(fd, 0, interval, None) < 0:
        os.close(fd)
        raise OSError(ctypes.get_errno(), "timerfd_settime")
    return fd


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

    def start(self) -> None:
        """Start the timer."""
        loop = asyncio.get_running_loop()
        if self.is_fallback:
            self._due_s = time.monotonic() + self.period_s
            self._timer = loop.call_later(self.period_s, self._on_fallback)
            return
        self._due_s = time.monotonic()
        self._fd = _create_timerfd(self.period_s)
        loop.add_reader(self._fd, self._on_expired)

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
