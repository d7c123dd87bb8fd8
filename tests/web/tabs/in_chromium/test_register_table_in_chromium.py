"""The page's register table says what stands there as `force-gateway read` does, and reads it with mbpoll."""

import struct
from typing import Any

import pytest

from gateway.registers.writes.ownership import NOT_IPV4
from gateway.web.register_table import register_table
from tests.service.rigs import demo
from tests.web.tabs.in_chromium.test_tabs_in_chromium import open_tab

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
def test_the_owner_is_told_as_in_a_terminal(page, chromium, number: int, words: str) -> None:
    rig = demo()
    register, block = rig.register_map.find("owner_ip"), rig.register_map.block("status")
    place = register.address - block.first
    status = [0] * block.words
    status[place : place + 2] = [number >> 16, number & 0xFFFF]
    window: Any = open_tab(chromium, page.address, "wiring")
    assert window.evaluate(SHOWN, {"map": register_table(rig, 5020), "words": status}) == words
    window.close()


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


def test_words_are_read_in_their_order_and_unit_and_the_line_to_copy_reads_the_same(page, chromium) -> None:
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
    window: Any = open_tab(chromium, page.address, "wiring")
    found = window.evaluate(TOLD, {"map": register_table(rig, 5020), "words": words})
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
    window.close()


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


def test_a_name_goes_on_behind_an_underscore_on_a_telephone(page, chromium) -> None:
    """It stood there as `voltage_setpoin` and `t`."""
    browser = chromium.new_context(viewport={"width": 390, "height": 844})
    browser.route("**/events?*", lambda route: route.abort())
    window: Any = open_tab(browser, page.address, "wiring")
    assert window.evaluate(FOLDED, register_table(demo(), 5020)) == ["voltage_", "setpoint"]


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


def test_of_another_unit_each_line_to_copy_says_which_and_reads_both_words_of_a_long_number(page, chromium) -> None:
    """Without its own unit a gateway behind a bridge is silent, and of a long number one half is any number."""
    rig = demo()
    block = rig.register_map.block("status")
    status = [0] * block.words
    status[rig.register_map.find("force_measured").address - block.first] = 0x8000
    window: Any = open_tab(chromium, page.address, "wiring")
    found = window.evaluate(LINES, {"map": register_table(rig, 5020) | {"unit": 17}, "words": status})
    assert found["owner_ip"][1] == "mbpoll -1 -p 5020 -a 17 -t 4:int -B -r 117 127.0.0.1"
    assert found["force_measured"] == ["not known", "mbpoll -1 -p 5020 -a 17 -r 103 127.0.0.1"]
    window.close()
