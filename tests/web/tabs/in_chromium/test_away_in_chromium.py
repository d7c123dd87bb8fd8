"""A page that is opened or looked at while the gateway or the page's process is away: what it shows when that is back."""

import json
from typing import Any

import pytest

from gateway.web.events import EventSource
from gateway.web.register_table import register_table
from tests.service.rigs import demo
from tests.web.tabs.conftest import record
from tests.web.tabs.in_chromium.test_tabs_in_chromium import open_tab
from tests.web.tabs.scripted_control import ScriptedControl

REGISTERS = """async (map) => {
  const { makeRegisters } = await import("/static/live/registers.js");
  let asked = 0;
  const get = async () => { if (!asked++) throw new Error("away"); return map; };
  const table = makeRegisters({ get, say: () => {} });
  await new Promise((done) => setTimeout(done));
  await table.state({ words: { command: [], status: [] }, writers: {} });
  return table.element.textContent;
}"""
TIMES = """async () => {
  const { duration } = await import("/static/tabs/dom.js");
  const { makeAlarms } = await import("/static/live/health.js");
  const alarms = makeAlarms({ on: () => {} });
  alarms.tell({ time: "2026-11-22T10:30:05.123Z", severity: "error", code: "A310", text: "master lost" });
  return [alarms.element.querySelector("ol").textContent, duration(119.7), duration(90.4), duration(5399.6)];
}"""
JOB = {"recording": 1, "stage": "search", "done": 1, "of": 9, "ended": "", "said": "", "spent_s": 3.0}


def test_what_could_not_be_read_at_first_is_there_when_the_gateway_is_back(page, chromium) -> None:
    """Wiring, configuration and the register table stayed empty until somebody loaded the page again. Where the page comes
    from another machine without https, a browser has no clipboard."""
    browser = chromium.new_context()
    browser.add_init_script('Object.defineProperty(navigator, "clipboard", { value: undefined });')
    asked: list[str] = []

    def answer(route: Any) -> None:
        asked.append(route.request.url)
        route.abort() if asked.count(asked[-1]) == 1 else route.continue_()

    browser.route("**/api/v1/wiring", answer)
    browser.route("**/api/v1/configuration", answer)
    window = open_tab(browser, page.address, "wiring")
    window.get_by_text("Wiring of rig demo").wait_for()
    window.get_by_role("button", name="Copy the commands").first.click()
    window.get_by_text("Ctrl-C copies it").wait_for()
    assert window.evaluate("getSelection().toString()")
    window.goto(f"{page.address}/#configuration")
    window.get_by_text("demo.yaml:").first.wait_for()
    assert "force_setpoint" in window.evaluate(REGISTERS, register_table(demo(), 5020))
    browser.close()


def test_a_tab_that_could_not_be_loaded_is_there_when_the_gateway_is_back(
    page, served: ScriptedControl, chromium
) -> None:
    """It said so until somebody went to another tab and came back, by an address that left a telephone's screen."""
    from playwright.sync_api import expect

    window = open_tab(chromium, page.address, "wiring")
    state = window.locator("#state")
    expect(state).to_have_text("off", timeout=10_000)
    answer = served.answer
    served.answer = lambda request: {"ok": False, "error": "away"}  # type: ignore[method-assign]
    expect(state).to_have_text("no answer", timeout=10_000)
    window.route("**/static/tabs/recordings.js", lambda route: route.abort())
    window.get_by_role("link", name="Recordings").click()
    expect(window.locator("#tab-recordings")).to_contain_text(
        "could not be loaded. It comes by itself once the gateway"
    )
    window.set_viewport_size({"width": 390, "height": 800})
    assert window.evaluate("document.documentElement.scrollWidth") == 390
    assert "http" not in window.inner_text("#tab-recordings")
    window.unroute("**/static/tabs/recordings.js")
    served.answer = answer  # type: ignore[method-assign]
    window.get_by_role("button", name="Start recording").wait_for()
    assert "could not be loaded" not in window.inner_text("#tab-recordings")
    window.close()


def test_what_says_how_the_gateway_is_does_not_go_on_saying_it_while_that_is_away(
    page, served: ScriptedControl, chromium
) -> None:
    """The header, which stays in sight, and the browser's tab said that the force was held."""
    from playwright.sync_api import expect

    window = open_tab(chromium, page.address, "configuration")
    state = window.locator("#state")
    expect(state).to_have_text("off", timeout=10_000)
    answer = served.answer
    served.answer = lambda request: {"ok": False, "error": "away"}  # type: ignore[method-assign]
    expect(state).to_have_text("no answer", timeout=10_000)
    assert window.title().startswith("no answer")
    served.answer = answer  # type: ignore[method-assign]
    expect(state).to_have_text("off", timeout=10_000)
    assert window.title().startswith("off")
    window.close()


