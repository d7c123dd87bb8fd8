"""The figures of the page: of the live view, of which samples they are, at which time, and how they are counted; the register
table says what stands there as `force-gateway read` does, and reads it with mbpoll."""

import struct
from dataclasses import replace
from typing import Any

import pytest

from gateway.live.live_state import LiveAlarm, LiveLine, LiveLoop, LiveState
from gateway.registers.writes.ownership import NOT_IPV4
from gateway.web.register_table import register_table
from tests.service.rigs import demo

SAMPLES = """async () => {
  const { samples } = await import("/static/live/samples.js");
  const made = () => new samples.constructor();
  const rows = (from_s, to_s, force_n) => {
    const time_s = [];
    for (let at = from_s; at < to_s; at += 1) time_s.push(at);
    return { time_s, force_n: time_s.map(() => force_n) };
  };
  const told = {};
  const one = made();
  told.empty = one.isFresh;
  one.append(rows(100, 103, 5));
  one.align({ time_unix_s: 1000, clock_s: 102.5 });
  told.fresh = [one.isFresh, one.now_s, one.offset_s];
  one.align({ time_unix_s: 1004, clock_s: 106.5 });
  told.old = [one.isFresh, one.now_s, one.offset_s];
  one.append(rows(101, 105, 6));
  told.joined = [one.columns.time_s, one.columns.force_n];
  one.append(rows(3, 5, 7));
  told.other = [one.columns.time_s, one.columns.force_n];
  const long = made();
  for (let at = 0; at < 2000; at += 10) long.append(rows(at, at + 10, at));
  told.long = [long.time.length, long.columns.force_n.length, long.newest_s, long.time[0] > 1200];
  for (let at = 0; at < 100; at++) long.mark({ time: new Date(1000 * (2000 + at)).toISOString(), code: `W${at}` });
  long.align({ time_unix_s: 2100, clock_s: 50 });
  told.marks = [long.marks.length, long.marks.at(-1).code, long.marks.at(-1).unix_s - long.offset_s];
  return told;
}"""

HEALTH = """async (state) => {
  const { makeHealth } = await import("/static/live/health.js");
  const health = makeHealth();
  health.state(state);
  const rows = Array.from(health.element.querySelectorAll("tr"), (row) => Array.from(row.children, (cell) => cell.textContent));
  return Object.fromEntries(rows);
}"""

AGES = """async (state) => {
  const { makeAlarms } = await import("/static/live/health.js");
  const alarms = makeAlarms({ on: () => {}, post: async () => ({}), say: () => {} });
  alarms.state(state);
  const said = (item) => [item.className, ...["strong", ".age"].map((part) => item.querySelector(part).textContent)];
  return Array.from(alarms.element.querySelectorAll("li.fault, li.warning"), said);
}"""

ERRORS = """async (columns) => {
  const { makeError } = await import("/static/live/error.js");
  const error = makeError({ columns });
  document.body.prepend(error.element);
  error.draw();
  error.state();
  return error.element.querySelector("p.small").textContent;
}"""

TREND = """async ({ columns, tolerance_n }) => {
  const { Plot } = await import("/static/live/plots.js");
  const { makeTrend } = await import("/static/live/trend.js");
  let plot = null;
  const fit = Plot.prototype.fit;
  Plot.prototype.fit = function () { fit.call(this); plot = this; };
  const trend = makeTrend({ columns, now_s: 2, offset_s: 0, marks: [] });
  document.body.prepend(trend.element);
  trend.state({ limits: { tolerance_n }, force: { requested_n: 8 }, status: [] });
  trend.draw();
  return plot.chart.data.map((one) => Array.from(one));
}"""


def state(**facts: Any) -> dict[str, Any]:
    return LiveState(rig="demo", simulated=True, version="0", time_unix_s=1000.0, state="fault", **facts).to_json()


def test_samples_are_of_this_machine_and_of_the_last_minute_and_say_when_they_are_old(quiet: Any) -> None:
    told = quiet.evaluate(SAMPLES)
    assert not told["empty"]
    assert told["fresh"] == [True, 102.5, 897.5]
    assert told["old"] == [False, 106.5, 897.5], "the clock goes on where no sample comes"
    assert told["joined"] == [[100, 101, 102, 103, 104], [5, 5, 5, 6, 6]], "what overlaps is there once"
    assert told["other"] == [[3, 4], [7, 7]], "behind a restart nothing of before is beside it"
    assert told["long"][0] == told["long"][1] and told["long"][2:] == [1999, True]
    assert told["marks"] == [60, "W99", 49], "the newest sixty, at the gateway's own time"


