"""The tabs in a real browser: a wizard's run to its result with a reload in the middle, and a diagnosis to its report."""

import json
from pathlib import Path
from typing import Any

import pytest

from tests.end_to_end.conftest import start, stop
from tests.web.tabs.conftest import record
from tests.web.tabs.scripted_control import IDLE

CALIBRATION_IN_USE = 122
FIT = {
    "fits": [
        {
            "model": "bsfm", "order": 1, "coefficients": 4, "rms_n": 0.4, "max_n": 0.8, "heldout_rms_n": 0.5,
            "heldout_error_n": 0.1, "usable": True, "chosen": True, "verdicts": [],
        }
    ],
    "chosen": {"model": "bsfm", "order": 1, "force_range_n": [1.0, 58.9]},
    "measured": {"rms_n": 0.06, "max_n": 0.24, "points": 36, "in_use": 1, "in_use_rms_n": 0.08},
    "notes": ["one group only"],
    "calibration": 2,
}  # fmt: skip


SECOND_COLUMN = """() => {
  const table = document.createElement("table");
  table.className = "registers";
  table.innerHTML = "<tbody><tr><td>40001</td><td>0</td></tr></tbody>";
  document.body.append(table);
  return getComputedStyle(table.querySelector("td:nth-child(2)")).display;
}"""


def open_tab(browser: Any, address: str, tab: str) -> Any:
    """A tab of the page; what its scripts complain about fails the test."""
    window = browser.new_page()
    window.on("pageerror", lambda error: pytest.fail(str(error)))
    window.set_default_timeout(20_000)
    window.goto(f"{address}/#{tab}")
    return window


def lead_to_the_run(window: Any) -> None:
    window.get_by_role("button", name="Continue").click()
    start_button = window.get_by_role("button", name="Start the run")
    start_button.wait_for()
    boxes = window.locator(".checks input")
    for place in range(boxes.count()):
        assert start_button.is_disabled()  # until every question is answered
        boxes.nth(place).check()
    start_button.click()
    window.get_by_role("button", name="Stop the run").wait_for()


def test_the_badge_names_the_run_that_has_the_output(page, served, chromium) -> None:
    """It read `calibrating` while the self-test pressed that somebody had started."""
    window = open_tab(chromium, page.address, "wiring")
    for phase, badge in (("self_test", "self-test"), ("experiment", "experiment"), ("ladder", "calibrating")):
        served.status = served.status | {"running": True, "phase": phase}
        window.locator("#state.warn").get_by_text(badge, exact=True).wait_for()
        assert window.title() == f"{badge} · demo · force-gateway"
    window.close()


def test_a_reload_in_the_middle_of_a_run_loses_nothing(page, control, state, chromium) -> None:
    (state / "calibrations").mkdir()
    (state / "calibrations" / "0002.json").write_text(json.dumps(FIT))
    (state / "calibrations" / "0002.html").write_text("<!doctype html><title>report</title><h1>The report itself</h1>")
    window = open_tab(chromium, page.address, "calibrate")
    window.get_by_label("What to call it").fill("first")
    lead_to_the_run(window)
    assert control.asked[-1]["do"] in ("calibrate", "state")
    begun = next(request for request in control.asked if request.get("plan") and not request.get("dry_run"))
    assert (begun["name"], begun["plan"]["step_v"]) == ("first", 0.5)
    control.status = control.status | {"progress": 0.42, "force_n": 31.5, "eta_s": 20.0}
    window.reload()
    window.get_by_text("42 %").wait_for()
    window.get_by_text("31.50").wait_for()
    control.status = IDLE | {"phase": "stored", "result": {"stored": 2, "document": "0002.json"}}
    window.get_by_text("Calibration 2 is stored, not yet in use").wait_for()
    assert window.get_by_role("button", name="Use calibration 2").is_enabled()
    assert "0.060 N RMS" in window.locator("#tab-calibrate").inner_text()
    window.frame_locator("iframe").get_by_text("The report itself").wait_for()
    window.close()


def test_a_run_whose_gateway_has_started_anew_is_told_as_ended(page, control, chromium) -> None:
    """It was shown as starting for as long as the page was open."""
    window = open_tab(chromium, page.address, "calibrate")
    lead_to_the_run(window)
    window.get_by_text("Ladder").wait_for()
    control.status = dict(IDLE)
    window.get_by_text("A401 The gateway has started anew").wait_for()
    window.get_by_role("button", name="Continue").wait_for()
    assert window.get_by_role("button", name="Stop the run").count() == 0
    window.close()


def test_who_skips_to_the_content_stays_in_the_tab(page, chromium) -> None:
    """It led to the live view."""
    from playwright.sync_api import expect

    window = open_tab(chromium, page.address, "configuration")
    window.locator(".skip").focus()
    window.keyboard.press("Enter")
    expect(window.locator("#main")).to_be_focused()
    expect(window.locator("#tab-configuration")).to_be_visible()
    assert window.evaluate("location.hash") == "#configuration"
    window.close()


@pytest.mark.long
def test_no_tab_is_wider_than_a_telephone_or_grave_for_a_screen_reader(page, control, state, chromium) -> None:
    from axe_playwright_python.sync_playwright import Axe

    record(state)
    window = open_tab(chromium, page.address, "calibrate")
    window.set_viewport_size({"width": 400, "height": 800})
    for tab, words in (
        ("calibrate", "Continue"),
        ("recordings", "Parquet"),
        ("calibrations", "rig's own"),
        ("diagnosis", "Keep what it finds"),
        ("wiring", "Wiring of rig demo"),
        ("configuration", "demo.yaml:"),
    ):
        window.goto(f"{page.address}/#{tab}")
        window.locator(f"#tab-{tab}").get_by_text(words).first.wait_for()
        assert window.evaluate("document.documentElement.scrollWidth") <= 400, tab
        found = Axe().run(window, context=f"#tab-{tab}").response["violations"]
        grave = [(one["id"], one["nodes"][0]["html"]) for one in found if one["impact"] in ("serious", "critical")]
        assert not grave, (tab, grave)
    window.close()


