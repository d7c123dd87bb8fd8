"""What a connection to an MQTT broker carries: messages, and the session that makes them, without the connection itself."""

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from gateway.live.live_state import LiveState


@dataclass(frozen=True, slots=True)
class BrokerMessage:
    """One message to publish."""

    topic: str
    payload: bytes
    qos: int = 0
    retain: bool = False


class BrokerSession(Protocol):
    """Makes messages; `broker_connection` sends them. ready: set when `next_message` has one.
    may_press: what is heard at its topics may begin or keep a force, so that it must not be old."""

    ready: asyncio.Event
    may_press: bool

    @property
    def name(self) -> str:
        """Name at the broker, the same after a restart."""

    @property
    def subscriptions(self) -> Sequence[str]:
        """Topics that it listens to."""

    def begin(self) -> BrokerMessage:
        """Begin a connection, and return its will."""

    def announce(self) -> Sequence[BrokerMessage]:
        """Return what comes first on a new connection."""

    def offer(self, state: LiveState | None, time_unix_s: float) -> None:
        """Take what control answered now; None: it did not."""

    def next_message(self) -> BrokerMessage | None:
        """Return the oldest message that waits; it waits on until `drop_sent`."""

    def drop_sent(self) -> None:
        """Forget that message: it has been sent."""

    def lose(self) -> None:
        """Note that the connection is gone."""

    def is_stop(self, payload: bytes) -> bool:
        """Decide whether a message does nothing but stop, so that it goes before all others."""

    async def answer(self, topic: str, payload: bytes, why_not: str) -> Sequence[BrokerMessage]:
        """Return what a message to one of its topics makes it say. why_not: it must not press, and why; empty: it may."""
