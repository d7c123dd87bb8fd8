"""Somebody removes the state directory of a gateway that runs: the page, which reaches control by a file in it, still stops."""

import asyncio
import shutil
from pathlib import Path
from typing import Any

import pytest

from gateway.live.control_link import ControlLink
from gateway.processes.json_socket.connection import SocketLimits
from gateway.processes.json_socket.server import JsonLineServer
from gateway.web import context as web_context
from gateway.web.context import WebContext
from gateway.web.security import PageAccess
from gateway.web.server import make_app
from tests.web.asgi import Answer, call, page

TOKEN = "0123456789abcdef"
AS_OWNER = {"authorization": f"Bearer {TOKEN}"}


def test_stop_still_stops(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Control closes a way that has been idle for 30 s, and without the file there was no other."""
    assert 0.5 * SocketLimits().idle_s >= web_context._KEPT_S
    monkeypatch.setattr(web_context, "_KEPT_S", 0.001)
    state, asked = tmp_path / "demo", asyncio.Queue[str]()
    state.mkdir()

    def running(request: dict[str, Any]) -> dict[str, Any]:
        asked.put_nowait("running")
        return {}

    async def scene() -> Answer:
        control = JsonLineServer(
            state / "control.sock", {"running": running, "modbus": lambda _: {"pdu": "1000000001"}}
        )
        await control.start()
        context = WebContext(state, "demo", True, ControlLink(state))
        app = make_app(context, PageAccess("127.0.0.1", 8080, TOKEN), None)
        async with app.router.lifespan_context(app):
            for _ in range(6):  # both ways, again and again
                await asked.get()
            assert len(control._callers) == 2
            shutil.rmtree(state)
            stopped = await call(app, "POST", "/api/v1/command/stop", AS_OWNER)
        await control.close()
        return stopped

    stopped = asyncio.run(asyncio.wait_for(scene(), 10.0))
    assert (stopped.status, stopped.json) == (200, {"ok": True})


def test_a_page_without_a_way_says_why_and_what_to_do(tmp_path: Path) -> None:
    """It said that the gateway was being restarted, or had ended: it was pressing."""
    gone = tmp_path / "demo"
    stopped = asyncio.run(call(page(gone, TOKEN), "POST", "/api/v1/command/stop", AS_OWNER))
    assert (stopped.status, stopped.json["reason"]) == (503, "gone")
    assert stopped.json["error"].startswith(f"E152 {gone} is gone, and with it the way to the gateway: make it again")
