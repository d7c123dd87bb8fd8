"""What the live view says of now: alarms and how long they stand, what was done, and a trend that shows what was measured, of a
tool that pulls, too: forces as the cell reads them, and the setpoint and the error beside them."""

from dataclasses import replace
from typing import Any

from gateway.live.live_state import LiveAlarm, LiveResidual, LiveState

SAID = """async () => {
  const { api } = await import("/static/api.js");
  const said = document.getElementById("said");
  const timers = new Map();
  window.setTimeout = (done, after_ms) => { timers.set(timers.size + 1, [done, after_ms]); return timers.size; };
  window.clearTimeout = (number) => timers.delete(number);
  const later = (after_ms) => {
    for (const [number, [done, due_ms]] of timers) if (due_ms <= after_ms) { timers.delete(number); done(); }
    return said.textContent;
  };
  api.say("Enabled with 12.00 N.");
  const told = [later(9000), later(10000)];
  api.say("Recording.");
  api.say("W204 out of range", true);
  told.push(later(60000));
  api.say("mbpoll -1", false, true);
  return [...told, later(60000)];
}"""

ALARMS = """async (states) => {
  const { makeAlarms } = await import("/static/live/health.js");
  const alarms = makeAlarms({ on: () => {}, post: async () => ({}), say: () => {} });
  document.body.append(alarms.element);
  const told = [];
  let pressed = null;
  for (const state of states) {
    alarms.state(state);
    const button = alarms.element.querySelector("button");
    if (pressed === null) (pressed = button).focus();
    told.push([Array.from(alarms.element.querySelectorAll("li p.small"), (age) => age.textContent), button === pressed]);
  }
  return { told, focused: document.activeElement.tagName };
}"""

BLOCKED = """async (state) => {
  const { makeSteering } = await import("/static/live/steering.js");
  const steering = makeSteering({});
  steering.state(state);
  return steering.element.querySelector(".warn-text").textContent;
}"""

TREND = """async () => {
  const { Plot, colour } = await import("/static/live/plots.js");
  const { makeTrend } = await import("/static/live/trend.js");
  const time_s = [];
  for (let at_s = 80; at_s < 110; at_s += 0.05) if (at_s < 93 || at_s > 98) time_s.push(at_s);
  const all = (value) => time_s.map(() => value);
  const columns = { time_s, force_n: all(11.3), setpoint_n: all(11.3), pulling: all(0) };
  const marks = [{ unix_s: 109.8, severity: "warning", code: "W210" }];
  let plot = null, word = null;
  const fit = Plot.prototype.fit;
  Plot.prototype.fit = function () { fit.call(this); plot = this; };
  const fillText = CanvasRenderingContext2D.prototype.fillText;
  CanvasRenderingContext2D.prototype.fillText = function (text, x, ...more) {
    if (text === "W210") word = { x, width: this.measureText(text).width };
    fillText.call(this, text, x, ...more);
  };
  const trend = makeTrend({ columns, now_s: 110, offset_s: 0, marks });
  document.body.append(trend.element);
  trend.draw();
  await new Promise(requestAnimationFrame);
  const chart = plot.chart, context = chart.ctx;
  const at = (value, scale) => Math.round(chart.valToPos(value, scale, true));
  const row = (from_s, to_s) => {
    const { data } = context.getImageData(at(from_s, "x"), at(11.3, "y"), at(to_s, "x") - at(from_s, "x"), 1);
    return Array.from({ length: data.length / 4 }, (_, place) => Array.from(data.slice(4 * place, 4 * place + 4)));
  };
  context.fillStyle = colour("rising");
  const wanted = [1, 3, 5].map((place) => parseInt(context.fillStyle.slice(place, place + 2), 16));
  return { wanted, held: row(81, 89), silent: row(94, 97), word, line: chart.valToPos(109.8, "x", true) };
}"""


UNREACHED = """async () => {
  const { api } = await import("/static/api.js");
  const told = [];
  for (const ask of [() => api.get("/api/v1/state"), () => api.post("/api/v1/command/stop")]) {
    await ask().catch((error) => told.push(error.message));
  }
  return told;
}"""

PULLED = """async () => {
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


def state(**facts: Any) -> LiveState:
    return LiveState(
        **({"rig": "demo", "simulated": True, "version": "0", "time_unix_s": 100.0, "state": "fault"} | facts)
    )


def test_what_was_done_is_said_for_a_while_and_what_went_wrong_until_the_next(window) -> None:
    """`Enabled with 12.00 N.` stood beside a fault, and `Stopped: the safe voltage is out.` beside another's force."""
    assert window.evaluate(SAID) == ["Enabled with 12.00 N.", "", "W204 out of range", "mbpoll -1"]


