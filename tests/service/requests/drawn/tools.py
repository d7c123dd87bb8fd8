"""What is asked beside Modbus: the page with and without its token, MQTT commands, the lines of control.sock."""

import json
from collections.abc import Callable
from random import Random
from typing import Any

from tests.service.requests.drawn.world import TOKEN, World
from tests.service.requests.hostile import VALUES, mutants
from tests.service.requests.test_hostile_requests import CONTROL

TELLING = ("last-writer", "last-refusal", "health", "running", "state")
"""Verbs that change nothing, whatever they carry."""
BEARER = {"authorization": f"Bearer {TOKEN}", "x-viewer": "a"}
PATHS = (
    *(
        f"/api/v1/command/{name}"
        for name in ("stop", "enable", "enable", "setpoint", "take-ownership", "reset", "tare", "record", "no")
    ),
    *("/api/v1/recordings/start", "/api/v1/recordings/stop", "/api/v1/calibrate/start", "/api/v1/calibrate/stop"),
)
NAMES = (
    "force_setpoint",
    "control_word",
    "control_word",
    "force_setpoint@float_abcd",
    "heartbeat",
    "mode",
    "state",
    "tilt_angle",
    "no",
)
NUMBERS = (0, 0, 1, 1, 9, 12.5, 25, -3, 61, 65536, 1e300, 10**400, True, None, "1", [], 12.004)
Look = Callable[[], Any]
Differences = Callable[[Any, Any], list[str]]


class Tools:
    def __init__(self, world: World, draw: Random) -> None:
        self._world, self._draw, self.broken = world, draw, list[str]()
        self.disturbs = False  # what was asked last: a run, or another model
        self._lines = mutants(CONTROL, 10**9, draw.getrandbits(32))

    def act(self, look: Look, differences: Differences) -> str:
        before = look()
        told, may_change = self._draw.choice((self._page, self._mqtt, self._socket))()
        self.disturbs = may_change and any(word in told for word in ("calibrat", "plant"))
        if not may_change and (changes := differences(before, look())):
            self.broken.append(f"{told} changes {changes[:6]}")
        return told

    def stop(self, by: str) -> None:
        if by == "web":
            self._world.ask_page("POST", "/api/v1/command/stop", BEARER, {})
        else:
            self._command({"control_word": 0})

    def _page(self) -> tuple[str, bool]:
        draw = self._draw
        path = draw.choice(PATHS)
        headers = draw.choice((*[BEARER] * 9, {}, {"authorization": "Bearer no"}, BEARER | {"host": "evil"}))
        body = draw.choice(
            ({}, {"force_n": draw.choice(NUMBERS)}, {"on": draw.choice((True, False, "false", 1))}, [], 5)
        )
        if draw.random() < 0.6:
            body = {"on": draw.random() < 0.5} if path[-6:] == "record" else {"force_n": draw.choice((3.0, 12.0, 25.0))}
            body = {} if "recordings" in path or "calibrate" in path else body
        method = draw.choice((*["POST"] * 9, "GET", "PUT"))
        answer = self._world.ask_page(method, path, headers, body)
        if answer.status >= 500 and answer.status != 503:
            self.broken.append(f"{method} {path} {body} is answered {answer.status}: {answer.body[:200]!r}")
        if headers is not BEARER and answer.status < 400:
            self.broken.append(f"{method} {path} with {headers} is answered {answer.status}")
        return f"{method} {path} {str(body)[:40]} {len(headers)} -> {answer.status}", answer.status < 400

    def _mqtt(self) -> tuple[str, bool]:
        draw = self._draw
        command: dict[str, Any] = {draw.choice(NAMES): draw.choice(NUMBERS) for _ in range(draw.randrange(1, 4))}
        if draw.random() < 0.5:
            command = {"force_setpoint": draw.choice((3, 12)), "control_word": draw.choice((1, 1, 9, 8, 2, 33))}
        answer = self._command(command)
        return f"mqtt {str(command)[:80]} -> {answer}", bool(answer["written"])

    def _command(self, command: dict[str, Any]) -> dict[str, Any]:
        return self._world.do(self._world.mqtt.carry_out(json.dumps(command).encode()))  # type: ignore[no-any-return]

    def _socket(self) -> tuple[str, bool]:
        which = self._draw.random()
        if which < 0.4:
            line = json.dumps(self._draw.choice(CONTROL)).encode()
        elif which < 0.6:
            line = json.dumps(self._draw.choice(CONTROL) | {"x": self._draw.choice(VALUES)}).encode()
        else:
            line = next(self._lines)
        answer = self._world.stage.ask(line)
        asked = json.loads(line)
        verb = asked.get("do") if isinstance(asked, dict) else None
        return f"socket {line[:120]!r} -> {answer['ok']}", answer["ok"] and verb not in TELLING
