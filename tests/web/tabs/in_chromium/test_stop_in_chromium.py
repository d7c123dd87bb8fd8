"""Esc stops the force wherever the cursor is: behind a click in a report that the page shows, where the page asks, and with
more tabs open than a browser has connections.

It has six for all tabs of the page, and the stream of each keeps one: a Stop goes out all the same. Six tabs of a real browser
take seconds to open. It also says whose it is, and goes out again where the page's process was started anew.
"""

import json
from collections.abc import Iterator
from typing import Any

import pytest

from tests.web.tabs.conftest import record
from tests.web.tabs.in_chromium.test_tabs_in_chromium import open_tab
from tests.web.tabs.scripted_control import ScriptedControl
from tests.web.tabs.test_calibrations_tab import add_calibration

STOP = "1000000001020000"
CONNECTIONS = 6  # of Chromium and of Firefox, to one host by HTTP/1.1
POST_STOP = """async () => {
  const { api } = await import("/static/api.js");
  globalThis.said = api.post("/api/v1/command/stop").then(() => "stopped", (error) => error.message);
}"""
SAID = "() => globalThis.said"


@pytest.fixture
def tabs(page: Any, served: ScriptedControl, chromium: Any) -> Iterator[list[Any]]:
    """More tabs than there are connections: each of those has its stream, and one more waits."""
    browser = chromium.new_context()
    opened = []
    for _ in range(CONNECTIONS):
        window = browser.new_page()
        window.on("pageerror", lambda error: pytest.fail(str(error)))
        window.goto(f"{page.address}/#configuration", wait_until="commit")
        if len(opened) < CONNECTIONS - 1:
            window.get_by_text("demo (simulated)").wait_for()
        opened.append(window)
    opened[-1].wait_for_load_state("domcontentloaded")  # behind its scripts, for which there is one connection yet
    opened[2].evaluate("() => { new EventSource('/events?viewer=other'); }")
    yield opened
    browser.close()


@pytest.fixture
def browser(chromium: Any) -> Any:
    return chromium.new_context()


def written(control: ScriptedControl) -> list[str]:
    return [one["pdu"] for one in control.asked if one["do"] == "modbus" and not one["pdu"].startswith("03")]


def test_esc_stops_from_each_of_them_and_those_that_have_made_way_come_back(
    tabs: list[Any], control: ScriptedControl
) -> None:
    """It waited in the browser without a word, until somebody closed a tab. Those that made way would show a force of
    before the stop until somebody loads them anew."""
    from playwright.sync_api import expect

    def stops_from(window: Any) -> None:
        before = written(control)
        window.keyboard.press("Escape")
        with control.heard:  # the words may stand there of the stop before
            assert control.heard.wait_for(lambda: written(control) != before, 10.0), "nothing was written"
        expect(window.locator("#said")).to_have_text("Stopped: the safe voltage is out.", timeout=10_000)
        assert written(control) == [*before, STOP]

    for window in (tabs[0], tabs[-1], tabs[2]):
        stops_from(window)
    tabs.pop().close()
    all_are_back(tabs)
    stops_from(tabs[0])
    expect(tabs[1].locator("#gone")).to_be_visible(timeout=10_000)
    all_are_back(tabs)


def all_are_back(tabs: list[Any]) -> None:
    from playwright.sync_api import expect

    for window in tabs:
        expect(window.locator("#gone")).to_be_hidden(timeout=10_000)


def test_what_found_no_way_out_is_given_up_and_never_sent(tabs: list[Any], control: ScriptedControl) -> None:
    """It pressed when somebody closed another tab, minutes later."""
    begin = """async () => {
      const { api } = await import("/static/api.js");
      const asked = [api.post("/api/v1/command/enable", { force_n: 12 }), api.post("/api/v1/calibrate/start")];
      globalThis.said = Promise.all(asked.map((one) => one.then(() => "begun", (error) => error.message)));
    }"""
    tabs[0].evaluate("() => { for (let n = 0; n < 6; n++) new EventSource('/events?viewer=other' + n); }")
    tabs[1].clock.install()
    tabs[1].evaluate(begin)
    tabs[1].clock.fast_forward(5_000)
    said = tabs[1].evaluate("() => globalThis.said")
    tabs[0].close()
    assert said == 2 * ["no answer within 5 s: are many tabs of this page open?"]
    assert written(control) == [] and not control.count("calibrate")


