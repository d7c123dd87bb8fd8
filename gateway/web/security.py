"""Who may use the page: checks that stand before every route.

Decisions
- Host: an address or `localhost` (the machine's own name, too, where a token is asked for). A name that an attacker points at
  this machine (DNS rebinding) is none of these.
- Whatever changes something is POST, must come from the page's own origin where a browser names one, and carries the session's
  CSRF token in a header, which no foreign page can read or set.
- The session is a cookie that scripts cannot read and other sites cannot send. With a token configured it exists after a
  login only; tools send `Authorization: Bearer TOKEN` instead, which needs no CSRF token because no browser adds it by itself.
  It holds for as long as the token does: where the page's process was started anew, Esc stops, and leads to no login.
- A token of 16 characters is not guessed: an address that was wrong too often has one more a second (token_guesses.py).
- What came while this process stood still is refused, but for what stops: an enable of then pressed seconds after its browser
  had given it up. So is what a line has held up for as long: the page says by this machine's clock when it asks.
"""

import contextlib
import hmac
import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from hashlib import sha256
from ipaddress import ip_address
from math import nan
from socket import gethostname
from typing import Final

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from gateway.live.standstill import Standstill
from gateway.web.token_guesses import TokenGuesses

CSRF_HEADER: Final = "x-csrf-token"
ASKED_HEADER: Final = "x-asked-s"
"""Monotonic seconds of this machine, as `clock_s` of the event `state` told them."""
GIVEN_UP_S: Final = 5.0  # COMMAND_MS in static/api.js
LONGEST_BODY: Final = 1 << 16
_OPEN: Final = ("/login", "/healthz", "/static/style.css", "/static/page.css", "/static/login.js")
"""Reached without a session: what the login itself needs."""
_STOPS: Final = ("/api/v1/command/stop", "/api/v1/calibrate/stop")
_SAFE_METHODS: Final = ("GET", "HEAD")
HEADERS: Final = {
    "content-security-policy": "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "connect-src 'self'; frame-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'self'",
    "x-content-type-options": "nosniff",
    "x-frame-options": "SAMEORIGIN",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-store",
}
"""Sent with each answer, unless its route says otherwise."""


@dataclass
class PageAccess:
    """The rules of one page. host, port: where it listens; token: what a browser must know, None on loopback alone."""

    host: str
    port: int
    token: str | None = None
    key: bytes = field(default_factory=lambda: secrets.token_bytes(32))
    guesses: TokenGuesses = field(default_factory=TokenGuesses)
    clock_s: Callable[[], float] = time.monotonic

    def __post_init__(self) -> None:
        if self.token is not None:
            self.key = hmac.new(self.token.encode(), b"force-gateway sessions", sha256).digest()

    @property
    def cookie(self) -> str:
        """Name of the session's cookie: ports of one host share their cookies."""
        return f"force_gateway_{self.port}"

    def new_session(self) -> str:
        """Return a session that this process knows as its own."""
        name = secrets.token_urlsafe(18)
        return f"{name}.{self._sign('session', name)}"

    def is_session(self, value: str) -> bool:
        """Decide whether a cookie is one of ours."""
        name, _, signature = value.partition(".")
        return hmac.compare_digest(signature.encode(), self._sign("session", name).encode())

    def csrf_token(self, session: str) -> str:
        """Return the token that a session's commands must carry."""
        return self._sign("csrf", session)

    def judge_token(self, given: str, request: Request) -> bool | None:
        """Return whether this is the page's token, None where its caller has been wrong too often to be told."""
        if self.token is None:
            return False
        address, now_s = request.client.host if request.client else "", self.clock_s()
        if self.guesses.wait_s(address, now_s):
            return None
        is_right = hmac.compare_digest(given.encode(), self.token.encode())
        if not is_right:
            self.guesses.note_wrong(address, now_s)
        return is_right

    def admits_host(self, host: str) -> bool:
        """Decide whether a Host header names this machine in a way that no foreign name can."""
        bare = host.rpartition(":")[0] if host.rpartition(":")[2].isdecimal() and not host.endswith("]") else host
        bare = bare.removeprefix("[").removesuffix("]").lower()
        if bare == "localhost" or (self.token is not None and bare == gethostname().lower()):
            return True
        try:
            return ip_address(bare).is_loopback or self.token is not None
        except ValueError:
            return False

    def _sign(self, purpose: str, text: str) -> str:
        return hmac.new(self.key, f"{purpose} {text}".encode(), sha256).hexdigest()


