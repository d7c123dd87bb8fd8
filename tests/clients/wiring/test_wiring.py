"""The wiring page: of any rig, in any format, with numbers that are those of the generated clients."""

from __future__ import annotations

import json
import re
import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from gateway.cli.main import command
from gateway.clients import Endpoint, render_client
from gateway.clients.wiring import wiring_page
from gateway.profiles import list_shipped, load_register_map, load_rig
from gateway.profiles.rigs.faces import TlsFace
from gateway.registers.words import SelfTestResult
from tests.certificates import store_all
from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.controllers.s7 import S7, MbClient

PROFILES = Path(__file__).parents[3] / "profiles"
MAP = load_register_map("force-v1")


def call(*words: str) -> str:
    result = CliRunner().invoke(command, [*words], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def rows_of(page: dict[str, Any], title: str) -> dict[str, list[str]]:
    (section,) = [each for each in page["sections"] if each["title"] == title]
    return {row[0]: row[1:] for row in section["rows"]}


def page_of(rig: Path | str) -> dict[str, Any]:
    return dict(json.loads(call("wiring", str(rig), "--json")))


@pytest.mark.parametrize("form", ["text", "markdown", "json"])
@pytest.mark.parametrize("rig", list_shipped("rig"))
def test_every_shipped_rig_has_a_page(rig: str, form: str) -> None:
    text = call("wiring", rig, "--format", form)
    network = load_rig(rig).network
    assert f"{network.bind}:{network.port}" in text
    for word in ("TCON_IP_v4", "FG_HOST", "ClientTCP", "register output", "mbpoll -1", "undoes another master's stop"):
        assert word in text


@pytest.fixture
def own_rig(tmp_path: Path) -> Path:
    """The cell with other devices, a serial face, another port, and its proof of byte order."""
    text = (PROFILES / "rigs" / "irc5-cell.yaml").read_text()
    text = text.replace("port: 5020", "port: 502").replace("bind: 192.168.125.20", "bind: 10.1.2.3")
    text = text.replace("require_byte_order_echo: false", "require_byte_order_echo: true")
    text += "\nfieldbus:\n  - {type: rtu, port: /dev/ttyS7, baud: 38400, parity: even, stop_bits: 1, unit: 17}\n"
    (tmp_path / "own.yaml").write_text(text)
    return tmp_path / "own.yaml"


def test_the_page_of_a_rig_of_one_s_own_has_its_own_numbers(own_rig: Path) -> None:
    page = page_of(own_rig)
    assert rows_of(page, "Siemens S7-1200/1500: connection of MB_CLIENT")["RemoteAddress"][0].endswith("10, 1, 2, 3")
    assert rows_of(page, "ABB IRC5: RAPID sockets")["FG_HOST, FG_PORT, FG_UNIT"] == ['"10.1.2.3", 502, 1']
    face = rows_of(page, "Serial face 1: Modbus RTU, masters ask here")
    timing = "command and status in one FC23: 34 ms on the wire, 29 a second at most"
    assert (face["line"], face["timing"]) == (["38400 8E1, unit 17"], [timing])
    text = call("wiring", str(own_rig))
    assert "mbpoll -1 -m rtu -b 38400 -P even -s 1 -a 17 -r 101 -c 32 MASTER-PORT" in text
    assert "asks port 502 always" not in text
    assert "16#449A, 16#5000 to address 416 (40417)" in text


def test_a_face_with_certificates_is_told_from_what_the_clients_speak() -> None:
    face = TlsFace(type="tls", port=802, certificate="gateway.crt", key="gateway.key", ca="ca.crt")
    rig = replace(load_rig("demo"), fieldbus=(face,))
    titles = {section.title: dict(row[:2] for row in section.rows) for section in wiring_page(rig, "demo")[1]}  # type: ignore[arg-type]
    shown = titles["Face 1: Modbus/TCP Security"]
    assert shown["address"].startswith("127.0.0.1:802,")
    assert "ca.crt" in shown["masters need"]
    assert "plain Modbus TCP" in shown["not for"]
    (line,) = next(each.commands for each in wiring_page(rig, "demo")[1] if each.title == "Face 1: Modbus/TCP Security")
    assert line.startswith("force-gateway read state --gateway 127.0.0.1:802 --tls ca.crt --cert CLIENT.crt ")
    own = replace(rig, register_map=replace(rig.register_map, file="own.yaml"))
    (line,) = next(each.commands for each in wiring_page(own, "demo")[1] if each.title == "Face 1: Modbus/TCP Security")
    assert " --gateway 127.0.0.1:802 --map own.yaml --tls " in line, "else it is refused: E186"
    far = replace(rig, fieldbus=(replace(face, bind="fd00::5"),))
    (line,) = next(each.commands for each in wiring_page(far, "demo")[1] if each.title == "Face 1: Modbus/TCP Security")
    assert " --gateway [fd00::5]:802 " in line


@pytest.mark.parametrize(("bind", "told"), [("0.0.0.0", "GATEWAY-ADDRESS:802,"), ("fd00::5", "[fd00::5]:802,")])
def test_an_address_of_the_page_is_one_to_connect_to(bind: str, told: str) -> None:
    """A face of every address was told as 0.0.0.0, one of IPv6 without brackets; the command below it had it right."""
    face = TlsFace(type="tls", port=802, certificate="gateway.crt", key="gateway.key", ca="ca.crt", bind=bind)
    rig = load_rig("demo")
    rig = replace(rig, fieldbus=(face,), network=replace(rig.network, bind=bind, port=802))
    shown = [row[1] for each in wiring_page(rig, "demo")[1] for row in each.rows if row[0] == "address"]
    assert [one.partition(" ")[0] for one in shown] == [told, told]


def test_a_rig_that_answers_another_unit_only_is_asked_as_that_by_every_line(tmp_path: Path) -> None:
    text = (PROFILES / "rigs" / "irc5-cell.yaml").read_text().replace("units: [0, 1, 255]", "units: [7]")
    (tmp_path / "own.yaml").write_text(text)
    (section,) = [each for each in page_of(tmp_path / "own.yaml")["sections"] if each["title"].startswith("mbpoll")]
    assert all("-a 7 " in line or "--unit 7 " in line for line in section["commands"])
    assert load_rig(str(tmp_path / "own.yaml")).network.units == (7,)


def test_every_line_to_type_can_be_typed(tmp_path: Path) -> None:
    """A name with a blank in it, an IPv6 address, a least force of 20 N, a map with other addresses."""
    shipped = (PROFILES / "registers" / "force-v1.yaml").read_text()
    moved = re.sub(r"(address|first|last): 1(\d\d)\b", r"\g<1>: 101\2", shipped)
    (tmp_path / "far.yaml").write_text(re.sub(r"(address|first|last): 1(\d{3})\b", r"\g<1>: 11\2", moved))
    text = (PROFILES / "rigs" / "irc5-cell.yaml").read_text()
    text = text.replace("bind: 192.168.125.20", 'bind: "fd00::5"').replace("- 192.168.125.0/24", '- "fd00::/64"')
    text = text.replace("registers: force-v1", "registers: far.yaml").replace(
        "contact_force_n: 3", "contact_force_n: 20"
    )
    text = text.replace("smallest_force_n: 2", "smallest_force_n: 20")
    text += "\nfieldbus:\n  - {type: rtu, port: /dev/ttyS7, baud: 38400, parity: even, stop_bits: 1, unit: 17}\n"
    (tmp_path / "left cell.yaml").write_text(text)
    page = page_of(tmp_path / "left cell.yaml")
    lines = [line for section in page["sections"] for line in section["commands"]]
    made = [shlex.split(line) for line in lines if line.startswith("force-gateway registers")]
    assert {words[words.index("--rig") + 1] for words in made} == {str(tmp_path / "left cell.yaml")}
    (hold,) = (shlex.split(line) for line in lines if line.startswith("force-gateway hold"))
    assert hold[2:7] == ["35", "--gateway", "[fd00::5]:5020", "--map", str(tmp_path / "far.yaml")]
    (serial,) = (line for line in lines if "-m rtu" in line)
    assert " -r 10101 -c 32 " in serial
    assert rows_of(page, "Siemens S7-1200/1500: requests")["status"][1] == "410101"


@pytest.mark.parametrize(
    ("owner", "lease_s", "commands"),
    [
        ("192.168.125.7", 0.2, "force-gateway hold 12 "),
        ("192.168.125.7", None, "mbpoll -1 -p 5020 -r 1 192.168.125.20 1 1200 "),
        ("serial:1", 0.2, ""),
    ],
)
def test_a_rig_that_names_its_owner_says_who_may_type_what(owner: str, lease_s: float | None, commands: str) -> None:
    """It said that mbpoll keeps no heartbeat where there was no lease, and had anybody hold a force."""
    rig = load_rig("irc5-cell")
    supervision = replace(rig.control.supervision, lease_s=lease_s)
    rig = replace(rig, network=replace(rig.network, owner=owner), control=replace(rig.control, supervision=supervision))
    section = wiring_page(rig, "irc5-cell")[1][-1]
    assert section.title.startswith("mbpoll") and f"Only {owner} may command here" in " ".join(section.sentences)
    assert ("keeps no heartbeat" in " ".join(section.sentences)) is commands.startswith("force-gateway")
    able = [line for line in section.commands if "enable" in line]
    assert len(able) == bool(commands) and all(line.startswith(commands) for line in able)


def test_a_rig_without_a_lease_is_told_that_its_force_outlives_the_master() -> None:
    told = "This rig has no lease: the force lasts when the master's program stops"
    assert told in " ".join(call("wiring", "demo").split())
    assert told not in " ".join(call("wiring", "irc5-cell").split())


@pytest.mark.parametrize(
    ("old", "new", "on_the_page", "in_the_client"),
    [
        (
            "lease_action: fault",
            "lease_action: hold",
            "At the end of its lease this rig keeps the force",
            "lease_action is hold",
        ),
        ("lease_s: 0.2 ", "lease_s: null ", "This rig has no lease", "This rig has no lease"),
        ("owner: null", "owner: serial:1", "Only serial:1 may command here", "This rig's owner is no address"),
        ("owner: null", "plain: false\n  owner: null", "Plain Modbus TCP is off", "This rig has no plain Modbus TCP"),
    ],
)
def test_what_a_rig_keeps_a_client_from_is_told_on_the_page_and_in_the_client(
    old: str, new: str, on_the_page: str, in_the_client: str, tmp_path: Path
) -> None:
    """A force that outlasts its program, and a client that nobody will listen to."""
    text = (PROFILES / "rigs" / "irc5-cell.yaml").read_text()
    assert text.count(old) == 1
    face = "\nfieldbus:\n  - {type: rtu, port: /dev/ttyS7, baud: 38400, parity: even, stop_bits: 1, unit: 17}\n"
    (tmp_path / "own.yaml").write_text(text.replace(old, new) + face)
    assert on_the_page not in " ".join(call("wiring", "irc5-cell").split())
    assert on_the_page in " ".join(call("wiring", str(tmp_path / "own.yaml")).split())
    for language in ("rapid", "scl", "st", "urscript", "c", "python"):
        told = call("registers", "--format", language, "--rig", str(tmp_path / "own.yaml"))
        assert in_the_client in told
        assert in_the_client not in call("registers", "--format", language, "--rig", "irc5-cell")
        assert language != "rapid" or max(map(len, told.splitlines())) <= 80


def test_a_lease_that_is_short_for_one_request_at_a_time_is_told_to_who_wires_an_s7(own_rig: Path) -> None:
    """A heartbeat is two requests of MB_CLIENT, with some calls of the block each: 0.08 s at best."""
    title, row = "Siemens S7-1200/1500: connection of MB_CLIENT", "call of the block below"
    assert "set lease_s to 0.36 or more" in rows_of(page_of(own_rig), title)[row][0]
    assert "one that is late ends the force" in rows_of(page_of(own_rig), title)[row][0]
    usual = own_rig.read_text()
    own_rig.write_text(usual.replace("lease_action: fault", "lease_action: hold"))
    assert "one that is late is a loss of the master" in rows_of(page_of(own_rig), title)[row][0]
    own_rig.write_text(usual.replace("lease_s: 0.2 ", "lease_s: 0.4 "))
    assert "lease" not in rows_of(page_of(own_rig), title)[row][0]
    plc = S7(render_client(MAP, "scl", Endpoint("10.0.0.1", 502, 1)), gateway := GatewayAtHand(MAP))
    plc.enable(12.0)
    plc.cycle(0.5)
    seen = len(gateway.beats)
    for _ in range(2):
        plc.cycle(0.5)  # of a second at once only every 50 ms is scanned
    assert 1.0 / 0.12 <= len(gateway.beats) - seen <= 1.0 / 0.08


def test_a_rig_that_no_robot_can_reach_is_told_so() -> None:
    assert "no robot can reach it" in call("wiring", "demo")


def test_a_port_that_is_chosen_at_each_start_is_told_and_never_shown_as_0(tmp_path: Path) -> None:
    store_all(tmp_path)
    face = "{type: tls, port: 0, certificate: gateway.crt, key: gateway.key, ca: ca.crt}"
    text = (PROFILES / "rigs" / "demo.yaml").read_text().replace("  port: 5020", "  port: 0")
    (tmp_path / "any.yaml").write_text(f"{text}\nfieldbus:\n  - {face}\n")
    page = call("wiring", str(tmp_path / "any.yaml"))
    assert "network.port is 0: the gateway takes a free port at each start, PORT below" in " ".join(page.split())
    assert "mbpoll -1 -p PORT -r 1 127.0.0.1 1 1200" in page and "-p 0" not in page
    assert "127.0.0.1:a free port, which `run` names when it is ready" in page and ":0," not in page


def test_a_robot_that_writes_word_by_word_cannot_show_its_byte_order(own_rig: Path) -> None:
    """FC06 with half of byte_order_echo is refused, so enable is refused too."""
    told = "which the robot's own client cannot write (FC06 carries half of it): use the script"
    assert told in " ".join(call("wiring", str(own_rig)).split())
    assert told not in " ".join(call("wiring", "irc5-cell").split())
    gateway = GatewayAtHand(MAP, wants_echo=True)
    halves = [b"\x06\x01\xa0\x44\x9a", b"\x06\x01\xa1\x50\x00"]
    assert [gateway.answer(each)[0] for each in (*halves, b"\x06\0\0\0\x01")] == [0x86, 0x86, 0x86]


def test_the_s7_table_is_what_the_generated_block_asks(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = set()
    finish = MbClient.finish

    def note(self: MbClient, given: dict[str, Any]) -> None:
        asked.add(tuple(str(given[name]) for name in ("MB_MODE", "MB_DATA_ADDR", "MB_DATA_LEN")))
        finish(self, given)

    monkeypatch.setattr(MbClient, "finish", note)
    gateway = GatewayAtHand(MAP)
    client = S7(render_client(MAP, "scl", Endpoint("10.1.2.3", 502, 1)), gateway)
    client.cycle()
    client.self_test()
    client.cycle()
    gateway.end_self_test(SelfTestResult.PASSED)
    client.cycle()
    client.enable(12.0)
    client.begin_upload({"order": 1}, 0)
    for cycle in range(10):
        client.force(12.0 + cycle)
        client.cycle()
        client.cycle()
    rows = rows_of(page_of("irc5-cell"), "Siemens S7-1200/1500: requests")
    assert asked == {tuple(row[:3]) for name, row in rows.items() if name != "request"}


@pytest.mark.parametrize("device", list_shipped("device"))
def test_every_shipped_device_has_its_wires(device: str) -> None:
    from gateway.clients.wiring.device_wires import GENERAL, wires_of

    for is_modbus in (False, True):
        wires = wires_of(device, is_modbus=is_modbus)
        assert GENERAL[wires.interface]
        assert wires.source or not wires.switches or "menu" in wires.switches[0]


@pytest.mark.parametrize("language", ["rapid", "scl", "st", "urscript", "c", "python"])
def test_a_client_for_a_rig_has_its_address(own_rig: Path, language: str) -> None:
    text = call("registers", "--format", language, "--rig", str(own_rig))
    shown = {"scl": "IP_1 : Byte := 10;", "st": "[10, 1, 2, 3]"}.get(language, "10.1.2.3")
    assert shown in text
    assert f"map_hash 0x{MAP.map_hash:08X}" in text


def test_a_map_that_lacks_registers_is_told_all_of_them(tmp_path: Path) -> None:
    text = (PROFILES / "registers" / "force-v1.yaml").read_text()
    text = text.replace("name: refusal_reason", "name: why").replace(
        "name: slip_stops, address: 1150", "name: stops, address: 1150"
    )
    (tmp_path / "my.yaml").write_text(text.replace("name: force-v1", "name: my"))
    result = CliRunner().invoke(command, ["registers", "--format", "rapid", "--map", str(tmp_path / "my.yaml")])
    assert result.exit_code != 0
    assert "E185 map my lacks refusal_reason (block status), slip_stops (block staging)" in result.output


def test_a_map_of_one_s_own_with_other_addresses_makes_a_client(tmp_path: Path) -> None:
    text = (PROFILES / "registers" / "force-v1.yaml").read_text().replace("name: force-v1", "name: my")
    text = text.replace("name: heartbeat, address: 4", "name: heartbeat, address: 13")
    (tmp_path / "my.yaml").write_text(text)
    client = call("registers", "--format", "rapid", "--map", str(tmp_path / "my.yaml"))
    assert "CONST num FG_C_HEARTBEAT:=14;" in client
    assert "COMMAND_WORDS:=14;" in client
