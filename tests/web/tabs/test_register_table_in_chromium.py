"""The page's register table says who owns the setpoint in the words of `force-gateway read`."""

from typing import Any

import pytest

from gateway.registers.writes.ownership import NOT_IPV4
from gateway.web.register_table import register_table
from tests.service.rigs import demo
from tests.web.tabs.test_tabs_in_chromium import open_tab

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
