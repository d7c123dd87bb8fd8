"""What the wiring page tells of a device and of a rig that are nobody's but the integrator's own."""

from dataclasses import replace
from pathlib import Path

import pytest

from gateway.clients import Endpoint, endpoint_of, render_client
from gateway.clients.wiring import render_page, wiring_page
from gateway.profiles import list_shipped, load_rig
from tests.clients.programs.syntax.languages import parse
from tests.clients.wiring.test_wiring import PROFILES, page_of, rows_of


def test_an_electrician_is_told_which_output_counts_and_what_nobody_knows_of_a_device(tmp_path: Path) -> None:
    text = (PROFILES / "rigs" / "irc5-cell.yaml").read_text()
    text = text.replace("device: smc-itv-rc", "device: icpdas-7024\n  channel: 2\n  watchdog_s: 0.5")
    amplifier = (PROFILES / "devices" / "stream-st-gs.yaml").read_text().replace("name: stream-st-gs", "name: usb-cell")
    (tmp_path / "usb-cell.yaml").write_text(amplifier)
    (tmp_path / "own.yaml").write_text(text.replace("device: stream-st-gs", "device: usb-cell"))
    page = page_of(tmp_path / "own.yaml")
    assert rows_of(page, "Serial line: output")["line"] == ["9600 8N1, address 1, channel 2"]
    (interface,) = rows_of(page, "Serial line: load cell")["interface"]
    assert "not known here" in interface and "USB" in interface


def test_an_electrician_is_told_the_checksum_that_the_module_is_to_be_set_to(tmp_path: Path) -> None:
    text = (PROFILES / "rigs" / "irc5-cell.yaml").read_text()
    text = text.replace("device: smc-itv-rc", "device: icpdas-7024\n  watchdog_s: 0.5\n  checksum: dcon-sum")
    (tmp_path / "own.yaml").write_text(text)
    page = page_of(tmp_path / "own.yaml")
    assert rows_of(page, "Serial line: output")["line"] == ["9600 8N1, address 1, channel 0, checksum dcon-sum"]


@pytest.mark.parametrize(
    ("said", "shown"), [("0x10", "10 (hexadecimal, as the module has it; 16 in the rig file)"), ("9", "9")]
)
@pytest.mark.parametrize(
    ("wire", "shipped", "module"),
    [
        ("output", "device: smc-itv-rc", "device: icpdas-702x, watchdog_s: 0.5"),
        ("load cell", "device: stream-st-gs", "device: adam-4016, newton_per_count: 10"),
    ],
)
def test_an_electrician_is_told_the_address_as_the_module_has_it(
    wire: str, shipped: str, module: str, said: str, shown: str, tmp_path: Path
) -> None:
    """`address: 0x10` of a DCON module was `address 16` here: a module whose utility is told 16 hears none of its sentences."""
    text = (PROFILES / "rigs" / "irc5-cell.yaml").read_text().replace("baud: 115200", "baud: 9600")
    settings = f"{module}, address: {said}".replace(", ", "\n  ")
    (tmp_path / "own.yaml").write_text(text.replace(shipped, settings).replace("_timeout_s: 0.05", "_timeout_s: 0.5"))
    assert rows_of(page_of(tmp_path / "own.yaml"), f"Serial line: {wire}")["line"] == [f"9600 8N1, address {shown}"]


def test_an_electrician_is_told_the_unit_that_a_modbus_device_is_to_be_set_to(tmp_path: Path) -> None:
    """A profile without `address` speaks to unit 1, and the page named none."""
    weigher = (PROFILES / "devices" / "laumas-tlb.yaml").read_text().replace("name: laumas-tlb", "name: my-weigher")
    (tmp_path / "my-weigher.yaml").write_text(weigher.replace("constants: {address: 1} #", "#"))
    text = (PROFILES / "rigs" / "irc5-cell.yaml").read_text().replace("device: stream-st-gs", "device: my-weigher")
    for said, unit in (("", 1), ("\n  address: 7", 7)):
        (tmp_path / "own.yaml").write_text(text.replace("device: my-weigher", f"device: my-weigher{said}"))
        line = rows_of(page_of(tmp_path / "own.yaml"), "Serial line: load cell")["line"]
        assert line == [f"115200 8N1, address {unit}"]