def test_esc_stops_also_behind_a_click_in_a_report(page, served: ScriptedControl, state, chromium) -> None:
    """The frame, which runs no script, kept the key for itself."""
    from playwright.sync_api import expect

    record(state)
    window = open_tab(chromium, page.address, "recordings")
    window.get_by_role("button", name="Plot recording 1").click()
    window.frame_locator("iframe").locator("h1").click()
    expect(window.locator("iframe")).not_to_be_focused()
    window.keyboard.press("Escape")
    expect(window.locator("#said")).to_have_text("Stopped: the safe voltage is out.", timeout=10_000)
    assert written(served) == [STOP]
    window.close()


def changed_at_hand(chromium: Any) -> tuple[Any, list[Any]]:
    """A browser whose changes of calibrations are taken here, and what they asked for."""
    asked: list[Any] = []
    browser = chromium.new_context()
    browser.route(
        "**/api/v1/calibrations/change",
        lambda route: (asked.append(json.loads(route.request.post_data)), route.fulfill(json={"said": "it is in use"})),
    )
    return browser, asked


def test_esc_stops_also_where_the_page_asks_again(page, served: ScriptedControl, state, chromium) -> None:
    """The browser's own dialog took the key, and stopped all else meanwhile: a lease ended, and the force with it."""
    from playwright.sync_api import expect

    number = add_calibration(state, rejected="0.9 N RMS, allowed 0.5")
    browser, asked = changed_at_hand(chromium)
    window = open_tab(browser, page.address, "calibrations")
    window.get_by_role("button", name=f"Use calibration {number}").click()
    window.get_by_text("was rejected: 0.9 N RMS, allowed 0.5. Use it all the same?").wait_for()
    window.keyboard.press("Escape")
    expect(window.locator("#said")).to_have_text("Stopped: the safe voltage is out.", timeout=10_000)
    assert (written(served), asked) == ([STOP], [])
    window.get_by_role("button", name=f"Use calibration {number} nevertheless").click()
    window.get_by_text("it is in use").wait_for()
    assert asked == [{"use": number, "force": True}]
    browser.close()


def test_what_was_not_rejected_is_never_asked_for_by_force(page, served: ScriptedControl, state, chromium) -> None:
    """The gateway may know by then that its fit was rejected, and asks again: with force it would have obeyed."""
    number = add_calibration(state)
    browser, asked = changed_at_hand(chromium)
    window = open_tab(browser, page.address, "calibrations")
    window.get_by_role("button", name=f"Use calibration {number}").click()
    window.get_by_text("it is in use").wait_for()
    assert asked == [{"use": number}]
    browser.close()


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
    window.evaluate(POST_STOP)
    assert (window.evaluate(SAID), seen) == ("stopped", ["former", "new"])


def test_a_command_is_of_the_tab_whose_stream_is_heard(page, served: ScriptedControl, browser) -> None:
    """Of a command without that name nobody is there: its force ends with the first lease."""
    window = browser.new_page()
    with window.expect_request("**/events?*") as stream:
        window.goto(f"{page.address}/#wiring", wait_until="commit")
    with window.expect_request("**/api/v1/command/stop") as stop:
        window.evaluate(POST_STOP)
    assert stream.value.url.partition("viewer=")[2] == stop.value.headers["x-viewer"]
    assert window.evaluate(SAID) == "stopped"


def test_a_stop_is_not_given_up_as_what_presses_is(page, served: ScriptedControl, browser) -> None:
    held = list[Any]()
    browser.route("**/api/v1/command/stop", lambda route: held.append(route))
    window = open_tab(browser, page.address, "wiring")
    window.clock.install()
    with window.expect_request("**/api/v1/command/stop"):
        window.evaluate(POST_STOP)
    window.clock.fast_forward(60_000)
    held[0].fulfill(json={})
    assert window.evaluate(SAID) == "stopped"
