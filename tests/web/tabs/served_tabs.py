"""The tabs served as the page serves them: a real web server in a thread, on a free port, with the tabs' addresses and scripts."""

import asyncio
import contextlib
import json
import socket
import threading
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

import gateway.web
from gateway.reports.style import read_style
from gateway.web.tabs import calibrate, calibrations, configuration, diagnosis, recordings, wiring

TABS = (calibrate, recordings, calibrations, diagnosis, wiring, configuration)
STATIC = Path(gateway.web.__file__).parent / "static"


@dataclass(frozen=True)
class TabsContext:
    state: Path
    rig: str = "demo"
    simulated: bool = True


@dataclass
class Answer:
    status: int
    body: bytes
    headers: dict[str, str] = field(default_factory=dict)

    @property
    def json(self) -> Any:
        return json.loads(self.body)


@dataclass
class ServedTabs:
    address: str

    def get(self, path: str) -> Answer:
        return self._ask(urllib.request.Request(self.address + path))

    def post(self, path: str, body: Any = None) -> Answer:
        data = body if isinstance(body, bytes) else json.dumps({} if body is None else body).encode()
        request = urllib.request.Request(self.address + path, data, {"Content-Type": "application/json"})
        return self._ask(request)

    def _ask(self, request: urllib.request.Request) -> Answer:
        try:
            with urllib.request.urlopen(request, timeout=60) as answer:
                return Answer(answer.status, answer.read(), dict(answer.headers))
        except urllib.error.HTTPError as error:
            with error:
                return Answer(error.code, error.read(), dict(error.headers))


@contextlib.contextmanager
def serve(context: TabsContext, index: Callable[[], str] = str) -> Iterator[ServedTabs]:
    """Serve the tabs of this state directory until the block ends."""

    async def show_index(request: Request) -> Response:
        return HTMLResponse(index())

    async def style(request: Request) -> Response:
        return Response(read_style(), media_type="text/css")

    routes = [route for tab in TABS for route in tab.routes(context)]
    own = [Route("/", show_index), Route("/static/style.css", style), Mount("/static", StaticFiles(directory=STATIC))]
    server = uvicorn.Server(uvicorn.Config(Starlette(routes=[*routes, *own]), log_level="warning", lifespan="off"))
    listener = socket.create_server(("127.0.0.1", 0))
    thread = threading.Thread(target=lambda: asyncio.run(server.serve([listener])))
    thread.start()
    try:
        yield ServedTabs(f"http://127.0.0.1:{listener.getsockname()[1]}")
    finally:
        server.should_exit = True
        thread.join(30)
        listener.close()
        assert not thread.is_alive()