@pytest.mark.long
def test_on_the_simulated_rig_a_run_is_stored_used_and_diagnosed(tmp_path: Path, chromium) -> None:
    gateway = start(tmp_path / "state", "--sim", "--web", "127.0.0.1:0")
    try:
        host, port = gateway.ready["web"]
        window = open_tab(chromium, f"http://{host}:{port}", "calibrate")
        window.get_by_text("Set the height of a stair").click()
        for label, value in (("Stair (V)", "1"), ("Groups", "1"), ("Points of reversals", "13"), ("Large steps", "2")):
            window.get_by_label(label, exact=True).fill(value)
        lead_to_the_run(window)
        window.get_by_text("Ladder", exact=False).first.wait_for()
        window.reload()
        window.get_by_role("button", name="Stop the run").wait_for()
        use = window.get_by_role("button", name="Use calibration 2")
        use.wait_for(timeout=120_000)
        use.click()
        window.get_by_text("calibration 2").and_(window.locator(".told.good")).wait_for()
        window.goto(f"http://{host}:{port}/#recordings")
        window.get_by_role("button", name="Diagnose recording 1").click()
        window.frame_locator("iframe[title^='Diagnosis']").locator("h1").wait_for(timeout=120_000)
        window.close()
        gateway.client.close()  # which has asked nothing for most of a minute, and may have been hung up on
        assert gateway.client.connect()
        assert gateway.words(CALIBRATION_IN_USE, 1) == [2]
    finally:
        stop(gateway)


def test_on_a_narrow_screen_no_label_runs_into_its_value_and_the_open_tab_is_in_sight(page, state, chromium) -> None:
    """`what happened` stood across what had happened, and Diagnosis was behind the edge."""
    record(state)
    window = open_tab(chromium, page.address, "recordings")
    window.set_viewport_size({"width": 360, "height": 740})
    cell = window.locator("td[data-label='what happened']")
    cell.wait_for()
    assert cell.evaluate("(cell) => getComputedStyle(cell).whiteSpace") == "normal"
    for name in ("Configuration", "Live"):
        window.evaluate(f"location.hash = '#{name.lower()}'")
        window.locator(f"#tab-{name.lower()}:not([hidden])").wait_for()
        link = window.get_by_role("link", name=name, exact=True).bounding_box()
        assert link["x"] >= 0.0 and link["x"] + link["width"] <= 360.0
    assert window.evaluate(SECOND_COLUMN) == "none"  # of the registers: their values stand behind the edge otherwise
    window.close()


def test_an_unreadable_recording_has_no_time_and_no_duration(page, state, chromium) -> None:
    """It began on Jan 1, 1970, and lasted 0.0 s."""
    folder = record(state).parent
    (folder / "0002.fgr").write_bytes(b"junk")
    window = open_tab(chromium, page.address, "recordings")
    row = window.locator("tr", has_text="unreadable: ")
    row.wait_for()
    assert [row.locator(f"td[data-label={name}]").inner_text() for name in ("started", "duration")] == ["–", "–"]
    window.close()


def test_what_a_diagnosis_finds_is_kept_as_a_plant_where_that_is_asked_for_and_else_not(page, state, chromium) -> None:
    record(state)
    window, asked = open_tab(chromium, page.address, "diagnosis"), list[bool]()

    def answer(route: Any) -> None:
        asked.append(route.request.post_data_json["keep_plant"])
        route.fulfill(status=409, json={"error": f"seen {len(asked)}"})

    window.route("**/api/v1/diagnosis/begin", answer)
    begin = window.get_by_role("button", name="Diagnose", exact=True)
    begin.click()
    window.get_by_text("seen 1").wait_for()
    window.get_by_label("Keep what it finds as a numbered plant").check()
    begin.click()
    window.get_by_text("seen 2").wait_for()
    assert asked == [False, True]
    window.close()


def test_a_table_that_is_wider_than_a_tablet_scrolls_within_itself(page, state, chromium) -> None:
    """The page was 43 px too wide beside the calibrations: the unseen head of their buttons stood beyond its edge."""
    window = open_tab(chromium, page.address, "calibrations")
    window.set_viewport_size({"width": 768, "height": 900})
    window.locator("#tab-calibrations tbody tr").first.wait_for()
    window.add_style_tag(content="#tab-calibrations td { min-width: 12rem; }")
    seen = window.locator("#tab-calibrations .wide").first.evaluate("box => [box.scrollWidth, box.clientWidth]")
    assert seen[0] > seen[1], "the table fits, and proves nothing"
    assert window.evaluate("document.documentElement.scrollWidth") <= 768
    window.close()


def test_no_value_of_the_configuration_stands_in_a_column_of_single_letters(page, state, chromium) -> None:
    """On a telephone, a tablet and at 200 % it did; 640: 1280 at 200 %."""
    window = open_tab(chromium, page.address, "configuration")
    window.wait_for_selector("table.values td")
    for width in (360, 640, 768):
        window.set_viewport_size({"width": width, "height": 740})
        heights = window.eval_on_selector_all(
            "table.values td:nth-child(2)", "cells => cells.map((cell) => cell.getBoundingClientRect().height)"
        )
        assert 0.0 < max(heights) < 120.0, (width, sorted(heights)[-3:])
        assert window.evaluate("document.documentElement.scrollWidth") <= width
    window.close()