def test_who_binds_ipv6_is_told_that_robots_and_plcs_know_ipv4_alone(tmp_path: Path) -> None:
    """The clients said so; the page gave an S7 `fd00::5` for the four bytes of its TCON_IP_v4, and an IRC5 the same."""
    text = (PROFILES / "rigs" / "irc5-cell.yaml").read_text()
    own = text.replace("bind: 192.168.125.20", 'bind: "fd00::5"').replace("192.168.125.0/24", '"fd00::/8"')
    (tmp_path / "own.yaml").write_text(own)
    (told,) = [one["sentences"] for one in page_of(tmp_path / "own.yaml")["sections"] if "Network" in one["title"]]
    assert any("fd00::5 is an IPv6 address" in one for one in told)
    told = next(one["sentences"] for one in page_of("irc5-cell")["sections"] if "Network" in one["title"])
    assert not any("IPv6" in one for one in told)


def test_who_has_no_plain_tcp_is_told_what_holds_and_shown_nothing_that_connects_by_it(tmp_path: Path) -> None:
    """`none of what follows can connect`, it said, and then gave four robots and mbpoll an address to connect to."""
    text = (PROFILES / "rigs" / "irc5-cell.yaml").read_text()
    faces = "\nfieldbus:\n  - {type: rtu, port: /dev/ttyS7, role: ROLE}\n".replace("ROLE", "monitor")
    own = text.replace("owner: null", "plain: false\n  owner: serial:1").replace(
        "byte_order_echo: false", "byte_order_echo: true"
    )
    (tmp_path / "own.yaml").write_text(own + faces)
    page = page_of(tmp_path / "own.yaml")
    lines = [line for one in page["sections"] for line in one.get("commands", [])]
    assert [line.split(" -m rtu ")[0] for line in lines] == ["mbpoll -1"], "the serial face alone can be tried"
    (role,) = rows_of(page, "Serial face 1: Modbus RTU, masters ask here")["role"]
    assert role.startswith("monitor: reads only")
    network = page["sections"][-1]
    shown = rows_of(page, network["title"])
    assert network["title"] == "Network: Modbus TCP" and not {"address", "may connect", "upload of models"} & set(shown)
    assert shown["lease"] and shown["owner"] == ["serial:1"]
    told = " ".join(network["sentences"])
    assert "Plain Modbus TCP is off" in told and "1234.5" in told
    assert "plain Modbus TCP may read" not in told and "generated clients do so" not in told


@pytest.mark.parametrize(
    ("lease_s", "is_short", "rate"), [(0.05, True, "60 Hz"), (0.12, False, "25 Hz"), (0.2, False, "20 Hz")]
)
def test_a_lease_that_is_short_for_a_robot_is_told(lease_s: float, is_short: bool, rate: str, tmp_path: Path) -> None:
    """Of 0.05 s the page said "use the task", which exchanges every 0.04 s, and "20 Hz or more": a beat in 0.05 s."""
    text = (PROFILES / "rigs" / "irc5-cell.yaml").read_text()
    (tmp_path / "own.yaml").write_text(text.replace("lease_s: 0.2 ", f"lease_s: {lease_s} "))
    page = page_of(tmp_path / "own.yaml")
    rows = rows_of(page, "ABB IRC5: RAPID sockets")
    assert ("set lease_s to 0.12 or more" in rows["task"][0]) is is_short
    assert ("use the task" in rows["without 623-1"][0]) is not is_short
    (told,) = [" ".join(one["sentences"]) for one in page["sections"] if one["title"] == "Universal Robots"]
    assert ("set lease_s to 0.12 or more" in told) is is_short and f"{rate} or more for the heartbeat" in told


