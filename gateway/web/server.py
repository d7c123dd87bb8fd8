"""The page as an ASGI application: its files, its API, its events, behind the guard of gateway.web.security.

Everything is served from here: no build step, no request to the outside. The tabs' routes come from gateway.web.tabs, one
module each, and the style is the reports' own (gateway.reports.style.css) with page.css behind it.
"""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from importlib import import_module
from importlib.resources import files
from math import inf
from typing import Any, Final

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import JSONResponse, Response, StreamingResponse
from starlette.routing import BaseRoute, Route

from gateway import VERSION
from gateway.live.control_link import RemovedStateError, ask_once
from gateway.live.ring_rows import RingRows
from gateway.live.standstill import Standstill
from gateway.processes.json_socket.messages import encode_answer, load_shallow
from gateway.reports.style import read_style
from gateway.web import tabs
from gateway.web.commands import Commands, RefusedCommand
from gateway.web.context import WebContext
from gateway.web.events import EventSource
from gateway.web.model_curves import model_curves
from gateway.web.register_table import register_table
from gateway.web.security import Guard, PageAccess, login, refuse, session

_TYPES: Final = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    "LICENSE": "text/plain; charset=utf-8",
}
_STATIC: Final = files("gateway.web") / "static"
Act = Callable[[str, dict[str, Any]], Awaitable[Any]]


def make_app(context: WebContext, access: PageAccess, rows: RingRows | None) -> Starlette:
    """Return the application. rows: the sample ring, None where there is none."""
    commands = Commands(context)
    events = EventSource(context, rows, commands)
    context.viewers = lambda: events.viewers
    standstill = Standstill()

    @asynccontextmanager
    async def lifespan(app: Starlette) -> AsyncIterator[None]:
        context.begin(standstill.keep_time())
        context.begin(context.keep_ways_open())
        yield
        await events.close()
        await context.end_work()
        await commands.close()
        await context.control.close()
        await context.questions.close()

    routes = [*_page_routes(), *_api_routes(context, commands, events)]
    routes += [route for module in _tab_modules() for route in module.routes(context)]
    app = Starlette(
        routes=routes, middleware=[Middleware(Guard, access=access, standstill=standstill)], lifespan=lifespan
    )
    app.state.access = access
    return app


def _tab_modules() -> list[Any]:
    return [import_module(f"{tabs.__name__}.{name}") for name in tabs.NAMES]


def _page_routes() -> list[BaseRoute]:
    async def index(request: Request) -> Response:
        return _file("index.html")

    async def login_page(request: Request) -> Response:
        return _file("login.html")

    async def static(request: Request) -> Response:
        return _file(request.path_params["path"])

    return [
        Route("/", index),
        Route("/login", login_page, methods=["GET"]),
        Route("/login", login, methods=["POST"]),
        Route("/static/{path:path}", static),
        Route("/api/v1/session", session),
    ]


def _file(name: str) -> Response:
    if name == "style.css":
        return Response(read_style(), media_type=_TYPES[".css"])
    parts = name.split("/")
    kind = _TYPES.get(parts[-1] if parts[-1] in _TYPES else f".{parts[-1].rpartition('.')[2]}")
    if kind is None or any(part in ("", "..", ".") for part in parts):
        return refuse(404, f"there is no file {name}")
    try:
        return Response(_STATIC.joinpath(*parts).read_bytes(), media_type=kind)
    except (OSError, ValueError):  # ValueError: a null character; OSError: too long a name, too
        return refuse(404, f"there is no file {name}")


