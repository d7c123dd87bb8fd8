"""Who comes to the page by HTTP's own bytes: as no browser asks, halves, floods of headers, streams that nobody reads.

Nothing changes without the token, each whole request is answered as HTTP, and a Stop gets through whatever others do.
"""

import asyncio
import logging
import socket
from collections.abc import Callable
from contextlib import suppress
from random import Random
from typing import Any

import pytest
from uvicorn import Config
from uvicorn.server import ServerState

from gateway.web import bounded_http
from tests.service.requests.drawn.world import TOKEN, World

MOST, WHOLE_REQUEST_S, UNREAD_S, TURNS = 5, 0.4, 0.6, 40
"""Connections that are served, and times as short as a scene's."""
HEAD = "HTTP/1.1\r\nHost: 127.0.0.1\r\n"
BEARER = f"Authorization: Bearer {TOKEN}\r\n"
LOGS = "uvicorn.error", "asyncio"
MOST_HELD = 1 << 19
PATHS = (
    "/", "/", "/login", "/healthz", "/api/v1/state", "/api/v1/state", "/api/v1/registers", "/api/v1/words/status",
    "/api/v1/words/none", "/api/v1/session", "/static/app.js", "/static/../server.py", "/static/%2e%2e/server.py", "/%00",
    "//", "/metrics", "*", "/events?viewer=a", "/api/v1/recordings", "/api/v1/calibrations", "/api/v1/" + 3000 * "x",
    "/api/v1/command/stop", "/api/v1/command/enable", "/api/v1/alive", "http://evil/", "/api/v1/state?" + 900 * "a=b&",
)  # fmt: skip
OPEN = "/login", "/healthz"
METHODS = ("GET", "GET", "GET", "HEAD", "POST", "PUT", "OPTIONS", "BREW", "DELETE")