def test_a_page_to_which_nothing_comes_any_more_says_that_it_is_old(
    page, served: ScriptedControl, chromium, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A cable that is pulled ends no stream: a browser that only listens waits for ever, and the page said `holding`."""
    from playwright.sync_api import expect

    monkeypatch.setattr(EventSource, "_run", EventSource._tell_state)  # once, and nothing more
    window = chromium.new_page()
    window.clock.install()
    window.goto(f"{page.address}/#live")
    expect(window.locator("#state")).to_have_text("off", timeout=10_000)
    window.clock.fast_forward(5_000)
    expect(window.locator("#state")).to_have_text("no answer", timeout=10_000)
    expect(window.locator("#gone")).to_contain_text("What you see is old")
    expect(window.locator("#tab-live")).to_have_css("opacity", "0.5")
    window.clock.fast_forward(10_000)
    expect(window.locator("#state")).to_have_text("off", timeout=10_000)  # a fresh stream tells it
    assert float(window.locator("#tab-live").evaluate("(live) => getComputedStyle(live).opacity")) == 1.0
    window.close()


def test_the_age_of_a_calibration_is_told_in_the_days_that_are_known(page, served: ScriptedControl, chromium) -> None:
    """One of this minute was `6 h old`: of its date the hours of the day are no age."""
    from playwright.sync_api import expect

    answer, calibration = served.answer, {"number": 2, "name": "left cell", "kind": "stored", "age_s": None}
    served.answer = lambda request: (  # type: ignore[method-assign]
        answer(request) | ({"calibration": calibration} if request["do"] == "state" else {})
    )
    window = open_tab(chromium, page.address, "configuration")
    days = {24_000.0: ", of today", 90_000.0: ", 1 day old", 5.5 * 86_400.0: ", 5 days old", None: "", -9.0: ""}
    for number, (age_s, words) in enumerate(days.items()):
        calibration |= {"number": number, "age_s": age_s}
        expect(window.locator("#calibration")).to_contain_text(f"{number} left", timeout=10_000)
        assert window.text_content("#calibration") == f"{number} left cell, stored{words}"
    window.close()


def test_times_are_told_in_the_reader_s_zone_and_minutes_have_sixty_seconds(page, chromium) -> None:
    """Events had UTC without a word, beside recordings in local time; 119.7 s were 1 min 60 s."""
    browser = chromium.new_context(timezone_id="Europe/Berlin")
    window = open_tab(browser, page.address, "wiring")
    assert window.evaluate(TIMES) == ["11:30:05 A310 master lost", "2 min 0 s", "1 min 30 s", "1.5 h"]
    browser.close()


def test_a_diagnosis_that_has_ended_with_the_page_s_process_is_not_waited_for(page, state, chromium) -> None:
    record(state)
    jobs = iter([JOB])
    browser = chromium.new_context()
    browser.route(
        "**/api/v1/diagnosis",
        lambda route: route.fulfill(json={"job": next(jobs, None), "kept": [], "missing": ""}),
    )
    window = open_tab(browser, page.address, "diagnosis")
    window.get_by_text("has started anew, and the diagnosis has ended with it").wait_for()
    assert window.get_by_role("button", name="Cancel").count() == 0
    browser.close()


def test_a_page_whose_login_is_over_leads_to_the_login(page, chromium) -> None:
    """It said for ever that it tried again by itself."""
    over = {"status": 401, "content_type": "application/json", "body": json.dumps({"error": "", "reason": "login"})}
    browser = chromium.new_context()
    for address in ("**/events?*", "**/api/v1/session"):
        browser.route(address, lambda route: route.fulfill(**over))
    window = open_tab(browser, page.address, "configuration")
    window.wait_for_url("**/login")
    assert window.get_by_role("button", name="Log in").count() == 1
    browser.close()


def test_a_recording_that_waits_for_room_is_told_as_one(page, chromium) -> None:
    """As `record status` does. It looked as if nobody had asked for one."""
    waits = {"recording": None, "waits": "the disk is full"}
    browser = chromium.new_context()
    browser.route(
        "**/api/v1/recordings",
        lambda route: route.fulfill(json={"recordings": [], "recording": waits, "no_parquet": ""}),
    )
    window = open_tab(browser, page.address, "recordings")
    window.get_by_text("not recording: the disk is full; it begins again by itself").wait_for()
    assert window.get_by_role("button", name="Start recording").is_enabled()
    browser.close()
