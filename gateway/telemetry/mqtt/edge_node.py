"""A Sparkplug B edge node: births, data, the death that is left with the broker as a will, rebirth, store and forward.

What changes is kept until it is sent, at most ROOM sets of changes: while the broker is away the oldest go first, and what
is left is sent after the next birth, in order, marked as historical. bdSeq counts connections, over restarts too, so that a
host can tell to which birth a death belongs; seq counts messages since the birth, 0 .. 255 and round.
"""

import asyncio
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from gateway.live.live_state import LiveState
from gateway.telemetry.mqtt.broker_session import BrokerMessage
from gateway.telemetry.sparkplug_metrics import TYPES, values_of
from gateway.telemetry.sparkplug_payload import DataType, SparkplugMetric, Value, decode_values, encode_payload

ROOM: Final = 9000
"""Half an hour at 5 Hz."""
BD_SEQ: Final = "bdSeq"
REBIRTH: Final = "Node Control/Rebirth"
_ROUND: Final = 256


@dataclass(frozen=True, slots=True)
class KeptChange:
    """Values that changed at one time. connection: the one that stood then, None for none."""

    connection: int | None
    time_ms: int
    values: dict[str, Value]


class EdgeNode:
    """group, node: as Sparkplug's topics name it; next_bd_seq: gives each connection its number, 0 .. 255; room: sets of
    changes that are kept; on_connected: told when a connection has come about."""

    def __init__(
        self,
        group: str,
        node: str,
        next_bd_seq: Callable[[], int],
        room: int = ROOM,
        on_connected: Callable[[], object] = lambda: None,
    ) -> None:
        self.ready, self.may_press = asyncio.Event(), False
        self._group, self._node = group, node
        self._next_bd_seq, self._bd_seq, self._on_connected = next_bd_seq, 0, on_connected
        self._kept: deque[KeptChange] = deque(maxlen=room)
        self._values: dict[str, Value] = values_of(None)
        self._time_ms = int(time.time() * 1000)
        self._connections = 0
        self._current: int | None = None
        self._seq = 0
        self._offered: KeptChange | None = None

    @property
    def name(self) -> str:
        """Group and node, under which no other edge node may be at the broker, and no JSON topics are: their base may be
        `plant/cell-7`, too."""
        return f"spBv1.0/{self._group}/{self._node}"

    @property
    def subscriptions(self) -> Sequence[str]:
        """The node's commands."""
        return (self.topic("NCMD"),)

    def topic(self, kind: str) -> str:
        """Return the topic of a kind of message, such as NDATA."""
        return f"spBv1.0/{self._group}/{kind}/{self._node}"

    def begin(self) -> BrokerMessage:
        """Count the connection; its will is the death that belongs to the birth to come."""
        self._connections += 1
        self._bd_seq = self._next_bd_seq()
        death = encode_payload(int(time.time() * 1000), [self._bd_seq_at(self._time_ms)], None)
        return BrokerMessage(self.topic("NDEATH"), death, qos=1)

    def announce(self) -> Sequence[BrokerMessage]:
        """Return the birth: every metric that there will ever be, as it is now."""
        self._current = self._connections
        self._on_connected()
        return (self._birth(),)

    def offer(self, state: LiveState | None, time_unix_s: float) -> None:
        """Keep what has changed."""
        values, self._time_ms = values_of(state), int(time_unix_s * 1000)
        changed = {name: value for name, value in values.items() if value != self._values[name]}
        self._values = values
        if changed:
            self._kept.append(KeptChange(self._current, self._time_ms, changed))
            self.ready.set()

    def next_message(self) -> BrokerMessage | None:
        """Return the oldest change as data."""
        if not self._kept:
            return None
        kept = self._offered = self._kept[0]
        is_historical = kept.connection != self._current
        metrics = _metrics(kept.values, kept.time_ms, is_historical=is_historical)
        self._seq = (self._seq + 1) % _ROUND
        return BrokerMessage(self.topic("NDATA"), encode_payload(kept.time_ms, metrics, self._seq))

    def drop_sent(self) -> None:
        """Forget the change that was sent, unless a full store has dropped it meanwhile."""
        if self._kept and self._kept[0] is self._offered:
            self._kept.popleft()

    def lose(self) -> None:
        """Note that there is no connection: what comes now is kept, and will be historical."""
        self._current = None

    def is_stop(self, payload: bytes) -> bool:
        """Return that it does not: no command of a node stops anything."""
        return False

    async def answer(self, topic: str, payload: bytes, why_not: str) -> Sequence[BrokerMessage]:
        """Return a new birth where a host asks for one, however late: it presses nothing. Every other command is left alone:
        the node is read only."""
        try:
            wanted = decode_values(payload)
        except ValueError:  # not Sparkplug
            return ()
        return (self._birth(),) if wanted.get(REBIRTH) is True else ()

    def _birth(self) -> BrokerMessage:
        self._seq = 0
        metrics = [
            self._bd_seq_at(self._time_ms),
            SparkplugMetric(REBIRTH, DataType.BOOLEAN, False, self._time_ms),
            *_metrics(self._values, self._time_ms, is_historical=False),
        ]
        return BrokerMessage(self.topic("NBIRTH"), encode_payload(self._time_ms, metrics, self._seq))

    def _bd_seq_at(self, time_ms: int) -> SparkplugMetric:
        return SparkplugMetric(BD_SEQ, DataType.UINT64, self._bd_seq, time_ms)


def _metrics(values: dict[str, Value], time_ms: int, *, is_historical: bool) -> Iterable[SparkplugMetric]:
    return [SparkplugMetric(name, TYPES[name], value, time_ms, is_historical) for name, value in values.items()]
