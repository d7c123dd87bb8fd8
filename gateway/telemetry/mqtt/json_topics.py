"""Plain JSON over MQTT, below one base topic: for people with mosquitto_sub, Node-RED, Home Assistant.

`online` and `state` are retained, so that who comes later knows at once, and told again every ten seconds: a broker may tell
the will of the connection before behind what the next one announces. `force` comes with every look while the broker is
there; `events` tell what changed, and wait for the broker when it is away. `command` is heard only where the rig allows it.
"""

import asyncio
import json
from collections import deque
from collections.abc import Awaitable, Callable, Iterator, Sequence
from typing import Any, Final

from gateway.live.live_state import LiveState
from gateway.telemetry.mqtt.broker_session import BrokerMessage
from gateway.telemetry.mqtt.register_commands import is_stop

Command = Callable[[bytes], Awaitable[dict[str, Any]]]
_ROOM: Final = 1000
_STATE_AGAIN_S: Final = 10.0
_SLOW: Final = (
    "rig",
    "simulated",
    "version",
    "state",
    "mode",
    "owner",
    "faults",
    "warnings",
    "calibration",
    "plant",
    "residual",
)
_AGES: Final = ("age_s",)


class JsonTopics:
    """command: carries out the payload of a command and returns what is told of it; None: commands are not heard."""

    def __init__(self, base: str, command: Command | None) -> None:
        self.ready = asyncio.Event()
        self._base, self._command, self.may_press = base, command, command is not None
        self._waiting: deque[BrokerMessage] = deque(maxlen=_ROOM)
        self._offered: BrokerMessage | None = None
        self._is_connected = False
        self._state: LiveState | None = None
        self._answered: LiveState | None = (
            None  # the last one that was: what a restart of control has changed is an event, too
        )
        self._told: dict[str, Any] | None = None
        self._told_s = 0.0

    @property
    def name(self) -> str:
        """The base topic, which no other gateway may have at the broker."""
        return self._base

    @property
    def subscriptions(self) -> Sequence[str]:
        """The command topic, where commands are heard."""
        return (f"{self._base}/command",) if self._command else ()

    def begin(self) -> BrokerMessage:
        """Leave `online` false with the broker."""
        return self._message("online", False, retain=True)

    def announce(self) -> Sequence[BrokerMessage]:
        """Return that the gateway is here, and how it is."""
        self._is_connected = True
        return self._online(), self._message("state", self._told, retain=True)

    def offer(self, state: LiveState | None, time_unix_s: float) -> None:
        """Keep what is to be told of it."""
        for event in _events(self._answered, state):
            self._keep(self._message("events", {"time_unix_s": time_unix_s} | event))
        is_due = abs(time_unix_s - self._told_s) >= _STATE_AGAIN_S  # either way: clocks are set back, too
        has_turned = (state is None) != (self._state is None)
        self._state, self._answered = state, state or self._answered
        if self._is_connected and (is_due or has_turned):
            self._keep(self._online())
        told = _slow_part(state)
        if told != self._told or is_due:
            self._told, self._told_s = told, time_unix_s
            if self._is_connected:
                self._keep(self._message("state", told, retain=True))
        if state is not None and self._is_connected:
            self._keep(self._message("force", _force_part(state, time_unix_s)))

    def next_message(self) -> BrokerMessage | None:
        """Return the oldest message."""
        self._offered = self._waiting[0] if self._waiting else None
        return self._offered

    def drop_sent(self) -> None:
        """Forget it, unless a full queue has dropped it meanwhile."""
        if self._waiting and self._waiting[0] is self._offered:
            self._waiting.popleft()

    def lose(self) -> None:
        """Keep events only; a force of then is nobody's business later."""
        self._is_connected = False
        events = [message for message in self._waiting if message.topic == f"{self._base}/events"]
        self._waiting = deque(events, _ROOM)

    def is_stop(self, payload: bytes) -> bool:
        """Decide whether a command does nothing but stop."""
        return is_stop(payload)

    async def answer(self, topic: str, payload: bytes, why_not: str) -> Sequence[BrokerMessage]:
        """Return what is told of a command that is carried out, or must not be."""
        if not self._command:
            return ()
        result = {"ok": False, "written": [], "error": why_not} if why_not else await self._command(payload)
        return (self._message("command/result", result),)

    def _online(self) -> BrokerMessage:
        return self._message("online", self._state is not None, retain=True)

    def _keep(self, message: BrokerMessage) -> None:
        self._waiting.append(message)
        self.ready.set()

    def _message(self, name: str, content: Any, *, retain: bool = False) -> BrokerMessage:
        return BrokerMessage(f"{self._base}/{name}", json.dumps(content).encode(), qos=0, retain=retain)


def _slow_part(state: LiveState | None) -> dict[str, Any] | None:
    """What is told when it changes; ages, which always do, are left out."""
    if state is None:
        return None
    whole = state.to_json()
    told = {name: whole[name] for name in _SLOW}
    for name, part in told.items():
        if isinstance(part, dict):
            told[name] = {key: value for key, value in part.items() if key not in _AGES}
    return told | {"recording": state.recording.on}


def _force_part(state: LiveState, time_unix_s: float) -> dict[str, Any]:
    force = state.force
    return {
        "time_unix_s": round(time_unix_s, 3),
        "measured_n": force.measured_n,
        "applied_n": force.applied_n,
        "accepted_n": force.accepted_n,
        "requested_n": force.requested_n,
        "voltage_v": force.voltage_v,
    }


def _events(before: LiveState | None, now: LiveState | None) -> Iterator[dict[str, Any]]:
    if before is None or now is None:
        return
    for name in ("state", "mode", "owner"):
        if (value := getattr(now, name)) != getattr(before, name):
            yield {"event": name, "value": value}
    was = {alarm.code: alarm for alarm in (*before.faults, *before.warnings)}
    stands = {alarm.code: alarm for alarm in (*now.faults, *now.warnings)}
    for code, alarm in stands.items():
        if code not in was:
            yield {"event": "raised", "code": code, "title": alarm.title, "cure": alarm.cure}
    yield from ({"event": "cleared", "code": code} for code in was if code not in stands)