class Told(logging.Handler):
    """What libraries tell of somebody's request as a fault of this program's."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.sentences: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.sentences.append(f"{record.getMessage()} {record.exc_info[1] if record.exc_info else ''}")


class InOrder(dict[Any, None]):
    """For a set of the server's, in whose place the order is that of coming, and not of places in memory: of several who came
    in one moment always the same one makes room."""

    def add(self, one: Any) -> None:
        self[one] = None

    def discard(self, one: Any) -> None:
        self.pop(one, None)


class Browser:
    """One connection. methods: of the whole requests it has sent; reads: takes what is answered."""

    def __init__(self, wire: socket.socket, now_s: float) -> None:
        self.wire, self.came_s, self.is_slow = wire, now_s, False
        self.statuses: list[int] = []
        self.may_read = False  # what is answered now may be of an earlier request
        self.is_closed, self.is_spoiled, self.is_stream, self.reads, self.asked = False, False, False, True, 0


class Browsers:
    def __init__(self, world: World, draw: Random, patch: pytest.MonkeyPatch) -> None:
        self._world, self._draw, self.broken = world, draw, list[str]()
        self._there: list[Browser] = []
        patch.setattr(bounded_http, "WHOLE_REQUEST_S", WHOLE_REQUEST_S)
        patch.setattr(bounded_http, "UNREAD_S", UNREAD_S)
        patch.setattr(asyncio, "to_thread", _at_once)
        world.loop.time = world.clock.time  # type: ignore[method-assign]
        config = Config(
            world.page, lifespan="off", log_config=None, access_log=False, ws="none", limit_concurrency=MOST
        )
        config.load()
        self._state, self._told = ServerState(), Told()
        self._state.connections = InOrder()  # type: ignore[assignment]
        for name in LOGS:
            logging.getLogger(name).addHandler(self._told)
        self._serve = lambda: bounded_http.BoundedHttpProtocol(config, self._state, {})

    def act(self, look: Callable[[], Any], differences: Callable[[Any, Any], list[str]]) -> str:
        draw, before = self._draw, look()
        for _ in range(draw.choice((0, 0, 0, MOST + 1))):
            self._come().is_slow = draw.random() < 0.5
        browser = draw.choice(self._there) if self._there and draw.random() < 0.4 else self._come()
        data, told = self._drawn(browser)
        known, is_open = len(browser.statuses), BEARER.encode() in data or any(path in told for path in OPEN)
        at = draw.choice((len(data), len(data), draw.randrange(len(data) + 1)))
        browser.is_spoiled |= at < len(data)
        for piece in (data[: at // 2], data[at // 2 : at]):
            self._send(browser, piece)
            self._turn(4)
        self._turn()
        if changes := differences(before, look()):
            self.broken.append(f"{told} changes {changes[:6]}")
        if not is_open and not browser.may_read and any(200 <= status < 300 for status in browser.statuses[known:]):
            self.broken.append(f"{told} is answered without the token: {browser.statuses}")
        browser.may_read |= is_open
        if self._told.sentences:
            self.broken.append(f"{told} makes the log tell {self._told.sentences}")
        if draw.random() < 0.3:
            self._leave(browser)
        return f"{told} -> {browser.statuses}, {len(self._there)} are there"

    def stop(self) -> None:
        """A Stop by one who comes anew."""
        browser = self._come()
        head = f"POST /api/v1/command/stop {HEAD}{BEARER}Content-Length: 2\r\n\r\n{{}}"
        browser.asked += 1
        self._send(browser, head.encode())
        self._turn()
        if browser.statuses != [200]:
            self.broken.append(f"a Stop by HTTP is answered {browser.statuses}, {len(self._there)} are there")
        self._leave(browser)

    # -- what is asked

    def _drawn(self, browser: Browser) -> tuple[bytes, str]:
        """One request, whole as far as it goes, without the token where it could change anything."""
        draw = self._draw
        method, path = draw.choice(METHODS), draw.choice(PATHS)
        token = BEARER if method in ("GET", "HEAD") and draw.random() < 0.6 else ""
        more, body = draw.choice(
            (
                *[("", b"")] * 6,
                ("Content-Length: 2\r\n", b"{}"),
                ("Content-Length: 70000\r\n", b"x" * 70000),
                ("Content-Length: -1\r\n", b"{}"),
                ("Content-Length: 2\r\nContent-Length: 3\r\n", b"{}"),
                ("Transfer-Encoding: chunked\r\n", b"2\r\n{}\r\n0\r\n\r\n"),
                ("Transfer-Encoding: chunked\r\n", b"zz\r\n{}\r\n"),
                ("X: " + 90_000 * "y" + "\r\n", b""),
                ("".join(f"X-{k}: y\r\n" for k in range(300)), b""),
                ("Host: evil\r\n", b""),
                ("X: \x00\r\n", b""),
                ("Expect: 100-continue\r\nContent-Length: 2\r\n", b"{}"),
                ("Connection: Upgrade\r\nUpgrade: websocket\r\n", b""),
            )
        )
        browser.is_spoiled |= browser.is_slow or bool(more) or method == "BREW"
        browser.is_stream |= path.startswith("/events") and bool(token) and method == "GET" and not more
        browser.reads = browser.reads and not (browser.is_stream and draw.random() < 0.6)
        browser.asked += 1
        return f"{method} {path} {HEAD}{token}{more}\r\n".encode(
            "latin-1"
        ) + body, f"{method} {path[:40]} {more[:30]!r} {token[:6]}"

    def _come(self) -> Browser:
        ours, far = socket.socketpair()
        far.setblocking(False)
        ours.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 8192)
        self._world.do(self._world.loop.connect_accepted_socket(self._serve, ours))
        self._there.append(browser := Browser(far, self._world.clock.now_s))
        return browser

    def _send(self, browser: Browser, data: bytes) -> None:
        with suppress(OSError):
            while data and (sent := browser.wire.send(data)):
                data = data[sent:]
                self._turn(2)

    def _leave(self, browser: Browser) -> None:
        browser.wire.close()
        if browser in self._there:
            self._there.remove(browser)
        self._turn(4)

    # -- what is heard

    def _turn(self, count: int = TURNS) -> None:
        async def turns() -> None:
            for _ in range(count):
                await asyncio.sleep(0)

        self._world.do(turns())
        self.collect()

    def collect(self) -> None:
        """Take what has come, and look at what is held."""
        for browser in tuple(self._there):
            if browser.reads:
                self._take(browser)
        for each in self._state.connections:
            held = each.transport.get_write_buffer_size()
            if held > MOST_HELD:
                self.broken.append(f"{held} bytes are held for a browser")
        if len(self._state.connections) > MOST + 1:
            self.broken.append(f"{len(self._state.connections)} browsers are served")

    def _take(self, browser: Browser) -> None:
        try:
            while data := browser.wire.recv(1 << 20):
                self._hear(browser, data)
            browser.is_closed = True
        except BlockingIOError:
            return
        except OSError:
            browser.is_closed = True
        browser.wire.close()
        self._there.remove(browser)

    def _hear(self, browser: Browser, data: bytes) -> None:
        at = 0
        while (at := data.find(b"HTTP/1.1 ", at)) >= 0:
            status = int(data[at + 9 : at + 12])
            browser.statuses.append(status)
            at += 12
            if status >= 500 and status != 503:
                self.broken.append(f"is answered {data[at - 12 : at + 300]!r}")

    def judge_soon(self) -> None:
        """Whoever asked as HTTP has it, once, and reads, is answered by now; nobody is answered twice. Who sends byte by byte,
        or nothing, is not waited for."""
        for slow in [one for one in self._there if one.is_slow]:
            self._send(slow, b"X")
        self._turn()
        now_s = self._world.clock.now_s
        late = [one for one in self._there if not one.asked and now_s - one.came_s > WHOLE_REQUEST_S + 0.01]
        self.broken += [f"who came at {one.came_s:.3f} and asks nothing is still there at {now_s:.3f}" for one in late]
        for one in self._there:
            is_plain = not (one.is_spoiled or one.is_stream) and one.reads
            if is_plain and len([each for each in one.statuses if each >= 200]) != one.asked:
                self.broken.append(f"{one.asked} requests are answered {one.statuses}")

    def close(self) -> None:
        for browser in tuple(self._there):
            self._leave(browser)
        for name in LOGS:
            logging.getLogger(name).removeHandler(self._told)


async def _at_once(work: Callable[..., Any], *given: Any) -> Any:
    """What a thread would do: no disk is slow here."""
    return work(*given)
