"""What a start says to people and to programs: where everything is, how it is, and lines to try that work there."""

import json
import shlex
from dataclasses import replace
from ipaddress import ip_network
from math import inf, nan
from pathlib import Path

import pytest

from gateway.clients.wiring import wiring_page
from gateway.control.settings import LeaseAction
from gateway.devices.messages import ForceSample, Quality
from gateway.profiles import load_register_map, load_rig
from gateway.profiles.http_sections import OpcUa
from gateway.profiles.telemetry_sections import Mqtt, SparkplugNode
from gateway.service import banner
from gateway.service.banner import Ready, ServedFace, format_banner, ready_fields, shown_force, tcp_face, try_lines
from tests.service.rigs import demo, with_supervision

PROFILES = Path(__file__).parents[2] / "profiles"


def ready(**changes: object) -> Ready:
    facts = {
        "rig": demo(),
        "modbus": ("127.0.0.1", 5020),
        "output_port": "/dev/pts/4",
        "cell_port": "/dev/pts/6",
        "voltage_v": 0.0,
        "force_n": 0.004,
    }
    facts |= changes
    return Ready(**({"faces": (tcp_face(*facts["modbus"], facts["rig"].network.units),)} | facts))  # type: ignore[arg-type,misc,attr-defined]


def test_the_banner_says_where_and_what_and_how_to_try() -> None:
    text = format_banner(ready())
    for words in (
        "rig demo (simulated, seed 7)",
        "calibration demo: bsfm n=2",
        "127.0.0.1:5020   units 0, 1, 255",
        "/dev/pts/4       smc-itv-rc 9600  ok   0.000 V",
        "/dev/pts/6       stream-st-gs 115200  ok   0.00 N",
        "lease        none: a command lasts until the next one",
        "mbpoll -1 -p 5020 -r 1 127.0.0.1 1 1200",
        "READY  loop 100 Hz · Ctrl-C ramps the force to 0 and stops · not a safety device",
    ):
        assert words in text
    assert text.splitlines()[-1].startswith("READY")


def test_a_silent_device_is_not_shown_as_zero() -> None:
    text = format_banner(ready(voltage_v=None, force_n=None, notes=("E111 /dev/pts/6: silence at every speed",)))
    assert text.count("silent") == 2
    assert "  note         E111 /dev/pts/6" in text


def test_a_cell_that_tells_an_overload_beside_its_digits_is_not_shown_as_well() -> None:
    """1210 N of a Modbus amplifier whose overload bit was set stood there as ok."""
    line = format_banner(ready(force_n=shown_force(ForceSample(123.45, 1210.63, Quality.OVERLOAD, 0.0))))
    assert "stream-st-gs 115200  beyond its range\n" in line
    assert shown_force(ForceSample(0.4, 4.0, Quality.UNSTABLE, 0.0)) == 4.0 and shown_force(None) is None


@pytest.mark.parametrize("force_n", [nan, inf, -inf])
def test_an_overloaded_cell_is_not_shown_as_well(force_n: float) -> None:
    assert "stream-st-gs 115200  beyond its range\n" in format_banner(ready(force_n=force_n))


def test_the_command_to_try_names_another_gateway() -> None:
    text = format_banner(ready(modbus=("10.0.0.9", 502)))
    assert "mbpoll -1 -p 502 -r 1 10.0.0.9 1 1200" in text
    assert "--gateway 10.0.0.9:502" in text
    assert "--gateway" not in format_banner(ready())


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, "force-gateway hold 12        (enable"),
        ({"lease_s": 0.15}, "force-gateway hold 12        (enable"),
        ({"lease_s": 0.05}, "force-gateway hold 12 --rig "),
    ],
)
def test_with_a_lease_the_line_to_try_keeps_a_heartbeat(changes: dict[str, float], expected: str) -> None:
    (line,) = try_lines(with_supervision(demo(), **({"lease_s": 0.2} | changes)), "127.0.0.1", 5020)
    assert line.startswith(expected)


