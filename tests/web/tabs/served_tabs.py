"""The page served in a thread of a test, on a free port: the real application behind its guard, without a guardian."""

import asyncio
import contextlib
import json
import socket
import threading
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from http.cookiejar import CookieJar
from pathlib import Path
from typing import Any

import uvicorn

from gateway.live.control_link import ControlLink
from gateway.web.context import WebContext
from gateway.web.security import CSRF_HEADER, PageAccess
from gateway.web.server import make_app


@dataclass
class Answer:
    status: int
    body: bytes
    headers: dict[str, str] = field(default_factory=dict)

    @property
    def json(self) -> Any:
        return json.loads(self.body)


class ServedPage:
    """A browser's requests: with its session, and with the token that commands need. hang_up: closes what nobody asks by."""

    def __init__(self, address: str, hang_up: Callable[[], Any]) -> None:
        self.address, self.hang_up = address, hang_up
        self._browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(CookieJar()))
        self.csrf = ""

    def get(self, path: str) -> Answer:
        return self._ask(urllib.request.Request(self.address + path))

    def post(self, path: str, body: Any = None, *, csrf: bool = True) -> Answer:
        if csrf and not self.csrf:
            self.csrf = self.get("/api/v1/session").json["csrf"]
        data = body if isinstance(body, bytes) else json.dumps({} if body is None else body).encode()
        headers = {"Content-Type": "application/json"} | ({CSRF_HEADER: self.csrf} if csrf else {})
        return self._ask(urllib.request.Request(self.address + path, data, headers))

    def _ask(self, request: urllib.request.Request) -> Answer:
        try:
            with self._browser.open(request, timeout=60) as answer:
                return Answer(answer.status, answer.read(), dict(answer.headers))
        except urllib.error.HTTPError as error:
            with error:
                return Answer(error.code, error.read(), dict(error.headers))


@contextlib.contextmanager
def serve(state: Path, rig: str = "demo") -> Iterator[ServedPage]:
    """Serve the page of this state directory until the block ends."""
    listener = socket.create_server(("127.0.0.1", 0))
    host, port = listener.getsockname()
    servers: list[uvicorn.Server] = []
    loops: list[asyncio.AbstractEventLoop] = []

    def hang_up() -> None:
        for connection in servers[0].server_state.connections.copy():
            connection.shutdown()

    async def run() -> None:
        loops.append(asyncio.get_running_loop())
        context = WebContext(state, rig, True, ControlLink(state))
        config = uvicorn.Config(
            make_app(context, PageAccess(host, port), None), log_config=None, timeout_graceful_shutdown=2
        )
        servers.append(uvicorn.Server(config))
        await servers[0].serve([listener])

    thread = threading.Thread(target=lambda: asyncio.run(run()))
    thread.start()
    try:
        yield ServedPage(f"http://{host}:{port}", lambda: loops[0].call_soon_threadsafe(hang_up))
    finally:
        servers[0].should_exit = True
        thread.join(30)
        listener.close()
        assert not thread.is_alive()
