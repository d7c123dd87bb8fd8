"""The page's commands on a whole gateway in virtual time: their `sleep` is the time of the gateway."""

import asyncio
import json
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from gateway.profiles import Rig
from gateway.web.commands import Commands
from gateway.web.context import WebContext
from tests.service.requests.test_hostile_requests import Stage
from tests.service.rigs import demo
from tests.service.wired import Wired

Scene = Callable[[Commands, Stage], Awaitable[None]]


class Link:
    """Control's socket without the socket."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage

    async def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        answer = self._stage.ask(json.dumps(request).encode())
        if not answer.pop("ok"):
            raise ValueError(answer["error"])
        return answer


def play(tmp_path: Path, scene: Scene, rig: Rig | None = None) -> Stage:
    """Play a scene of the page's commands beside control."""
    stage = Stage(tmp_path, Wired(rig or demo()).ready())
    context = WebContext(tmp_path, "demo", True, Link(stage))  # type: ignore[arg-type]
    context.__dict__["profile"] = stage.wired.rig

    async def sleep(seconds: float) -> None:
        stage.wired.run(seconds)
        await asyncio.sleep(0)

    async def run() -> None:
        commands = Commands(context, lambda: stage.wired.now_s, sleep)
        try:
            await scene(commands, stage)
        finally:
            await commands.close()

    asyncio.run(run())
    stage.close()
    return stage


def leased() -> Rig:
    """Return the demo rig with a short lease."""
    rig = demo()
    return replace(rig, control=replace(rig.control, supervision=replace(rig.control.supervision, lease_s=0.2)))


async def let_turns_pass(turns: int) -> None:
    """Let whatever waits for its turn go on."""
    for _ in range(turns):
        await asyncio.sleep(0)