def test_a_map_of_one_s_own_is_tried_by_its_own_numbers(tmp_path: Path) -> None:
    """By those of force-v1, 12 N were 1200 counts of 0.1 N: 120 N."""
    force = "force_setpoint, address: 1, type: int16, scale: 0.01, unit: N, access: RW, min: 0, max: 327.67"
    shipped = (PROFILES / "registers" / "force-v1.yaml").read_text()
    coarse = shipped.replace(force, force.replace("0.01", "0.1"))
    (tmp_path / "own map.yaml").write_text(coarse)
    rig = (PROFILES / "rigs" / "demo.yaml").read_text().replace("registers: force-v1", "registers: own map.yaml")
    (tmp_path / "own rig.yaml").write_text(rig)
    polled, written, held = try_lines(load_rig(tmp_path / "own rig.yaml"), "127.0.0.1", 5020)
    assert polled.startswith("mbpoll -1 -p 5020 -r 1 127.0.0.1 1 120 ")
    for line in (written, held):
        words = shlex.split(line)
        assert load_register_map(words[words.index("--map") + 1]).find("force_setpoint").scale == 0.1
    (kept,) = try_lines(with_supervision(load_rig(tmp_path / "own rig.yaml"), lease_s=0.05), "127.0.0.1", 5020)
    words = shlex.split(kept)
    assert Path(words[words.index("--rig") + 1]) == tmp_path / "own rig.yaml"


def test_the_lines_to_try_are_told_while_the_shipped_profiles_are_away(monkeypatch: pytest.MonkeyPatch) -> None:
    """As while another version is being installed: a control process that was started again then must not end by its words."""
    rig, away = demo(), Path("/nowhere/profiles")
    told = try_lines(rig, "127.0.0.1", 5020)
    monkeypatch.setattr("gateway.profiles.find.shipped_profiles_folder", lambda: away)
    while_away = try_lines(rig, "127.0.0.1", 5020)
    assert [line.partition(" --map ")[0] for line in while_away[1:]] == [
        line.partition("        ")[0] for line in told[1:]
    ]
    assert while_away[0] == told[0]


def test_a_valve_and_what_listens_for_http_are_told_where_they_are() -> None:
    pulls, http = load_rig("paper-pull", simulated=True), {"web": ("127.0.0.1", 8080), "metrics": ("::", 9090)}
    given = ready(rig=pulls, valve_port="/dev/pts/9", http=http)
    text, fields = format_banner(given), ready_fields(given)
    assert f"  valve        /dev/pts/9       {pulls.valve and pulls.valve.device.name} " in text
    assert "  web          http://127.0.0.1:8080/\n" in text
    assert "  metrics      http://[::1]:9090/metrics        (and on this machine's other addresses)" in text
    assert fields["ptys"] == {"output": "/dev/pts/4", "load_cell": "/dev/pts/6", "valve": "/dev/pts/9"}
    assert (fields["web"], fields["metrics"]) == (["127.0.0.1", 8080], ["::", 9090])
    bare = ready_fields(ready())
    assert (set(bare["ptys"]), bare["web"], bare["metrics"]) == ({"output", "load_cell"}, None, None)


@pytest.mark.parametrize(
    ("owner", "may_try"),
    [("127.0.0.1", True), ("192.168.1.5", False), ("serial:1", False), ("certificate robot", False)],
)
def test_a_rig_that_names_its_master_is_tried_from_there_only(owner: str, may_try: bool) -> None:
    rig = replace(demo(), network=replace(demo().network, owner=owner))
    assert (len(try_lines(rig, "127.0.0.1", 5020)) > 1) == may_try


@pytest.mark.parametrize(
    ("least_n", "most_n", "tried_n"),
    [
        (0.0, 12.0, "12"),
        (12.0, 30.0, "12"),
        (0.0, 9.0, "5"),
        (14.2, 14.6, "14.4"),
        (13.0, 14.0, "14"),
        (2.3, 2.4, "2.35"),
    ],
)
def test_the_force_to_try_is_one_that_the_rig_takes(least_n: float, most_n: float, tried_n: str) -> None:
    limits = replace(demo().control.limits, smallest_force_n=least_n, force_max_n=most_n)
    rig = replace(demo(), control=replace(demo().control, limits=limits))
    assert f"force_setpoint={tried_n} " in try_lines(rig, "127.0.0.1", 5020)[1]


