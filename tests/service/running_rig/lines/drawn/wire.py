"""A serial line between a host and a device in virtual time: bytes take the time of their baud rate, and an adapter hands them
over when it does; what is spoiled is spoiled on its way.
"""

from collections import deque
from collections.abc import Callable
from heapq import heappop, heappush
from itertools import count
from math import ceil, inf
from typing import Any

from tests.simulation.kernel.spoiled import Spoil, spoiled

_EPSILON_S = 1e-9


class Clock:
    """What happens next, in the order of its time; of the same time as it was told."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self._due: list[tuple[float, int, Callable[..., None], tuple[Any, ...]]] = []
        self._count = count()

    def at(self, when_s: float, do: Callable[..., None], *arguments: Any) -> None:
        """Do this then, never before now."""
        heappush(self._due, (max(when_s, self.now_s), next(self._count), do, arguments))

    def run(self, until_s: float) -> None:
        """Let everything happen that is due until then."""
        due = self._due
        while due and due[0][0] <= until_s:
            self.now_s, _, do, arguments = heappop(due)
            do(*arguments)
        self.now_s = until_s


class Direction:
    """One direction. take: who gets what is through. A message is handed over whole, or as the adapter's turns come."""

    def __init__(self, clock: Clock, character_s: float, take: Callable[[bytes], None], adapter_s: float = 0.0) -> None:
        self._clock, self._character_s, self._take, self._adapter_s = clock, character_s, take, adapter_s
        self._through_s = -inf
        self._waiting: deque[list[Any]] = deque()  # begin, bytes
        self.on_dropped: Callable[[bytes], None] = lambda sent: None

    def put(self, data: bytes) -> None:
        """Put these behind what is on the line already."""
        begin_s = max(self._clock.now_s, self._through_s)
        self._through_s = begin_s + len(data) * self._character_s
        if not self._adapter_s:
            self._wait(begin_s, data, self._through_s)
            return
        turn, sent = ceil(begin_s / self._adapter_s), 0
        while sent < len(data):
            come = min(len(data), int((turn * self._adapter_s - begin_s) / self._character_s + _EPSILON_S))
            if come > sent:
                self._wait(begin_s, data[sent:come], turn * self._adapter_s)
                sent = come
            turn += 1

    def _wait(self, begin_s: float, data: bytes, through_s: float) -> None:
        message = [begin_s, data]
        self._waiting.append(message)
        self._clock.at(through_s + _EPSILON_S, self._arrive, message)

    def _arrive(self, message: list[Any]) -> None:
        if message in self._waiting:
            self._waiting.remove(message)
        if message[1]:
            self._take(message[1])

    def cut(self) -> None:
        """What is on the line arrives nowhere."""
        for message in self._waiting:
            message[1] = b""
        self._waiting.clear()
        self._through_s = -inf

    def drop_unsent(self) -> None:
        """What has not begun to go out is forgotten; of what has, the characters that are out arrive."""
        now_s, kept = self._clock.now_s, [(begin_s, data) for begin_s, data in self._waiting]
        self.cut()
        for begin_s, data in kept:
            if sent := data[: max(0, ceil((now_s - begin_s) / self._character_s))]:
                self._through_s = begin_s + len(sent) * self._character_s
                self._wait(begin_s, sent, self._through_s)
                if len(sent) < len(data):
                    self.on_dropped(sent)


class Wire:
    """Both directions. spoils: what the next answers suffer; spoiled_s: when one was last, by its kind; falsified_s: when the
    host has last got what the device has not said."""

    def __init__(self, clock: Clock, character_s: float, adapter_s: float) -> None:
        self.clock, self.character_s = clock, character_s
        self.on_device: Callable[[bytes], None] = lambda data: None
        self.on_host: Callable[[bytes], None] = lambda data: None
        self.to_device = Direction(clock, character_s, lambda data: self.on_device(data))
        self.to_host = Direction(clock, character_s, lambda data: self.on_host(data), adapter_s)
        self._spoils: deque[Spoil] = deque()
        self.spoiled: list[tuple[float, str]] = []
        self._late_s = -inf

    def spoil(self, spoil: Spoil) -> None:
        """Do this to the next answers."""
        self._spoils.extend([spoil] * spoil.count)

    @property
    def is_spoiling(self) -> bool:
        """Whether an answer is still to be spoiled."""
        return bool(self._spoils)

    def heal(self) -> None:
        """Spoil nothing any more."""
        self._spoils.clear()

    def answer(self, data: bytes) -> None:
        """Send what the device says, or what becomes of it."""
        if not data:
            return
        if not self._spoils:
            self.clock.at(self._late_s, self.to_host.put, data)  # a device answers in order
            return
        spoil = self._spoils.popleft()
        self.spoiled.append((self.clock.now_s, spoil.kind))
        for late_s, piece in spoiled(spoil, data):
            if piece:
                self._late_s = max(self._late_s, self.clock.now_s + late_s)
                self.clock.at(self._late_s, self._put_late, piece, spoil.kind)

    def _put_late(self, piece: bytes, kind: str) -> None:
        self.spoiled.append((self.clock.now_s, kind))
        self.to_host.put(piece)