@pytest.mark.parametrize(
    ("units", "slave"), [("[0, 1, 255]", "1 (255, as it comes, is answered too)"), ("[1, 7]", "1"), ("[7]", "7")]
)
def test_who_sets_a_robot_s_own_modbus_client_is_told_an_address_that_this_rig_answers(
    units: str, slave: int, tmp_path: Path
) -> None:
    text = (PROFILES / "rigs" / "irc5-cell.yaml").read_text()
    (tmp_path / "own.yaml").write_text(text.replace("units: [0, 1, 255]", f"units: {units}"))
    page = page_of(tmp_path / "own.yaml")
    (told,) = [" ".join(one["sentences"]) for one in page["sections"] if one["title"] == "Universal Robots"]
    assert f"slave address {slave}," in told and ("does not answer 255" in told) is ("255" not in slave)


def test_of_eight_outputs_the_one_that_is_driven_is_named(tmp_path: Path) -> None:
    text = (PROFILES / "rigs" / "irc5-cell.yaml").read_text().replace("device: smc-itv-rc", "device: waveshare-ao8b")
    (tmp_path / "own.yaml").write_text(text)
    (section,) = [one for one in page_of(tmp_path / "own.yaml")["sections"] if one["title"] == "Serial line: output"]
    wires = " ".join(row[1] for row in section["rows"] if row[0] == "wires")
    assert "AO1, the first of its eight, against AGND" in wires and "AO8" not in wires


@pytest.mark.parametrize(
    ("lease_s", "why", "pace"),
    [
        (0.1, "keeps no heartbeat", " --rig 'cell 3.yaml' "),
        (0.15, "keeps no heartbeat", ""),
        (0.2, "keeps no heartbeat", ""),
        (None, "1234.5", ""),
    ],
)
def test_why_mbpoll_holds_no_force_and_what_does(lease_s: float | None, why: str, pace: str) -> None:
    """Without a lease a rig that wants the proof of byte order blamed the heartbeat; `hold` on another machine lost a short
    lease."""
    rig = load_rig("irc5-cell")
    network = replace(rig.network, require_byte_order_echo=True)
    supervision = replace(rig.control.supervision, lease_s=lease_s)
    rig = replace(rig, network=network, control=replace(rig.control, supervision=supervision))
    section = wiring_page(rig, "cell 3.yaml")[1][-1]
    (told,) = [each for each in section.sentences if "cannot hold" in each]
    (hold,) = [line for line in section.commands if line.startswith("force-gateway hold")]
    assert why in told and ("--rig" in hold) is bool(pace) and pace in hold


@pytest.mark.parametrize(
    ("port", "is_taken"), [(502, True), (5020, True), (5001, False), (34963, False), (49152, False)]
)
def test_a_port_that_mb_client_does_not_take_is_told_on_the_page_and_in_its_block(
    port: int, is_taken: bool, tmp_path: Path
) -> None:
    """An S7 keeps some for itself, and its RemotePort ends at 49151: the page gave it 5001, and the block never connected."""
    text = (PROFILES / "rigs" / "irc5-cell.yaml").read_text()
    (tmp_path / "own.yaml").write_text(text.replace("port: 5020", f"port: {port}"))
    rig = load_rig(str(tmp_path / "own.yaml"))
    (section,) = [
        one for one in page_of(tmp_path / "own.yaml")["sections"] if "connection of MB_CLIENT" in one["title"]
    ]
    told = f"MB_CLIENT takes no port {port}"
    assert any(told in one for one in section["sentences"]) is not is_taken
    block = render_client(rig.register_map, "scl", endpoint_of(rig))
    assert (f"// FILL IN another port: {told}" in block) is not is_taken
    parse(block, "scl")
    assert "FILL IN" not in render_client(rig.register_map, "st", endpoint_of(rig))