@pytest.mark.parametrize(
    ("least_n", "most_n", "tried_n"),
    [(40.0, 65.0, 50.0), (59.0, 65.0, 60.0), (62.0, 65.0, None), (59.992, 59.994, None)],
)
def test_the_force_to_try_is_within_the_calibrations_limits_too_or_there_is_none(
    least_n: float, most_n: float, tried_n: float | None
) -> None:
    """A set from an upload may be for 62 .. 65 N, on a rig that takes 60 N at most: 61 N was proposed, which is refused."""
    rig = replace(demo(), calibration=replace(demo().calibration, force_limits_n=(least_n, most_n)))
    assert rig.force_to_try_n == tried_n


def test_where_there_is_no_force_to_try_none_is_named() -> None:
    rig = replace(demo(), calibration=replace(demo().calibration, force_limits_n=(62.0, 65.0)))
    terminal = ServedFace("rtu", "/dev/pts/7", "", {"host": "serial:1", "unit": 1, "baud": 19200, "is_terminal": True})
    tried = [line for line in format_banner(ready(rig=rig, faces=(terminal,))).splitlines() if line.startswith("  try")]
    assert tried == ["  try          force-gateway monitor        (the rig and its calibration share no force to try)"]
    mbpoll = next(section for section in wiring_page(rig, "narrow")[1] if section.title.startswith("mbpoll"))
    assert "share no force to try" in " ".join(mbpoll.sentences) and not any(
        "enable" in line for line in mbpoll.commands
    )
    assert any("disable" in line for line in mbpoll.commands)


def test_the_lines_to_try_are_of_the_rig_at_hand() -> None:
    rig = demo()
    network = replace(rig.network, units=(7,), allow=(ip_network("127.0.0.0/8"),))
    mbpoll, write, hold = try_lines(replace(rig, network=network), "0.0.0.0", 502)
    assert mbpoll.startswith("mbpoll -1 -a 7 -p 502 -r 1 127.0.0.1 1 1200 ")
    assert "--gateway 127.0.0.1:502 --unit 7" in write and "--gateway 127.0.0.1:502 --unit 7" in hold
    closed = replace(rig, network=replace(rig.network, allow=(ip_network("10.0.0.0/8"),)))
    assert "--gateway THIS-MACHINE:5020" in try_lines(closed, "0.0.0.0", 5020)[1], "loopback may not connect there"
    owned = replace(rig, network=replace(rig.network, owner="192.168.1.5"))
    assert try_lines(owned, "127.0.0.1", 5020) == ("force-gateway monitor        (192.168.1.5 alone may command)",)
    proving = replace(rig, network=replace(rig.network, require_byte_order_echo=True))
    assert try_lines(proving, "127.0.0.1", 5020)[0].startswith("force-gateway hold 12 ")
    limits = replace(rig.control.limits, force_max_n=9.0)
    weak = replace(rig, control=replace(rig.control, limits=limits))
    assert "1 500 " in try_lines(weak, "127.0.0.1", 5020)[0]
    assert "--gateway [::1]:5020" in try_lines(rig, "::1", 5020)[1]


def test_a_lease_is_told_with_its_length_and_what_follows() -> None:
    rig = with_supervision(demo(), lease_s=0.2, lease_action=LeaseAction.RAMP)
    assert "lease        200 ms, then ramp" in format_banner(ready(rig=rig))
    for simulated in (False, True):  # of a rig of one's own, tried with --sim, it said "none (demo)"
        text = format_banner(ready(rig=replace(demo(), simulated=simulated)))
        assert "lease        none: a command lasts until the next one" in text


