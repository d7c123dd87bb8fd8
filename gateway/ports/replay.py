"""A port that plays what a line once said: (time, bytes) from a recording. What is written to it is kept, and goes nowhere."""

import asyncio
from collections.abc import Sequence

from gateway.ports.port import WRITE_DEADLINE_S, OnBytes, OnOpen, monotonic_s


class ReplayPort:
    """See port.Port; it is never lost. recorded: (s since the start, chunk), in order.

    speed 1 plays in real time, 10 ten times as fast, inf at once. The arrival times that on_bytes gets are the recorded
    ones after the start, whatever the speed and however late the loop runs: the same decisions come out.
    """

    def __init__(
        self,
        recorded: Sequence[tuple[float, bytes]],
        *,
        on_bytes: OnBytes,
        on_open: OnOpen = lambda descriptor: None,
        speed: float = 1.0,
    ) -> None:
        self.path = "replay"
        self.written: list[tuple[float, bytes]] = []  # (monotonic time, bytes)
        self.ended = asyncio.Event()
        self._recorded = recorded
        self._speed = speed
        self._on_bytes, self._on_open = on_bytes, on_open
        self._start_s = 0.0
        self._next = 0
        self._timer: asyncio.TimerHandle | None = None
        self._is_open = False

    @property
    def is_open(self) -> bool:
        return self._is_open

    async def open(self) -> None:
        self._is_open, self._start_s, self._next = True, monotonic_s(), 0
        self._on_open(-1)
        self._wait()

    def write(self, data: bytes) -> bool:
        if self._is_open:
            self.written.append((monotonic_s(), data))
        return self._is_open

    async def drain(self, deadline_s: float = WRITE_DEADLINE_S) -> None:
        await asyncio.sleep(0)

    async def write_last(self, data: bytes, deadline_s: float = WRITE_DEADLINE_S) -> None:
        self.write(data)

    def close(self) -> None:
        self._is_open = False
        if self._timer:
            self._timer.cancel()

    def _wait(self) -> None:
        if self._next == len(self._recorded):
            self.ended.set()
            return
        due_s = self._start_s + self._recorded[self._next][0] / self._speed
        self._timer = asyncio.get_running_loop().call_later(max(0.0, due_s - monotonic_s()), self._play)

    def _play(self) -> None:
        recorded_s, chunk = self._recorded[self._next]
        self._next += 1
        self._on_bytes(chunk, self._start_s + recorded_s)
        if self._is_open:
            self._wait()
