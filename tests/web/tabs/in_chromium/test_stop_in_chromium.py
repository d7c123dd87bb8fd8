"""Esc stops the force wherever the cursor is: behind a click in a report that the page shows, and where the page asks."""

import json
from typing import Any

from tests.web.tabs.conftest import record
from tests.web.tabs.in_chromium.test_many_tabs_in_chromium import STOP, written
from tests.web.tabs.in_chromium.test_tabs_in_chromium import open_tab
from tests.web.tabs.scripted_control import ScriptedControl
from tests.web.tabs.test_calibrations_tab import add_calibration


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