def test_the_json_line_is_json_and_tells_the_ports() -> None:
    facts = json.loads(json.dumps(ready_fields(ready(modbus=("127.0.0.1", 40123), notes=("a",)))))
    assert facts["ready"] is True
    assert facts["modbus"] == ["127.0.0.1", 40123]
    assert facts["ptys"] == {"output": "/dev/pts/4", "load_cell": "/dev/pts/6"}
    assert facts["notes"] == ["a"]
    assert ready_fields(ready(rig=replace(demo(), simulated=False)))["ptys"] == {}


def test_the_page_is_told_where_a_browser_on_this_machine_finds_it() -> None:
    near = ready(http={"web": ("127.0.0.1", 8080), "metrics": ("::1", 9464)})
    assert "web          http://127.0.0.1:8080/\n" in format_banner(near)
    assert "metrics      http://[::1]:9464/metrics\n" in format_banner(near)
    assert ready_fields(near)["web"] == ["127.0.0.1", 8080]
    everywhere = format_banner(ready(http={"web": ("0.0.0.0", 8080)}))
    assert "http://127.0.0.1:8080/        (and on this machine's other addresses)" in everywhere
    assert ready_fields(ready())["web"] is None


@pytest.mark.parametrize(
    ("lease_s", "unit", "owner", "line"),
    [
        (None, 1, None, "mbpoll -m rtu -b 19200 -P none -a 1 -1 -r 1 /dev/pts/3 1 1200 "),
        (0.2, 1, None, "force-gateway hold 12 --rtu /dev/pts/3 --rig "),
        (0.2, 7, "serial:1", "force-gateway hold 12 --rtu /dev/pts/3 --unit 7 --rig "),
        (None, 1, "serial:2", ""),
    ],
)
def test_a_terminal_of_a_serial_face_is_tried_as_its_rig_wants(
    lease_s: float | None, unit: int, owner: str | None, line: str
) -> None:
    rig = with_supervision(demo(), lease_s=lease_s)
    rig = replace(rig, network=replace(rig.network, owner=owner))
    facts = {"is_terminal": True, "unit": unit, "baud": 19200, "host": "serial:1"}
    face = ServedFace("rtu", "/dev/pts/3", "", facts)
    text = format_banner(replace(ready(rig=rig), modbus=None, faces=(face,)))
    assert ("  try " in text) == bool(line)
    assert f"  try          {line}" in text if line else True


def test_opc_ua_and_the_broker_are_told_as_the_page_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever looked for them found nothing of either, also where a library was missing, but a line of the log behind it."""
    mqtt = Mqtt(host="broker.hall", sparkplug=SparkplugNode(group="plant"))
    rig = replace(demo(), opcua=OpcUa(listen="0.0.0.0:4840"), mqtt=mqtt)
    monkeypatch.setattr(banner, "is_installed", lambda library: True)
    told = format_banner(ready(rig=rig))
    assert (
        "  opcua        opc.tcp://127.0.0.1:4840/        (and on this machine's other addresses)        (starting: "
        in told
    )
    assert "  mqtt         broker.hall:1883   force-gateway/demo/#, spBv1.0/plant/+/demo\n" in told
    named = replace(rig, opcua=None, mqtt=Mqtt(host="fd00::5", port=8883, base_topic="cells/7"))
    assert "  mqtt         [fd00::5]:8883   cells/7/#\n" in format_banner(ready(rig=named))
    assert "mqtt" not in format_banner(ready()) and "opcua" not in format_banner(ready(rig=named))
    monkeypatch.setattr(banner, "is_installed", lambda library: False)
    told = format_banner(ready(rig=rig))
    assert "  opcua        E160 opcua is off: asyncua is not installed" in told
    assert "  mqtt         E160 mqtt is off: aiomqtt is not installed" in told


def test_an_ipv6_address_stands_in_brackets_before_its_port() -> None:
    """`modbus tcp ::1:5020` is another address."""
    assert [face("::1", 5020, (1,)).where for face in (banner.tcp_face, banner.tls_face)] == ["[::1]:5020"] * 2
    assert banner.tcp_face("127.0.0.1", 5020, (1,)).where == "127.0.0.1:5020"
