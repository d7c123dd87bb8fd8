"""The big figures of the page and its trend: they say what is measured now, also where no sample of the ring comes."""

import time
from dataclasses import replace
from typing import Any

import pytest

from gateway.live.live_state import LiveForce, LiveLine, LiveLoop, LiveRecording, LiveState
from tests.web.tabs.in_chromium.test_tabs_in_chromium import open_tab
from tests.web.tabs.scripted_control import ScriptedControl

FIGURES = """async (state) => {
  const { makeSteering } = await import("/static/live/steering.js");
  const steering = makeSteering({});
  steering.samples({ force_n: [12.0] });
  steering.state(state);
  const shown = () => Array.from(steering.element.querySelectorAll("dd:not(.unit)"), (figure) => figure.textContent);
  const told = [shown()];
  steering.samples({ force_n: [12.5] });
  return [...told, shown()];
}"""

SILENCE = """async () => {
  const { samples } = await import("/static/live/samples.js");
  const told = [];
  for (const clock_s of [100.4, 129.0]) {
    if (!samples.time.length) samples.append({ time_s: [99.0, 100.0], force_n: [12.0, 12.0] });
    samples.align({ time_unix_s: 5000.0 + clock_s, clock_s });
    told.push([samples.now_s, samples.isFresh, samples.offset_s]);
  }
  return told;
}"""


@pytest.mark.parametrize(
    ("status", "measured_n", "force", "error"),
    [
        (("enabled",), 11.98, "11.98", "-0.02"),
        (("enabled", "pulling"), -11.98, "-11.98", "-0.02"),
        (("enabled",), None, "–", "–"),
    ],
    ids=["pushing", "pulling", "no sample"],
)
def test_the_force_is_that_of_now_and_the_error_of_a_pull_is_that_of_a_push(
    quiet: Any, status: tuple[str, ...], measured_n: float | None, force: str, error: str
) -> None:
    """Of a cell that is silent the ring holds no sample: the last one is old."""
    force_state = LiveForce(requested_n=12.0, measured_n=measured_n, voltage_v=1.5)
    base = LiveState(rig="demo", simulated=True, version="0", time_unix_s=0.0, state="holding")
    shown, _ = quiet.evaluate(FIGURES, replace(base, status=status, force=force_state).to_json())
    assert shown == [force, "12.00", error, "1.500"]


def test_the_error_is_that_of_the_force_beside_it(quiet: Any) -> None:
    """Samples come 15 times a second, a state twice: 14.81 N beside a setpoint of 15 N had an error of +0.10 N."""
    force_state = LiveForce(requested_n=12.0, measured_n=11.98, voltage_v=1.5)
    base = LiveState(rig="demo", simulated=True, version="0", time_unix_s=0.0, state="holding")
    _, shown = quiet.evaluate(FIGURES, replace(base, status=("enabled",), force=force_state).to_json())
    assert shown == ["12.50", "12.00", "0.50", "1.500"]


def test_time_goes_on_on_the_page_where_no_sample_comes(window: Any) -> None:
    """Of a silent cell the trend showed its last force as that of now, the fault that it was ahead of it, and the loop's
    green point stood at a force that nobody measured."""
    assert window.evaluate(SILENCE) == [[100.4, True, 5000.0], [129.0, False, 5000.0]]


NO_FORCE = "A force in newtons, such as 12.5."
TYPED = (
    ("1,5", 1.5, "Enabled with 1.50 N."),
    (" 12.5 ", 12.5, "Enabled with 12.50 N."),
    ("1,500.0", None, NO_FORCE),
    ("12 N", None, NO_FORCE),
    ("", None, NO_FORCE),
)


def test_a_force_is_the_one_that_was_typed(page, chromium) -> None:
    """The field dropped a comma as it was typed: who wanted 1,5 N pressed with 15 N."""
    window: Any = open_tab(chromium, page.address, "live")
    asked: list[Any] = []

    def answer(route: Any) -> None:
        asked.append(route.request.post_data_json)
        route.fulfill(json={})

    window.route("**/api/v1/command/enable", answer)
    field = window.get_by_label("Setpoint, N")
    for typed, force_n, said in TYPED:
        window.evaluate("() => { document.getElementById('said').textContent = ''; }")
        field.select_text()
        window.keyboard.type(typed) if typed else field.press("Delete")
        field.press("Enter")
        window.locator("#said").get_by_text(said).wait_for()
        assert asked == ([] if force_n is None else [{"force_n": force_n}]), typed
        asked.clear()
    window.close()