def test_shares_and_times_of_lines_and_loop_are_counted_as_their_units_say(quiet: Any) -> None:
    line = LiveLine(device="itv", asked=900, heard=600, garbled=200, age_s=0.2)
    loop = LiveLoop(hz=100.0, ticks=2000, missed=10, late_p50_us=250, late_p99_us=12_400, step_us=1_500.0)
    told = quiet.evaluate(HEALTH, state(output=line, load_cell=replace(line, device="cell", age_s=None), loop=loop))
    assert told == {
        "Loop": "100 Hz, 1.50 ms of work",
        "Lateness": "half under 0.25 ms, 99 % under 12 ms",
        "Missed ticks": "10 of 2 000 (0.500 %)",
        "Output, itv": "answers; 600 heard, 200 garbled (25.00 %)",
        "Load cell, cell": "never heard; 600 heard, 200 garbled (25.00 %)",
    }
    valve = quiet.evaluate(HEALTH, state(valve=replace(line, device="relay", age_s=5000.0)))
    assert valve["Valve, relay"].startswith("silent for 83 min;")


def test_each_alarm_says_how_long_it_stands_itself(quiet: Any) -> None:
    fault = LiveAlarm(code="A311", title="one", cure="Look.", since_unix_s=990.0)
    warning = replace(fault, code="A342", title="two", since_unix_s=900.0)
    told = quiet.evaluate(AGES, state(faults=(fault,), warnings=(warning,)))
    assert told == [["fault", "A311 one", "for 10 s"], ["warning", "A342 two", "for 1 min"]]


def test_an_error_is_that_of_the_way_on_which_it_was_made_and_of_the_direction_that_pulls(quiet: Any) -> None:
    """1 N too much while it climbs, 2 N while it falls; pulled, the force is measured negative and the setpoint is not."""
    applied_n = [5.0 + 0.1 * k for k in range(40)] + [8.8 - 0.1 * k for k in range(40)]
    columns = {
        "applied_n": applied_n,
        "force_n": [value + (1.0 if k < 40 else 2.0) for k, value in enumerate(applied_n)],
        "state": [3.0] * 80,
        "time_s": [10.0 + 0.05 * k for k in range(80)],
        "pulling": [0.0] * 80,
    }
    said = "RMS 1.00 N rising, 2.00 N falling, last minute."
    assert quiet.evaluate(ERRORS, columns) == said
    pulled = columns | {"pulling": [1.0] * 80, "force_n": [-value for value in columns["force_n"]]}
    assert quiet.evaluate(ERRORS, pulled) == said
    assert quiet.evaluate(ERRORS, columns | {"state": [1.0] * 80}).startswith("No force was wanted")


def test_the_band_lies_about_what_is_wanted_on_its_side_of_zero(quiet: Any) -> None:
    columns = {
        "time_s": [0.0, 1.0, 2.0], "force_n": [8.1, -8.2, 0.1],
        "setpoint_n": [8.0, 8.0, 0.0], "pulling": [0.0, 1.0, 0.0],
    }  # fmt: skip
    _, low, high, measured, wanted = quiet.evaluate(TREND, {"columns": columns, "tolerance_n": 0.5})
    assert (wanted, low, high) == ([8.0, -8.0, None], [7.5, -8.5, None], [8.5, -7.5, None])
    assert measured == columns["force_n"]


SHOWN = """async ({ map, words }) => {
  const { makeRegisters } = await import("/static/live/registers.js");
  const table = makeRegisters({ get: async () => map, say: (text) => { throw new Error(text); } });
  await new Promise((done) => setTimeout(done));
  await table.state({ words: { command: [], status: words }, writers: {} });
  const row = Array.from(table.element.querySelectorAll("tbody tr")).find((one) => one.textContent.includes("owner_ip"));
  return row.children[4].textContent;
}"""


@pytest.mark.parametrize(
    ("number", "words"),
    [(0, "nobody"), (2, "serial:2"), (0x0A000005, "10.0.0.5"), (NOT_IPV4, "somebody without an IPv4 address")],
)
def test_the_owner_is_told_as_in_a_terminal(quiet: Any, number: int, words: str) -> None:
    rig = demo()
    register, block = rig.register_map.find("owner_ip"), rig.register_map.block("status")
    place = register.address - block.first
    status = [0] * block.words
    status[place : place + 2] = [number >> 16, number & 0xFFFF]
    assert quiet.evaluate(SHOWN, {"map": register_table(rig, 5020), "words": status}) == words


TOLD = """async ({ map, words }) => {
  const { makeRegisters } = await import("/static/live/registers.js");
  const said = [];
  const answer = async (path) => (path.includes("/words/") ? { words: words[path.split("/").pop()] } : map);
  const table = makeRegisters({ get: answer, say: (text) => said.push(text) });
  const turn = () => new Promise((done) => setTimeout(done, 5));
  const rows = () => Array.from(table.element.querySelectorAll("tbody tr"));
  const shown = (name) => rows().find((one) => one.children[2].textContent === name);
  const told = {};
  await turn();
  for (const block of ["", "float_abcd", "float_cdab"]) {
    const choice = table.element.querySelector("select");
    choice.value = block;
    choice.dispatchEvent(new Event("change"));
    do {
      await table.state({ words: block ? {} : { command: [], status: words.status }, writers: {} });
      await turn();
    } while (!shown("pressure").children[4].textContent); // a block's words are asked for now and then
    for (const name of ["force_measured", "model_residual", "pressure"]) {
      told[`${block}:${name}`] = shown(name).children[4].textContent;
    }
    const before = said.length;
    shown("force_measured").querySelector("button").click();
    while (said.length === before) await turn();
  }
  return { told, said: said.map((text) => text.replace("Copied: ", "")) };
}"""