def test_an_alarm_says_how_long_it_stands_and_the_keyboard_stays_beside_it(quiet) -> None:
    """For ten seconds it stood `for 0 s`; behind a reset the focus was nowhere, and Tab began at the top."""
    silent = LiveAlarm(code="A311", title="no fresh force sample", cure="Look.", since_unix_s=98.0)
    states = [state(faults=(silent,)), state(faults=(silent,), time_unix_s=103.5), state(state="off")]
    seen = quiet.evaluate(ALARMS, [one.to_json() for one in states])
    assert seen["told"] == [[["for 2 s"], True], [["for 5 s"], True], [[], False]]
    assert seen["focused"] == "OL"


ACKNOWLEDGED = """async (state) => {
  const { makeAlarms } = await import("/static/live/health.js");
  const asked = [];
  const alarms = makeAlarms({ on: () => {}, say: () => {}, post: async (path) => asked.push(path) });
  alarms.state(state);
  for (const button of alarms.element.querySelectorAll("button")) button.click();
  return asked;
}"""


WATCHED = """async (states) => {
  const { makeAlarms } = await import("/static/live/health.js");
  const alarms = makeAlarms({ on: () => {} });
  return states.map((state) => (alarms.state(state), alarms.element.querySelector(":scope > p:last-of-type").textContent));
}"""


def test_the_watch_says_what_differs_or_why_it_does_not_judge(quiet) -> None:
    """Beside a rig at rest an empty line could mean that all is well."""
    told = [LiveResidual(), LiveResidual(why_skipped="nothing was commanded")]
    told.append(replace(told[1], sentence="friction has doubled"))
    assert quiet.evaluate(WATCHED, [state(residual=one).to_json() for one in told]) == [
        "",
        "Residual watch: not judged: nothing was commanded",
        "Residual watch: friction has doubled",
    ]


def test_to_acknowledge_a_fault_resets_it_and_a_warning_needs_none(quiet) -> None:
    silent = LiveAlarm(code="A311", title="no fresh force sample", cure="Look.", since_unix_s=98.0)
    warned = state(faults=(silent,), warnings=(replace(silent, code="A342"),))
    assert quiet.evaluate(ACKNOWLEDGED, warned.to_json()) == ["/api/v1/command/reset"]


def test_a_fault_is_answered_on_the_page_by_the_pages_own_button(quiet) -> None:
    """Beside `Acknowledge and reset` it said `write force_setpoint 0, then raise control_word bit 1`."""
    silent = LiveAlarm(code="A311", title="no fresh force sample", cure="Look.", since_unix_s=98.0)
    blocked = state(faults=(silent,), enable_block="W212 a fault is latched: raise control_word bit 1")
    assert quiet.evaluate(BLOCKED, blocked.to_json()).endswith("acknowledge and reset it under Alarms.")
    other = replace(blocked, faults=(), state="off", enable_block="W213 the cell is silent")
    assert quiet.evaluate(BLOCKED, other.to_json()) == "W213 the cell is silent"


def test_a_trend_shows_the_setpoint_of_a_force_that_is_held_and_nothing_where_nobody_measured(quiet) -> None:
    """The one was hidden behind the other; across a silence of the cell went a straight line of forces."""
    drawn = quiet.evaluate(TREND)
    assert drawn["wanted"] in [pixel[:3] for pixel in drawn["held"]]
    assert {pixel[3] for pixel in drawn["silent"]} == {0}
    assert drawn["word"]["x"] + drawn["word"]["width"] < drawn["line"], "a code is beside its own line, not across it"


def test_a_gateway_that_is_away_is_told_in_our_words(window) -> None:
    """Stop said `Not stopped from here: Failed to fetch`, and each tab `Failed to fetch` alone."""
    window.context.route("**/api/v1/**", lambda route: route.abort())
    assert window.evaluate(UNREACHED) == ["no answer from the gateway"] * 2


def test_setpoint_error_and_range_go_with_the_pull(quiet) -> None:
    """Its trend stood still while a tool pulled, for the ring held no row of it."""
    drawn = quiet.evaluate(PULLED)
    assert (drawn["low"], drawn["wanted"], drawn["high"]) == (-13.0, -12.0, -11.0)
    assert (drawn["force"], drawn["pushed"]) == (-11.8, 12.0)
    assert drawn["error"] == "RMS 0.16 N rising, last minute."
    assert drawn["least"] == -15.0
    assert drawn["units"] == ["N measured", "N, pulling", "N, −measured − setpoint", "V"]  # -14.91, 15.00, -0.09
    assert drawn["model"] == "The tool pulls; the model drawn is that of pushing."