def test_a_plan_of_ones_own_takes_numbers_as_they_are_typed_and_no_others(page, served, chromium) -> None:
    window: Any = open_tab(chromium, page.address, "calibrate")
    asked: list[Any] = []

    def answer(route: Any) -> None:
        asked.append(route.request.post_data_json["plan"])
        route.fulfill(status=409, json={"error": "seen"})

    window.route("**/api/v1/calibrate/preview", answer)
    window.get_by_text("Set the height of a stair").click()
    stair, go = window.get_by_label("Stair (V)", exact=True), window.get_by_role("button", name="Continue")
    stair.select_text()
    window.keyboard.type("0,05")
    go.click()
    window.locator("#tab-calibrate .told.bad").get_by_text("seen").wait_for()
    stair.fill("")
    go.click()
    window.locator("#tab-calibrate .told.bad").get_by_text("Stair (V): a number, such as 0.2.").wait_for()
    assert [plan["step_v"] for plan in asked] == [0.05]
    stair.fill("0.1")
    window.get_by_label("Take the force at rest as zero first").check()
    with window.expect_response("**/api/v1/calibrate/preview"):
        go.click()
    assert [(plan["step_v"], plan.get("tare", False)) for plan in asked] == [(0.05, False), (0.1, True)]
    window.close()


def test_a_command_says_by_the_gateways_clock_when_it_is_asked(page, served: ScriptedControl, chromium) -> None:
    """A line that had held an enable up brought it when the page had given it up, and the tool pressed."""
    window = open_tab(chromium.new_context(), page.address, "live")
    enable = """async () => {
      const { api } = await import("/static/api.js");
      await new Promise((told) => api.on("state", told));
      await api.post("/api/v1/command/enable", { force_n: 12 }).catch(() => {});
    }"""
    began_s = time.monotonic()
    with window.expect_request("**/api/v1/command/enable") as request:
        window.evaluate(enable)
    asked_s = float(request.value.headers["x-asked-s"])
    assert began_s - 5.0 < asked_s <= time.monotonic() + 0.1
    asked = [one["pdu"] for one in served.asked if one["do"] == "modbus" and one["pdu"].startswith("10")]
    assert len(asked) == 1, "in time it is carried out"


TOLD = """async ({ own, others }) => {
  const { makeHealth } = await import("/static/live/health.js");
  const { makeSteering } = await import("/static/live/steering.js");
  const { samples } = await import("/static/live/samples.js");
  const health = makeHealth();
  health.state(own);
  const rows = Array.from(health.element.querySelectorAll("tr"), (row) => Array.from(row.children, (cell) => cell.textContent));
  samples.replace({ time_s: [1, 2, 3], force_n: [10, 20, 30] });
  samples.append({ time_s: [2, 3, 4], force_n: [20, 30, 40] });
  samples.append({ time_s: [3, 4], force_n: [30, 40] });
  const asked = [];
  const steering = makeSteering({ post: async (path) => asked.push(path.split("/").pop()), say: () => {} });
  document.body.append(steering.element);
  for (const state of [own, others]) {
    steering.state(state);
    steering.element.querySelector("form").requestSubmit();
  }
  return { rows, columns: samples.columns, asked };
}"""


def test_figures_samples_and_commands_are_those_that_were_told(quiet: Any) -> None:
    """A line whose messages are all heard was 99 % garbled, and Set beside another's force was refused as a setpoint."""
    own = LiveState(
        rig="demo", simulated=True, version="0", time_unix_s=0.0, state="holding", status=("enabled",), owner="web",
        loop=LiveLoop(hz=100.0, ticks=800, missed=4, late_p50_us=60, late_p99_us=12_000, step_us=250.0),
        output=LiveLine(device="itv", heard=99, garbled=1, age_s=0.01), load_cell=LiveLine(device="cell"),
        valve=LiveLine(device="relay", heard=7, age_s=2.5),
        force=LiveForce(requested_n=12.0),
    )  # fmt: skip
    told = quiet.evaluate(TOLD, {"own": own.to_json(), "others": replace(own, owner="10.0.0.5").to_json()})
    assert told["rows"] == [
        ["Loop", "100 Hz, 0.25 ms of work"],
        ["Lateness", "half under 0.06 ms, 99 % under 12 ms"],
        ["Missed ticks", "4 of 800 (0.500 %)"],
        ["Output, itv", "answers; 99 heard, 1 garbled (1.00 %)"],
        ["Load cell, cell", "never heard; 0 heard, 0 garbled (0.00 %)"],
        ["Valve, relay", "silent for 2 s; 7 heard, 0 garbled (0.00 %)"],
    ]
    assert told["columns"] == {"time_s": [1, 2, 3, 4], "force_n": [10, 20, 30, 40]}
    assert told["asked"] == ["setpoint", "enable"]


RECORD = """async (states) => {
  const { makeSteering } = await import("/static/live/steering.js");
  const asked = [];
  const steering = makeSteering({ post: async (path, body) => asked.push([path, body]), say: () => {} });
  for (const state of states) {
    steering.state(state);
    const words = state.recording.on ? "Stop recording" : "Record";
    Array.from(steering.element.querySelectorAll("button")).find((one) => one.textContent === words).click();
  }
  return asked;
}"""


def test_the_button_of_a_recording_does_what_it_says(quiet: Any) -> None:
    """One that asked for a recording under way once more would never have ended it."""
    base = LiveState(rig="demo", simulated=True, version="0", time_unix_s=0.0, state="off")
    states = [base, replace(base, recording=LiveRecording(on=True, number=1))]
    asked = quiet.evaluate(RECORD, [each.to_json() for each in states])
    assert asked == [["/api/v1/command/record", {"on": True}], ["/api/v1/command/record", {"on": False}]]
