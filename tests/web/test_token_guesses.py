"""What a guess at the page's token costs: time of its own address, and nothing of anybody else's."""

import asyncio
from pathlib import Path
from typing import Any

import pytest

from gateway.web.token_guesses import GUESS_S, GUESSES_AT_ONCE, MOST_ADDRESSES, TokenGuesses
from tests.web.asgi import Answer, call, page

TOKEN = "a-token-of-some-length"
HERE, THERE = "10.0.0.7", "10.0.0.8"
Request = tuple[str, str, dict[str, str], bytes]
LOGIN: Request = ("POST", "/login", {}, b"wrong")
BEARER: Request = ("GET", "/api/v1/state", {"authorization": "Bearer wrong"}, b"")
STOP_BEARER: Request = ("POST", "/api/v1/command/stop", {"authorization": "bearer wrong"}, b"")
RIGHT_LOGIN: Request = ("POST", "/login", {}, TOKEN.encode())
RIGHT_BEARER: Request = ("POST", "/api/v1/alive", {"authorization": f"Bearer {TOKEN}"}, b"")


def ask(app: Any, request: Request, client: str = HERE) -> Answer:
    return asyncio.run(call(app, *request, client=client))


@pytest.mark.parametrize("guess", [LOGIN, BEARER, STOP_BEARER], ids=["login", "bearer", "stop"])
def test_guesses_cost_their_address_time_and_nobody_else(tmp_path: Path, guess: Request) -> None:
    """`Authorization: Bearer` tried thousands of tokens a second; and while sixteen logins waited, each further one was told at
    once that it was wrong."""
    app, now_s = page(tmp_path, TOKEN), 100.0
    app.state.access.clock_s = lambda: now_s
    kept = {"cookie": ask(app, RIGHT_LOGIN).cookie}
    answers = [ask(app, guess).status for _ in range(300)]
    assert answers == [401] * GUESSES_AT_ONCE + [429] * (300 - GUESSES_AT_ONCE)
    for right in (RIGHT_LOGIN, RIGHT_BEARER):
        assert ask(app, right).status == 429, "200 told it from all others"
        assert ask(app, right, THERE).status == 200
    assert ask(app, ("GET", "/healthz", BEARER[2], b"")).status == 200
    csrf = {"x-csrf-token": ask(app, ("GET", "/api/v1/session", kept, b"")).json["csrf"]}
    stopped = ask(app, ("POST", "/api/v1/command/stop", kept | csrf, b""))
    assert stopped.status == 503, "nobody is behind this page, and so far whoever has logged in comes"
    now_s += GUESS_S
    assert [ask(app, guess).status for _ in range(2)] == [401, 429]
    now_s += GUESS_S
    assert ask(app, RIGHT_BEARER).status == 200


def test_a_program_with_the_token_of_before_costs_its_neighbour_nothing(tmp_path: Path) -> None:
    """On one machine, once a second, while another program has the right one."""
    app, now_s = page(tmp_path, TOKEN), 100.0
    app.state.access.clock_s = lambda: now_s
    for _ in range(100):
        now_s += GUESS_S
        assert (ask(app, BEARER).status, ask(app, RIGHT_BEARER).status) == (401, 200)


def test_what_is_no_token_is_no_guess(tmp_path: Path) -> None:
    """A proxy's own login comes through, and who has not logged in is led there."""
    app = page(tmp_path, TOKEN)
    for headers in ({"authorization": "Basic dTpw"}, {}, {"cookie": "force_gateway_8080=a.b"}):
        assert {ask(app, ("GET", "/api/v1/state", headers, b"")).status for _ in range(30)} == {401}
    assert ask(app, RIGHT_LOGIN).status == 200


def test_a_slip_of_an_hour_ago_pays_for_no_later_guess() -> None:
    guesses, later_s = TokenGuesses(), 3600.0
    guesses.note_wrong(HERE, 0.0)
    for _ in range(GUESSES_AT_ONCE):
        assert guesses.wait_s(HERE, later_s) == 0
        guesses.note_wrong(HERE, later_s)
    assert guesses.wait_s(HERE, later_s) == GUESS_S


def test_guesses_are_remembered_in_bounds() -> None:
    """Of IPv6 each guesser has 2^64 addresses, and a proxy may name anything at all."""
    guesses = TokenGuesses()
    for k in range(MOST_ADDRESSES + 50):
        guesses.note_wrong(f"10.{k // 65536}.{k // 256 % 256}.{k % 256}", 0.0)
    assert len(guesses) <= MOST_ADDRESSES
    for k in range(GUESSES_AT_ONCE):
        for kind in ("2001:db8::{:x}", "nobody{}", "::ffff:10.9.9.9"):
            assert guesses.wait_s(kind.format(k), 1.0) == 0
            guesses.note_wrong(kind.format(k), 1.0)
    assert all(guesses.wait_s(one, 1.0) == GUESS_S for one in ("2001:db8::ffff", "somebody", "10.9.9.9"))
    assert not any(guesses.wait_s(one, 1.0) for one in ("2001:db8:0:1::1", "10.9.9.8", "::ffff:10.9.9.8"))
