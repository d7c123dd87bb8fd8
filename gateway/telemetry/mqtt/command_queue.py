"""Messages of a broker that wait for control: few, none from before a standstill, and a stop before all others.

Control takes some ten commands a second by its socket; whoever sends more of them had each one carried out later than the one
before, and the stop behind them after minutes. So few wait, and of more than that the oldest goes; a stop takes the place of
all that wait, since it would undo them. What came while this process stood still presses nothing, nor what the broker brings
late: that has no place here, and is only counted.
"""

import asyncio
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from gateway.live.standstill import Standstill
from gateway.telemetry.mqtt.round_trips import RoundTrips

ROOM: Final = 10


@dataclass(frozen=True, slots=True)
class HeardMessage:
    """One message."""

    topic: str
    payload: bytes
    is_stop: bool


class CommandQueue:
    """is_stop: of a payload; standstill: of this process; trips: to the broker and back."""

    def __init__(self, is_stop: Callable[[bytes], bool], standstill: Standstill, trips: RoundTrips) -> None:
        self._is_stop, self.standstill, self.trips = is_stop, standstill, trips
        self._waiting: deque[HeardMessage] = deque()
        self._ready = asyncio.Event()
        self._dropped = self._late = 0

    def put(self, topic: str, payload: bytes) -> None:
        """Have a message wait."""
        message = HeardMessage(topic, payload, self._is_stop(payload))
        if message.is_stop:
            self._dropped += len(self._waiting)
            self._waiting.clear()
        elif self.trips.is_slow:
            self._late += 1
            return
        elif len(self._waiting) >= ROOM:
            del self._waiting[1 if self._waiting[0].is_stop else 0]
            self._dropped += 1
        self._waiting.append(message)
        self._ready.set()

    async def get(self) -> tuple[HeardMessage, str]:
        """Wait for the oldest message; return it, and why it must not be carried out: empty where it may."""
        while not self._waiting:
            self._ready.clear()
            await self._ready.wait()
        message = self._waiting.popleft()
        if message.is_stop or not self.standstill.is_aftermath():
            return message, ""
        return message, "the gateway's MQTT process stood still: what came meanwhile is not carried out"

    def take_dropped(self) -> int:
        """Return how many were dropped since the last call."""
        dropped, self._dropped = self._dropped, 0
        return dropped

    def take_late(self) -> int:
        """Return how many the broker has brought late since the last call."""
        late, self._late = self._late, 0
        return late