def _api_routes(context: WebContext, commands: Commands, events: EventSource) -> list[BaseRoute]:
    async def state(request: Request) -> Response:
        return _answer(await context.questions.ask({"do": "state"}))

    async def stream(request: Request) -> Response:
        viewer = request.query_params.get("viewer", "")[:64]
        return StreamingResponse(events.stream(viewer), media_type="text/event-stream")

    async def health(request: Request) -> Response:
        return JSONResponse({"ok": True, "version": VERSION})

    async def registers(request: Request) -> Response:
        port = (await context.questions.ask({"do": "running"}))["port"]
        return JSONResponse(register_table(context.profile, port))

    async def words(request: Request) -> Response:
        block = request.path_params["block"]
        read = await commands.words(block, context.questions)
        return JSONResponse({"first": context.profile.register_map.block(block).first, "words": read})

    async def model(request: Request) -> Response:
        # a store that somebody changes on a slow disk is waited for, and a Stop must not wait with it
        return JSONResponse(await asyncio.to_thread(model_curves, context.profile, context.state))

    async def alive(request: Request) -> Response:
        commands.note_alive(_viewer(request))
        return JSONResponse({"commander": commands.commander})

    return [
        Route("/healthz", health),
        Route("/events", stream),
        Route("/api/v1/state", _told(state)),
        Route("/api/v1/registers", _told(registers)),
        Route("/api/v1/words/{block}", _told(words)),
        Route("/api/v1/model", _told(model)),
        Route("/api/v1/alive", alive, methods=["POST"]),
        Route("/api/v1/command/{name}", _told(_command(context, commands)), methods=["POST"]),
    ]


def _command(context: WebContext, commands: Commands) -> Callable[[Request], Awaitable[Response]]:
    acts: dict[str, Act] = {
        "stop": lambda viewer, body: commands.stop(),
        "enable": lambda viewer, body: commands.enable(viewer, _number(body, "force_n")),
        "setpoint": lambda viewer, body: commands.set_force(viewer, _number(body, "force_n")),
        "take-ownership": lambda viewer, body: commands.take_ownership(viewer),
        "reset": lambda viewer, body: commands.reset(),
        "tare": lambda viewer, body: commands.tare(),
        # by a way of its own: its answer waits for the disk, and neither a Stop nor a heartbeat must wait with it
        "record": lambda viewer, body: ask_once(context.state, {"do": "record", "on": _switch(body, "on")}),
    }

    async def command(request: Request) -> Response:
        name = request.path_params["name"]
        if name not in acts:
            return refuse(404, f"{name} is none of {', '.join(acts)}")
        body = _fields(await request.body())
        answer = await acts[name](_viewer(request), body)
        return _answer({"ok": True} | (answer or {}))

    return command


def _fields(body: bytes) -> dict[str, Any]:
    """Return the fields of a request's body. ValueError for anything but a JSON object, however deeply it nests."""
    try:
        fields = load_shallow(body or b"{}")
    except ValueError:
        fields = None
    if not isinstance(fields, dict):
        raise ValueError("a JSON object is expected")
    return fields


def _number(body: dict[str, Any], name: str) -> float:
    value = body[name]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(repr(name))
    try:
        return float(value)
    except OverflowError:
        return inf  # refused as what it means


def _switch(body: dict[str, Any], name: str) -> bool:
    """Return true or false; "false" would count as true."""
    value = body[name]
    if not isinstance(value, bool):
        raise TypeError(repr(name))
    return value


def _told(handler: Callable[[Request], Awaitable[Response]]) -> Callable[[Request], Awaitable[Response]]:
    """Return the handler with what goes wrong told in a sentence."""

    async def told(request: Request) -> Response:
        try:
            return await handler(request)
        except RefusedCommand as refused:
            return refuse(409, str(refused), "refused")
        except RemovedStateError as error:
            return refuse(503, str(error), "gone")
        except (OSError, TimeoutError):
            return refuse(503, "the gateway does not answer: it is being restarted, or has ended", "gone")
        except (KeyError, TypeError) as error:
            return refuse(400, f"{error}: a value is missing, or of the wrong kind")
        except (ValueError, LookupError) as error:
            return refuse(400, str(error))

    return told


def _answer(fields: dict[str, Any]) -> Response:
    return Response(encode_answer(fields), media_type="application/json")


def _viewer(request: Request) -> str:
    return request.headers.get("x-viewer", "")[:64]