class Guard:
    """ASGI middleware: lets a request through to the routes, or answers why not."""

    def __init__(self, app: ASGIApp, access: PageAccess, standstill: Standstill) -> None:
        self._app, self._access, self._standstill = app, access, standstill

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        request = Request(scope)
        refusal = self._refusal(request) or self._lateness(request)
        with contextlib.suppress(ClientDisconnect):  # in the middle of its body: nobody is there to be told anything
            await (refusal or self._app)(scope, receive, send_with_headers)

    def _lateness(self, request: Request) -> Response | None:
        if request.method in _SAFE_METHODS or request.url.path in _STOPS:
            return None
        if self._standstill.is_aftermath():
            return refuse(
                503, "the page's process stood still for a while, and this may have waited: ask again", "late"
            )
        if not _age_s(request.headers) <= GIVEN_UP_S:
            return refuse(503, f"this was on its way for more than {GIVEN_UP_S:g} s: ask again", "late")
        return None

    def _refusal(self, request: Request) -> Response | None:
        """Return why a request is not let through, None where it is."""
        access, headers, path = self._access, request.headers, request.url.path
        if not access.admits_host(headers.get("host", "")):
            return refuse(403, "this page answers to its address only, not to the name in the address bar")
        if headers.get("sec-fetch-site") == "cross-site" and path not in ("/", "/login"):
            return refuse(403, "another site asked for this")
        scheme, _, given = headers.get("authorization", "").partition(" ")
        is_bearer = path not in _OPEN and scheme.lower() == "bearer" and access.judge_token(given, request)
        session = request.cookies.get(access.cookie, "")
        has_session = access.is_session(session)
        if access.token is not None and not (is_bearer or has_session) and path not in _OPEN:
            if is_bearer is None:
                return _too_many()
            return RedirectResponse("/login", 303) if path == "/" else refuse(401, "log in first: /login", "login")
        if request.method in _SAFE_METHODS:
            return None
        if not _is_small(headers):
            return refuse(413, f"a request has at most {LONGEST_BODY} bytes, and says how many")
        if not _is_own_origin(headers):
            return refuse(403, "another site sent this command")
        if is_bearer or path == "/login":
            return None
        if has_session and hmac.compare_digest(
            headers.get(CSRF_HEADER, "").encode(), access.csrf_token(session).encode()
        ):
            return None
        return refuse(403, "the session is over: reload the page", "session")


async def session(request: Request) -> Response:
    """Return the token that commands carry, and begin a session where there is none yet."""
    access: PageAccess = request.app.state.access
    value = request.cookies.get(access.cookie, "")
    is_new = not access.is_session(value)
    value = access.new_session() if is_new else value
    response = JSONResponse({"csrf": access.csrf_token(value)})
    if is_new:
        _set_session(response, access, value)
    return response


async def login(request: Request) -> Response:
    """Take the token of a form; begin a session where it is right."""
    access: PageAccess = request.app.state.access
    given = (await request.body()).decode("utf-8", "replace").strip()
    is_right = access.judge_token(given, request)
    if is_right is None:
        return _too_many()
    if not is_right:
        return refuse(401, "that is not the token; it stands in the rig file under web.token")
    response = JSONResponse({"ok": True})
    _set_session(response, access, access.new_session())
    return response


def refuse(status: int, sentence: str, reason: str = "") -> JSONResponse:
    """Return an answer that says why not. reason: one word for the page's script, where it can do something about it."""
    return JSONResponse({"error": sentence, "reason": reason}, status)


def _too_many() -> JSONResponse:
    return refuse(429, "too many wrong tokens came from this address: wait for a few seconds, and send none meanwhile")


def _set_session(response: Response, access: PageAccess, value: str) -> None:
    response.set_cookie(access.cookie, value, httponly=True, samesite="strict", path="/")


def _is_small(headers: Headers) -> bool:
    """A body in chunks says no length, or another one than it has; whoever says neither sends none (RFC 9112, 6.3)."""
    if "transfer-encoding" in headers:
        return False
    length = headers.get("content-length", "0")
    return length.isdecimal() and int(length) <= LONGEST_BODY


def _age_s(headers: Headers) -> float:
    """How long ago it was asked, by the clock of this machine; 0 where that is not said, NaN where it is not understood."""
    try:
        asked_s = headers.get(ASKED_HEADER)
        return 0.0 if asked_s is None else time.monotonic() - float(asked_s)
    except ValueError:
        return nan


def _is_own_origin(headers: Headers) -> bool:
    """A browser names the origin of whatever changes something; a tool names none."""
    origin = headers.get("origin")
    return origin is None or origin in (f"http://{headers.get('host')}", f"https://{headers.get('host')}")
