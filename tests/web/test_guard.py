"""Who may use the page: no foreign name, no foreign site, no command without the session's token, nobody without a login."""

import asyncio
from pathlib import Path
from typing import Any

import pytest

from gateway.live.standstill import Standstill
from gateway.web import security
from gateway.web.security import PageAccess
from gateway.web.server import _file
from tests.web.asgi import Answer, call, page

TOKEN = "a-token-of-some-length"
ALIVE = "/api/v1/alive"


def answer(app: Any, method: str, path: str, headers: dict[str, str] | None = None, body: bytes | None = b"") -> Answer:
    return asyncio.run(call(app, method, path, headers, body))


def session_of(app: Any) -> dict[str, str]:
    """Headers of a browser that has opened the page."""
    opened = answer(app, "GET", "/api/v1/session")
    return {"cookie": opened.cookie, "x-csrf-token": opened.json["csrf"]}


@pytest.fixture
def app(tmp_path: Path) -> Any:
    return page(tmp_path)


@pytest.mark.parametrize("host", ["127.0.0.1:8080", "localhost:1", "LOCALHOST", "[::1]:8080", "127.8.8.8"])
def test_the_page_answers_to_this_machine(app: Any, host: str) -> None:
    assert answer(app, "GET", "/healthz", {"host": host}).status == 200


@pytest.mark.parametrize(
    "host",
    ["evil.example", "evil.example:8080", "127.0.0.1.evil.example", "192.168.1.5:8080", "", "[", "localhost.", "0"],
)
def test_a_name_that_leads_here_is_not_this_machine(app: Any, host: str) -> None:
    """DNS rebinding: the browser of a visitor believes that evil.example has this address."""
    assert answer(app, "GET", "/", {"host": host}).status == 403


def test_a_command_needs_the_token_of_its_own_session(app: Any) -> None:
    mine, other = session_of(app), session_of(app)
    assert mine["x-csrf-token"] not in mine["cookie"], "what a script may know opens no session"
    assert answer(app, "POST", ALIVE, mine).status == 200
    assert answer(app, "POST", ALIVE).json["reason"] == "session"
    assert answer(app, "POST", ALIVE, {"cookie": mine["cookie"]}).status == 403
    assert answer(app, "POST", ALIVE, mine | {"x-csrf-token": other["x-csrf-token"]}).status == 403
    forged = mine["cookie"].partition("=")[0] + "=anything.0000"
    assert answer(app, "POST", ALIVE, mine | {"cookie": forged}).status == 403


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"origin": "http://127.0.0.1:8080"}, 200),
        ({"origin": "https://127.0.0.1:8080"}, 200),  # behind a proxy with a certificate
        ({"origin": "http://evil.example"}, 403),
        ({"origin": "http://127.0.0.1:9999"}, 403),
        ({"origin": "null"}, 403),
        ({"sec-fetch-site": "cross-site"}, 403),
        ({"sec-fetch-site": "same-origin"}, 200),
        ({"content-length": "100000"}, 413),
        ({"content-length": "lots"}, 413),
        ({"content-length": "3", "transfer-encoding": "chunked"}, 413),
        ({"x-csrf-token": "\u00e9"}, 403),
    ],
)
def test_another_site_commands_nothing_even_with_a_stolen_session(
    app: Any, headers: dict[str, str], status: int
) -> None:
    assert answer(app, "POST", ALIVE, session_of(app) | headers).status == status


def test_another_site_reads_nothing(app: Any) -> None:
    for path in ("/api/v1/session", "/events", "/api/v1/state", "/static/app.js"):
        assert answer(app, "GET", path, {"sec-fetch-site": "cross-site"}).status == 403
    assert "access-control-allow-origin" not in answer(app, "GET", "/api/v1/session").headers


def test_a_link_on_another_site_may_lead_to_the_page(app: Any) -> None:
    for path in ("/", "/login"):
        assert answer(app, "GET", path, {"sec-fetch-site": "cross-site"}).status < 400


def test_every_answer_forbids_what_the_page_does_not_need(app: Any) -> None:
    for path, headers in (
        ("/", {}),
        ("/nothing-here", {}),
        ("/", {"host": "evil.example"}),
        ("/static/uplot/LICENSE", {}),
    ):
        told = answer(app, "GET", path, headers).headers
        assert "default-src 'none'" in told["content-security-policy"]
        assert "script-src 'self';" in told["content-security-policy"], "no script of the page's own text"
        assert told["x-content-type-options"] == "nosniff"


