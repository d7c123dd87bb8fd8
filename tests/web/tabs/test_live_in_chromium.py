"""What the live tab makes of what it is told: figures of loop and lines, samples that overlap, and what Enable asks for."""

from dataclasses import replace
from typing import Any

from gateway.live.live_state import LiveForce, LiveLine, LiveLoop, LiveState
from tests.web.tabs.test_tabs_in_chromium import open_tab

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


def test_figures_samples_and_commands_are_those_that_were_told(page, chromium) -> None:
    """A line whose messages are all heard was 99 % garbled, and Set beside another's force was refused as a setpoint."""
    own = LiveState(
        rig="demo", simulated=True, version="0", time_unix_s=0.0, state="holding", status=("enabled",), owner="web",
        loop=LiveLoop(hz=100.0, ticks=800, missed=4, late_p50_us=60, late_p99_us=12_000, step_us=250.0),
        output=LiveLine(device="itv", heard=99, garbled=1, age_s=0.01), load_cell=LiveLine(device="cell"),
        force=LiveForce(requested_n=12.0),
    )  # fmt: skip
    browser = chromium.new_context()
    browser.route("**/events?*", lambda route: route.abort())
    window: Any = open_tab(browser, page.address, "wiring")
    told = window.evaluate(TOLD, {"own": own.to_json(), "others": replace(own, owner="10.0.0.5").to_json()})
    assert told["rows"] == [
        ["Loop", "100 Hz, 0.25 ms of work"],
        ["Lateness", "half under 0.06 ms, 99 % under 12 ms"],
        ["Missed ticks", "4 of 800 (0.500 %)"],
        ["Output, itv", "answers; 99 heard, 1 garbled (1.00 %)"],
        ["Load cell, cell", "never heard; 0 heard, 0 garbled (0.00 %)"],
    ]
    assert told["columns"] == {"time_s": [1, 2, 3, 4], "force_n": [10, 20, 30, 40]}
    assert told["asked"] == ["setpoint", "enable"]
    browser.close()