def test_words_are_read_in_their_order_and_unit_and_the_line_to_copy_reads_the_same(quiet: Any) -> None:
    """12.34 N with the words exchanged is 1e-38, and one register beside the force is another force."""
    rig = demo()
    floats = {"force_measured": -12.34, "model_residual": 0.5, "pressure": 450.0}
    words = {block: [0] * rig.register_map.block(block).words for block in ("status", "float_abcd", "float_cdab")}
    for name, value in floats.items():
        place = rig.register_map.find(name).address - 100
        words["status"][place] = round(value / rig.register_map.find(name).scale) & 0xFFFF
        high, low = struct.unpack(">HH", struct.pack(">f", value))
        for block, pair in (("float_abcd", [high, low]), ("float_cdab", [low, high])):
            words[block][32 + 2 * place : 34 + 2 * place] = pair
    words["status"][rig.register_map.find("pressure").address - 100] = 0x8000
    found = quiet.evaluate(TOLD, {"map": register_table(rig, 5020), "words": words})
    assert found["told"] == {
        ":force_measured": "-12.34 N", ":model_residual": "0.50 N", ":pressure": "not known",
        "float_abcd:force_measured": "-12.34 N", "float_abcd:model_residual": "0.50 N", "float_abcd:pressure": "450.00 kPa",
        "float_cdab:force_measured": "-12.34 N", "float_cdab:model_residual": "0.50 N", "float_cdab:pressure": "450.00 kPa",
    }  # fmt: skip
    assert found["said"] == [
        "mbpoll -1 -p 5020 -r 103 127.0.0.1",
        "mbpoll -1 -p 5020 -t 4:float -B -r 237 127.0.0.1",
        "mbpoll -1 -p 5020 -t 4:float -r 337 127.0.0.1",
    ]


FOLDED = """async (map) => {
  const { makeRegisters } = await import("/static/live/registers.js");
  const table = makeRegisters({ get: async () => map, say: () => {} });
  await new Promise((done) => setTimeout(done));
  document.body.append(table.element);
  const name = [...table.element.querySelectorAll("th")].find((one) => one.textContent === "voltage_setpoint");
  const lines = new Map();
  for (const part of name.childNodes) {
    const range = document.createRange();
    range.selectNode(part);
    for (const box of range.getClientRects()) if (box.width) lines.set(box.top, (lines.get(box.top) ?? "") + part.textContent);
  }
  return [...lines.values()];
}"""


def test_a_name_goes_on_behind_an_underscore_on_a_telephone(quiet: Any) -> None:
    """It stood there as `voltage_setpoin` and `t`."""
    quiet.set_viewport_size({"width": 390, "height": 844})
    assert quiet.evaluate(FOLDED, register_table(demo(), 5020)) == ["voltage_", "setpoint"]


LINES = """async ({ map, words }) => {
  const { makeRegisters } = await import("/static/live/registers.js");
  const said = [];
  const table = makeRegisters({ get: async () => map, say: (text) => said.push(text) });
  await new Promise((done) => setTimeout(done));
  await table.state({ words: { command: [], status: words }, writers: {} });
  const told = {};
  for (const row of table.element.querySelectorAll("tbody tr")) {
    const before = said.length;
    row.querySelector("button")?.click();
    while (said.length === before) await new Promise((done) => setTimeout(done, 5));
    told[row.children[2].textContent] = [row.children[4].textContent, said.at(-1).replace("Copied: ", "")];
  }
  return told;
}"""


def test_of_another_unit_each_line_to_copy_says_which_and_reads_both_words_of_a_long_number(quiet: Any) -> None:
    """Without its own unit a gateway behind a bridge is silent, and of a long number one half is any number."""
    rig = demo()
    block = rig.register_map.block("status")
    status = [0] * block.words
    status[rig.register_map.find("force_measured").address - block.first] = 0x8000
    found = quiet.evaluate(LINES, {"map": register_table(rig, 5020) | {"unit": 17}, "words": status})
    assert found["owner_ip"][1] == "mbpoll -1 -p 5020 -a 17 -t 4:int -B -r 117 127.0.0.1"
    assert found["force_measured"] == ["not known", "mbpoll -1 -p 5020 -a 17 -r 103 127.0.0.1"]