@pytest.mark.parametrize(("lease_s", "is_short"), [(0.2, True), (0.36, False)])
def test_who_wires_a_twincat_or_codesys_controller_is_told_of_the_emergency_stop_and_of_its_pace(
    lease_s: float, is_short: bool, tmp_path: Path
) -> None:
    """It goes on at an emergency stop as an S7 does, of which alone the page said so. ModbusFB took 8 calls for a request on a
    bench, so that 0.2 s, what `init` writes, is two heartbeats of a task of 10 ms."""
    text = (PROFILES / "rigs" / "irc5-cell.yaml").read_text()
    (tmp_path / "own.yaml").write_text(text.replace("lease_s: 0.2", f"lease_s: {lease_s}"))
    page = page_of(tmp_path / "own.yaml")
    (section,) = [one for one in page["sections"] if one["title"] == "TwinCAT 3 and CODESYS V3"]
    assert any("emergency stop: `bEnable`" in one for one in section["sentences"])
    (pace,) = rows_of(page, section["title"])["call"]
    assert "10 ms" in pace and ("set lease_s to 0.36 or more" in pace) is is_short
    rig = load_rig(str(tmp_path / "own.yaml"))
    head = render_client(rig.register_map, "st", endpoint_of(rig)).split("*)", 1)[0]
    assert "0.36" in head and "lease_s" in head


@pytest.mark.parametrize("rig", list_shipped("rig"))
def test_the_tables_of_the_page_fit_a_terminal_of_80_columns(rig: str) -> None:
    """They had 122 columns of requests of an S7, and 90 for TwinCAT and CODESYS: on a terminal each row was broken."""
    for section in wiring_page(load_rig(rig), rig)[1]:
        lines = render_page("", [replace(section, commands=())], "text", 80).splitlines()
        path = str(load_rig(rig).file)
        assert [line for line in lines if len(line) > 80 and path not in line] == [], section.title


def test_which_mb_client_the_block_needs_is_told_on_the_page_and_in_its_head() -> None:
    """A project keeps the version that it was made with: V3.1 of an S7-1200 has no CONNECT, and the source does not compile."""
    rig = load_rig("irc5-cell")
    (version,) = rows_of(page_of("irc5-cell"), "Siemens S7-1200/1500: connection of MB_CLIENT")["instruction"]
    for told in (version, render_client(rig.register_map, "scl", endpoint_of(rig))):
        assert "MODBUS (TCP) V4.0" in told and "V3.0" in told


def test_which_polyscope_the_script_needs_is_told_on_the_page_and_in_its_head() -> None:
    """str_cat came with 3.8: an older CB3 said "Compile error: str_cat not defined", and ran nothing of the program."""
    rig = load_rig("irc5-cell")
    script = render_client(rig.register_map, "urscript", endpoint_of(rig))
    head = script[: script.index("# generated by")]
    assert "str_cat(" in script
    (page,) = [one["sentences"] for one in page_of("irc5-cell")["sections"] if one["title"] == "Universal Robots"]
    for told in (page[0], head):
        assert "PolyScope 3.8" in told and "CB3" in told and "5.2" in told


@pytest.mark.parametrize(
    ("lease", "told"),
    [
        ("lease_action: fault", "0.2 s without a new heartbeat, then the safe voltage, and fault A310"),
        ("lease_action: hold", "0.2 s without a new heartbeat, then a warning, and the force is kept (hold)"),
        ("lease_action: ramp", "0.2 s without a new heartbeat, then along the ramp to 0 N, and off"),
    ],
)
def test_an_integrator_is_told_what_becomes_of_the_force_when_the_master_falls_silent(
    lease: str, told: str, tmp_path: Path
) -> None:
    text = (PROFILES / "rigs" / "irc5-cell.yaml").read_text().replace("lease_action: fault", lease)
    (tmp_path / "own.yaml").write_text(text)
    assert rows_of(page_of(tmp_path / "own.yaml"), "Network: Modbus TCP")["lease"] == [told]


