"""An ASGI application called without a server: a request in, the whole answer out."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gateway.live.control_link import ControlLink
from gateway.web.context import WebContext
from gateway.web.security import PageAccess
from gateway.web.server import make_app


@dataclass
class Answer:
    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.body)

    @property
    def cookie(self) -> str:
        return self.headers["set-cookie"].partition(";")[0]


async def call(
    app: Any,
    method: str,
    path: str,
    headers: dict[str, str] | None = None,
    body: bytes | None = b"",
    *,
    client: str = "127.0.0.1",
) -> Answer:
    """Send one request; a Host header of the machine itself is added where there is none. body: None for one without, which
    says no length. client: the address that it comes from."""
    length = {} if body is None else {"content-length": str(len(body))}
    own = {"host": "127.0.0.1:8080"} | length | (headers or {})
    scope = {
        "type": "http",
        "asgi": {"version": "3.0"},
        "http_version": "1.1",
        "method": method,
        "path": path,
        "raw_path": path.encode(),
        "query_string": b"",
        "root_path": "",
        "scheme": "http",
        "headers": [(name.lower().encode(), value.encode("latin-1")) for name, value in own.items()],
        "client": (client, 4711),
        "server": ("127.0.0.1", 8080),
    }
    sent: list[dict[str, Any]] = []

    async def receive() -> dict[str, Any]:
        return {"type": "http.request", "body": body or b"", "more_body": False}

    async def send(message: dict[str, Any]) -> None:
        sent.append(message)

    await app(scope, receive, send)
    start = sent[0]
    return Answer(
        start["status"],
        {name.decode(): value.decode() for name, value in start["headers"]},
        b"".join(message.get("body", b"") for message in sent[1:]),
    )


def page(state: Path, token: str | None = None) -> Any:
    """The page of the demo rig, with nobody behind its control socket."""
    context = WebContext(state, "demo", True, ControlLink(state))
    return make_app(context, PageAccess("127.0.0.1", 8080, token), None)
