"""A command of the page: whose it is, what becomes of it when the page's process was started anew, and that a stop waits."""

from typing import Any

import pytest

from tests.web.tabs.in_chromium.test_tabs_in_chromium import open_tab
from tests.web.tabs.scripted_control import ScriptedControl

STOP = """async () => {
  const { api } = await import("/static/api.js");
  globalThis.said = api.post("/api/v1/command/stop").then(() => "stopped", (error) => error.message);
}"""
SAID = "() => globalThis.said"


@pytest.fixture
def browser(chromium: Any) -> Any:
    return chromium.new_context()


def test_a_command_goes_out_again_with_the_token_of_the_new_session(page, served: ScriptedControl, browser) -> None:
    """It was refused as one of a session that is over, and the output stayed on."""
    tokens = iter(("former", "new"))
    seen = list[str]()

    def answer(route: Any) -> None:
        seen.append(route.request.headers["x-csrf-token"])
        if seen[-1] == "new":
            route.fulfill(json={})
        else:
            route.fulfill(status=403, json={"error": "the session is over: reload the page", "reason": "session"})

    browser.route("**/api/v1/session", lambda route: route.fulfill(json={"csrf": next(tokens)}))
    browser.route("**/api/v1/command/stop", answer)
    window = open_tab(browser, page.address, "wiring")
    window.evaluate(STOP)
    assert (window.evaluate(SAID), seen) == ("stopped", ["former", "new"])


def test_a_command_is_of_the_tab_whose_stream_is_heard(page, served: ScriptedControl, browser) -> None:
    """Of a command without that name nobody is there: its force ends with the first lease."""
    window = browser.new_page()
    with window.expect_request("**/events?*") as stream:
        window.goto(f"{page.address}/#wiring", wait_until="commit")
    with window.expect_request("**/api/v1/command/stop") as stop:
        window.evaluate(STOP)
    assert stream.value.url.partition("viewer=")[2] == stop.value.headers["x-viewer"]
    assert window.evaluate(SAID) == "stopped"


def test_a_stop_is_not_given_up_as_what_presses_is(page, served: ScriptedControl, browser) -> None:
    held = list[Any]()
    browser.route("**/api/v1/command/stop", lambda route: held.append(route))
    window = open_tab(browser, page.address, "wiring")
    window.clock.install()
    with window.expect_request("**/api/v1/command/stop"):
        window.evaluate(STOP)
    window.clock.fast_forward(60_000)
    held[0].fulfill(json={})
    assert window.evaluate(SAID) == "stopped"