@pytest.mark.parametrize(
    "path",
    [
        "../security.py",
        "..%2f",
        "tabs/../../security.py",
        "",
        ".",
        "uplot",
        "app.js/",
        "/etc/passwd",
        "a\0.js",
        f"{'a' * 5000}.js",
    ],
)
def test_nothing_but_the_page_s_own_files_is_served(app: Any, path: str) -> None:
    assert answer(app, "GET", f"/static/{path}").status == 404


def test_the_style_is_that_of_the_reports(app: Any) -> None:
    told = answer(app, "GET", "/static/style.css")
    assert b"--on-stop" in told.body and told.headers["content-type"].startswith("text/css")


def test_with_a_token_nothing_is_told_before_the_login(tmp_path: Path) -> None:
    app = page(tmp_path, TOKEN)
    assert answer(app, "GET", "/").headers["location"] == "/login"
    for path in ("/events", "/api/v1/state", "/api/v1/session", "/static/app.js"):
        assert answer(app, "GET", path).json["reason"] == "login"
    assert answer(app, "GET", "/login").status == 200
    for wrong in (b"", b"wrong", TOKEN[:-1].encode(), b"\xff\xfe"):
        refused = answer(app, "POST", "/login", body=wrong)
        assert refused.status == 401 and "set-cookie" not in refused.headers
    entered = answer(app, "POST", "/login", body=TOKEN.encode())
    assert "HttpOnly" in entered.headers["set-cookie"] and "SameSite=strict" in entered.headers["set-cookie"]
    told = answer(app, "GET", "/api/v1/session", {"cookie": entered.cookie}).json
    assert answer(app, "POST", ALIVE, {"cookie": entered.cookie, "x-csrf-token": told["csrf"]}).status == 200


def test_another_site_logs_nobody_in(tmp_path: Path) -> None:
    """With a token of its own choice it would command in the name of whoever visits it."""
    app = page(tmp_path, TOKEN)
    refused = answer(app, "POST", "/login", {"origin": "http://evil.example"}, TOKEN.encode())
    assert refused.status == 403 and "set-cookie" not in refused.headers
    assert answer(app, "POST", "/login", {"origin": "http://127.0.0.1:8080"}, TOKEN.encode()).status == 200


def test_a_tool_sends_the_token_itself(tmp_path: Path) -> None:
    app = page(tmp_path, TOKEN)
    assert answer(app, "POST", ALIVE, {"authorization": f"Bearer {TOKEN}"}).status == 200
    assert answer(app, "POST", ALIVE, {"authorization": "Bearer wrong"}).status == 401
    assert answer(app, "GET", "/healthz", {"host": "10.0.0.5:8080"}).status == 200, "reached over the network"
    assert answer(app, "GET", "/healthz", {"host": "evil.example"}).status == 403


@pytest.mark.parametrize("path", ["/api/v1/command/stop", "/api/v1/calibrate/stop"])
def test_a_stop_need_not_say_that_it_has_no_body(tmp_path: Path, path: str) -> None:
    """`curl -X POST` sends no length where it sends nothing: that was refused as too large."""
    told = answer(page(tmp_path, TOKEN), "POST", path, {"authorization": f"Bearer {TOKEN}"}, None)
    assert told.status == 503, "nobody is behind this page, and so far it comes"


def test_a_login_outlives_the_page_s_process_and_no_other_token(tmp_path: Path) -> None:
    """It was asked for again behind each restart of that process, and Esc led to the login until then."""
    headers = {"origin": "http://127.0.0.1:8080"}
    logged_in = {"cookie": answer(page(tmp_path, TOKEN), "POST", "/login", headers, TOKEN.encode()).cookie}
    fresh, changed = page(tmp_path, TOKEN), page(tmp_path, TOKEN[::-1])
    csrf = answer(fresh, "GET", "/api/v1/session", logged_in).json["csrf"]
    assert answer(fresh, "POST", ALIVE, logged_in | {"x-csrf-token": csrf}).status == 200
    assert answer(changed, "GET", "/api/v1/session", logged_in).status == 401


def test_a_page_without_its_gateway_says_so(app: Any) -> None:
    told = answer(app, "POST", "/api/v1/command/stop", session_of(app))
    assert told.status == 503 and told.json["reason"] == "gone"
    assert answer(app, "POST", "/api/v1/command/explode", session_of(app)).status == 404
    assert answer(app, "POST", "/api/v1/command/enable", session_of(app), b'{"force_n": "x"}').status == 400