def test_the_requests_of_an_s7_and_the_lines_to_try_have_the_function_and_the_address_of_what_they_name() -> None:
    page = page_of("irc5-cell")
    requests = rows_of(page, "Siemens S7-1200/1500: requests")
    assert requests["status"] == ["0", "40101", "32", "103", "100", "FC03"]
    assert requests["heartbeat alone"] == ["1", "40005", "1", "106", "4", "FC06"]
    assert requests["byte_order_echo, 1234.5 per connection"] == ["1", "40417", "2", "116", "416", "FC16"]
    (lines,) = [section["commands"] for section in page["sections"] if section["title"].startswith("mbpoll")]
    floats = [line.split("    # ") for line in lines if "4:float" in line]
    assert floats == [
        ["mbpoll -1 -p 5020 -t 4:float -B -r 237 192.168.125.20", "force_measured in N, float_abcd"],
        ["mbpoll -1 -p 5020 -t 4:float -r 337 192.168.125.20", "force_measured in N, float_cdab"],
    ]
    assert lines[-1] == "mbpoll -1 -p 5020 -r 1 192.168.125.20 0    # disable: safe voltage"
    (lines,) = [section["commands"] for section in page_of("demo")["sections"] if section["title"].startswith("mbpoll")]
    assert lines[-2:] == [
        "mbpoll -1 -p 5020 -r 1 127.0.0.1 1 1200    # enable, 12.00 N, and it lasts",
        "mbpoll -1 -p 5020 -r 1 127.0.0.1 0    # disable: safe voltage",
    ]


def test_an_electrician_connects_the_pins_of_an_adapter_as_tia_574_numbers_them() -> None:
    """On an adapter's plug of nine pins 2 is what it hears, 3 what it says, and 5 the ground; a valve is on two wires."""
    line = rows_of(page_of("irc5-cell"), "Serial line: output")
    assert line["interface"] == ["RS-232"]
    assert "2 RxD <- the device's TxD, 3 TxD -> the device's RxD, 5 GND - GND" in line["wires"][0]
    assert rows_of(page_of("paper-pull"), "Serial line: valve")["interface"] == ["RS-485, two wires"]


@pytest.mark.parametrize(("port", "is_taken"), [(502, True), (5020, True), (102, False), (5001, False), (49152, False)])
def test_an_s7_keeps_some_ports_for_itself(port: int, is_taken: bool) -> None:
    """102 is its own: MB_CLIENT never connects there, and says a number of four digits."""
    assert (Endpoint("10.0.0.1", port, 1).s7_port_fault == "") is is_taken


@pytest.mark.parametrize(("port", "is_told"), [(5020, True), (502, False)])
def test_a_universal_robot_is_told_that_its_own_client_asks_one_port_alone(
    port: int, is_told: bool, tmp_path: Path
) -> None:
    text = (PROFILES / "rigs" / "irc5-cell.yaml").read_text().replace("port: 5020", f"port: {port}")
    (tmp_path / "own.yaml").write_text(text)
    (section,) = [each for each in page_of(tmp_path / "own.yaml")["sections"] if "Universal" in each["title"]]
    assert any("It asks port 502 always" in sentence for sentence in section["sentences"]) is is_told


def test_a_role_of_a_serial_face_is_told_by_what_it_allows(tmp_path: Path) -> None:
    text = (PROFILES / "rigs" / "irc5-cell.yaml").read_text()
    told = {}
    for role in ("monitor", "setpoint", "calibration"):
        face = f"fieldbus:\n  - {{type: rtu, port: /dev/serial/by-id/usb-x, role: {role}}}\n"
        (tmp_path / "own.yaml").write_text(text + face)
        (told[role],) = rows_of(page_of(tmp_path / "own.yaml"), "Serial face 1: Modbus RTU, masters ask here")["role"]
    assert "each write is refused" in told["monitor"]
    assert "commands, uploads no model" in told["setpoint"] and "and uploads models" in told["calibration"]
