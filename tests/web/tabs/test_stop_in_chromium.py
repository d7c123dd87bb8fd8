"""Esc stops the force wherever the cursor is: also where somebody has clicked in a report that the page shows."""

from typing import Any

import pytest

from tests.web.tabs.conftest import record
from tests.web.tabs.scripted_control import ScriptedControl
from tests.web.tabs.test_many_tabs_in_chromium import STOP, modbus, written
from tests.web.tabs.test_tabs_in_chromium import open_tab


@pytest.fixture
def gateway(control: ScriptedControl) -> ScriptedControl:
    """A gateway that takes every write."""
    answer = control.answer

    def answer_all(request: dict[str, Any]) -> dict[str, Any]:
        told = answer(request)
        return modbus(request) if request["do"] == "modbus" else told

    control.answer = answer_all  # type: ignore[method-assign]
    return control


def test_esc_stops_also_behind_a_click_in_a_report(page, gateway: ScriptedControl, state, chromium) -> None:
    """The frame, which runs no script, kept the key for itself."""
    from playwright.sync_api import expect

    record(state)
    window = open_tab(chromium, page.address, "recordings")
    window.get_by_role("button", name="Plot recording 1").click()
    window.frame_locator("iframe").locator("h1").click()
    window.keyboard.press("Escape")
    expect(window.locator("#said")).to_have_text("Stopped: the safe voltage is out.", timeout=10_000)
    assert written(gateway) == [STOP]
    window.close()
