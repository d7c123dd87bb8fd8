"""What nobody can guess by the time that an answer takes, and a page that no other one can put a frame around."""

import asyncio
import hmac
from pathlib import Path

import pytest

from gateway.live.standstill import Standstill
from gateway.web import security
from tests.web.asgi import call, page

TOKEN = "a-token-of-some-length"


@pytest.fixture
def compared(monkeypatch: pytest.MonkeyPatch) -> list[set[bytes]]:
    """What is compared in the same time whatever is alike."""
    pairs: list[set[bytes]] = []
    in_constant_time = hmac.compare_digest

    def compare(one: bytes, other: bytes) -> bool:
        pairs.append({one, other})
        return in_constant_time(one, other)

    monkeypatch.setattr(security.hmac, "compare_digest", compare)
    return pairs


def test_each_secret_is_compared_in_a_time_that_tells_nothing_of_it(tmp_path: Path, compared: list[set[bytes]]) -> None:
    """`==` ends at the first letter that differs: a token is found letter by letter."""
    app = page(tmp_path, TOKEN)
    asyncio.run(call(app, "POST", "/login", {}, b"a-token-of-another-length"))
    assert {TOKEN.encode(), b"a-token-of-another-length"} in compared
    login = asyncio.run(call(app, "POST", "/login", {}, TOKEN.encode()))
    opened = asyncio.run(call(app, "GET", "/api/v1/session", {"cookie": login.cookie}))
    told = asyncio.run(call(app, "POST", "/api/v1/alive", {"cookie": login.cookie, "x-csrf-token": "of another"}))
    assert told.status == 403 and {opened.json["csrf"].encode(), b"of another"} in compared


def test_no_other_site_puts_a_frame_around_the_page(tmp_path: Path) -> None:
    """Who clicks on a game there would click on `enable` here."""
    headers = asyncio.run(call(page(tmp_path), "GET", "/")).headers
    assert "frame-ancestors 'self'" in headers["content-security-policy"]
    assert headers["x-frame-options"] == "SAMEORIGIN"


def test_a_report_is_without_a_script_and_in_a_sandbox(tmp_path: Path) -> None:
    """What stands in it comes of recordings from anywhere; the page's own policy must not take the place of its own."""
    (tmp_path / "diagnoses").mkdir()
    (tmp_path / "diagnoses" / "0001.html").write_text("<p>a report</p>")
    told = asyncio.run(call(page(tmp_path), "GET", "/api/v1/diagnosis/1/report"))
    policy = told.headers["content-security-policy"]
    assert told.status == 200 and policy.endswith("sandbox") and "script-src" not in policy


def test_a_stop_of_a_calibration_is_never_late(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Told to ask again, a person beside a tool that climbs stairs would have pressed twice."""
    monkeypatch.setattr(Standstill, "is_aftermath", lambda standstill: True)
    app = page(tmp_path, TOKEN)
    bearer = {"authorization": f"Bearer {TOKEN}"}
    reasons = [
        asyncio.run(call(app, "POST", f"/api/v1/calibrate/{what}", bearer, b"{}")).json.get("reason")
        for what in ("stop", "start")
    ]
    assert reasons[0] != "late" and reasons[1] == "late"