@pytest.mark.parametrize(
    ("name", "body"),
    [
        ("enable", b'{"force_n": true}'),
        ("setpoint", b'{"force_n": "12"}'),
        ("setpoint", b'{"force_n": null}'),
        ("record", b'{"on": "false"}'),
        ("record", b'{"on": 1}'),
        ("enable", b"[" * 30_000),
        ("record", b'{"on":' * 9_000),
        ("tare", b"[]"),
        ("setpoint", b'{"force_n": ' + b"9" * 5_000 + b"}"),
    ],
)
def test_a_value_of_another_kind_is_not_guessed_at(app: Any, name: str, body: bytes) -> None:
    """`true` would press with 1 N, and "false" begin a recording."""
    refused = answer(app, "POST", f"/api/v1/command/{name}", session_of(app), body)
    assert refused.status == 400
    assert "of the wrong kind" in refused.json["error"] or "a JSON object is expected" in refused.json["error"]


def test_a_whole_number_that_no_float_holds_is_no_force(app: Any) -> None:
    refused = answer(app, "POST", "/api/v1/command/setpoint", session_of(app), b'{"force_n": ' + b"9" * 400 + b"}")
    assert refused.status == 409 and "force in newtons" in refused.json["error"]


def test_who_leaves_within_its_request_makes_no_error_of_ours(app: Any) -> None:
    headers = session_of(app) | {"host": "127.0.0.1", "content-length": "100"}
    scope = {"type": "http", "method": "POST", "path": "/login", "query_string": b"", "root_path": "", "headers": []}
    scope["headers"] = [(name.encode(), value.encode()) for name, value in headers.items()]
    sent: list[Any] = []

    async def receive() -> dict[str, Any]:
        return {"type": "http.disconnect"}

    async def send(message: Any) -> None:
        sent.append(message)

    asyncio.run(app(scope, receive, send))
    assert not sent


def test_the_token_of_a_session_s_commands_makes_no_session() -> None:
    """The page's script may read it, and so may a report in a frame that gets out of it."""
    access = PageAccess("127.0.0.1", 8080)
    assert access.is_session(access.new_session())
    assert not access.is_session(f"name.{access.csrf_token('name')}")


@pytest.mark.parametrize("path", ["../static/page.css", "./page.css", "a/../page.css", "/page.css"])
def test_a_way_out_of_the_folder_is_no_file_though_it_comes_back(path: str) -> None:
    assert _file("page.css").status_code == 200
    assert _file(path).status_code == 404


def test_the_machines_own_name_is_one_only_where_a_token_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a token whoever controls the name, or the network's naming, would be let in."""
    monkeypatch.setattr(security, "gethostname", lambda: "Cell-PC")
    asked, open_to_all = PageAccess("0.0.0.0", 8080, TOKEN), PageAccess("127.0.0.1", 8080)
    for host in ("cell-pc", "CELL-PC:8080"):
        assert asked.admits_host(host)
        assert not open_to_all.admits_host(host)
    assert not asked.admits_host("other-pc")


@pytest.mark.parametrize(
    ("path", "reason"),
    [
        ("/api/v1/command/enable", "late"),
        ("/api/v1/command/setpoint", "late"),
        ("/api/v1/calibrate/start", "late"),
        ("/api/v1/command/stop", "gone"),  # nobody is behind this page
        ("/api/v1/no-such", "late"),
    ],
)
def test_what_came_while_the_page_stood_still_presses_nothing_and_a_stop_stops(
    app: Any, monkeypatch: pytest.MonkeyPatch, path: str, reason: str
) -> None:
    """A browser had given an enable up after three seconds; after six the tool pressed."""
    monkeypatch.setattr(Standstill, "is_aftermath", lambda standstill: True)
    told = answer(app, "POST", path, session_of(app), b'{"force_n": 12}')
    assert (told.status, told.json["reason"]) == (503, reason)
    assert answer(app, "POST", path, {}, b"{}").status == 403, "whoever may not is told that first"


def test_a_page_that_runs_is_not_late(app: Any) -> None:
    assert answer(app, "POST", "/api/v1/command/enable", session_of(app), b'{"force_n": 12}').json["reason"] == "gone"
