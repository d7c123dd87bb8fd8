"""What the page draws of a tool that pulls: forces as the cell reads them, and the setpoint and the error beside them."""

from typing import Any

from tests.web.tabs.in_chromium.test_tabs_in_chromium import open_tab

DRAWN = """async () => {
  const { Plot } = await import("/static/live/plots.js");
  const { makeTrend } = await import("/static/live/trend.js");
  const { makeError } = await import("/static/live/error.js");
  const { makeLoop } = await import("/static/live/loop.js");
  const { makeSteering } = await import("/static/live/steering.js");
  const time_s = Array.from({ length: 200 }, (_, place) => 100 + place / 20);
  const column = (push, pull) => time_s.map((at_s) => (at_s < 105 ? push : pull));
  const columns = {
    time_s, force_n: column(12.1, -11.8), setpoint_n: column(12, 12), applied_n: column(12, 12),
    command_v: column(1.5, 2.0), state: column(3, 3), pulling: column(0, 1),
  };
  const samples = { columns, now_s: 110, isFresh: true, offset_s: null, marks: [] };
  const plots = [];
  const fit = Plot.prototype.fit;
  Plot.prototype.fit = function () { fit.call(this); if (!plots.includes(this)) plots.push(this); };
  const made = [makeTrend(samples), makeError(samples), makeLoop(samples, {})];
  for (const one of made) { document.body.append(one.element); one.draw(); }
  await new Promise(requestAnimationFrame);
  made[1].state();
  const status = ["enabled", "pulling"], force_v = { voltage_v: null, measured_n: null };
  const state = { status, calibration: {}, plant: {}, force: force_v, limits: {}, faults: [], recording: {} };
  made[2].state(state);
  const steering = makeSteering({});
  steering.state(state);
  const units = Array.from(steering.element.querySelectorAll(".unit"), (unit) => unit.textContent);
  const model = made[2].element.querySelector("p.small").textContent;
  const [, low, high, force, wanted] = plots[0].chart.data.map((values) => values.at(-1));
  const error = made[1].element.querySelector("p.small").textContent;
  const least = plots[2].chart.scales.y.min;
  return { low, high, wanted, force, pushed: plots[0].chart.data[4][0], error, least, units, model };
}"""


def test_setpoint_error_and_range_go_with_the_pull(page, chromium) -> None:
    """Its trend stood still while a tool pulled, for the ring held no row of it."""
    browser = chromium.new_context()
    browser.route("**/events?*", lambda route: route.abort())
    window: Any = open_tab(browser, page.address, "wiring")
    drawn = window.evaluate(DRAWN)
    assert (drawn["low"], drawn["wanted"], drawn["high"]) == (-13.0, -12.0, -11.0)
    assert (drawn["force"], drawn["pushed"]) == (-11.8, 12.0)
    assert drawn["error"] == "RMS 0.16 N rising, last minute."
    assert drawn["least"] == -15.0
    assert drawn["units"] == ["N measured", "N, pulling", "N, −measured − setpoint", "V"]  # -14.91, 15.00, -0.09
    assert drawn["model"] == "The tool pulls; the model drawn is that of pushing."
    browser.close()
