"""What a start says and leaves behind: the banner, the JSON line, the flag of an unclean run, the rules for the bank."""

import asyncio
import errno
import json
from dataclasses import replace
from ipaddress import ip_network
from math import inf, nan
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.warning_bits import WarningBit
from gateway.control.settings import LeaseAction
from gateway.modbus import Role
from gateway.ports import PortError
from gateway.processes import exit_codes
from gateway.processes.exit_cause import EndCause, Ending
from gateway.profiles import Rig
from gateway.service.banner import Ready, format_banner, ready_fields, tcp_face, try_lines
from gateway.service.clean_shutdown_marker import CleanShutdownMarker
from gateway.service.running_rig import starting
from gateway.service.running_rig.bank_rules import bank_rules, plain_role, server_settings
from gateway.service.running_rig.starting import (
    StartError,
    cause_of_restart,
    lasting_warnings,
    listen,
    open_again,
    warning_notes,
)
from tests.service.rigs import demo, with_supervision


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
        "none (demo): a command lasts until the next one",
        "mbpoll -1 -p 5020 -r 1 127.0.0.1 1 1200",
        "READY  loop 100 Hz · Ctrl-C ramps the force to 0 and stops · not a safety device",
    ):
        assert words in text
    assert text.splitlines()[-1].startswith("READY")


def test_a_silent_device_is_not_shown_as_zero() -> None:
    text = format_banner(ready(voltage_v=None, force_n=None, notes=("E111 /dev/pts/6: silence at every speed",)))
    assert text.count("silent") == 2
    assert "  note         E111 /dev/pts/6" in text


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
    assert "none: a command lasts until the next one" in format_banner(ready(rig=replace(demo(), simulated=False)))


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


def test_only_a_run_that_never_ended_is_unclean(tmp_path: Path) -> None:
    flag = CleanShutdownMarker(tmp_path)
    assert not flag.mark_running()
    assert CleanShutdownMarker(tmp_path).mark_running(), "the one before was killed"
    flag.clear()
    assert not CleanShutdownMarker(tmp_path).mark_running()
    flag.clear()
    flag.clear()  # twice is no trouble


def test_a_disk_that_does_not_say_how_the_last_run_ended_counts_as_unclean(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: Path) -> bool:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(Path, "exists", refuse)
    assert CleanShutdownMarker(tmp_path).mark_running()


@pytest.mark.parametrize(
    ("restarted", "was_unclean", "cause"),
    [
        (None, False, FaultCode.NONE),
        (None, True, FaultCode.INTERNAL),
        (EndCause.STALLED, True, FaultCode.LOOP_STALLED),
        (EndCause.STOPPED, True, FaultCode.LOOP_STALLED),
        (EndCause.MACHINE_BUSY, True, FaultCode.MACHINE_BUSY),
        (EndCause.DIED, True, FaultCode.INTERNAL),
        (EndCause.DEFECT, False, FaultCode.INTERNAL),
    ],
)
@pytest.mark.parametrize("text", ["control process stalled (SIGKILL)", "mit anderen Worten"])
def test_the_cause_of_an_unclean_end_is_readable_whatever_the_words_are(
    restarted: EndCause | None, was_unclean: bool, cause: FaultCode, text: str
) -> None:
    ending = Ending.from_json(json.loads(json.dumps(Ending(restarted, text).to_json()))) if restarted else None
    assert cause_of_restart(ending, was_unclean=was_unclean) is cause


def test_the_bank_holds_to_the_rigs_limits() -> None:
    rig = demo()
    rig = replace(rig, network=replace(rig.network, owner="10.0.0.7", require_byte_order_echo=True))
    rules = bank_rules(rig)
    limits = rig.control.limits
    assert (rules.rig_name, rules.force_max_n) == ("demo", limits.force_max_n)
    assert (rules.voltage_min_v, rules.voltage_max_v) == (limits.voltage_min_v, limits.voltage_max_v)
    assert rules.cell_range_n == rig.load_cell.range_n
    assert rules.supported_bits == rig.supported_bits
    assert (rules.owner, rules.require_byte_order_echo) == ("10.0.0.7", True)


def test_the_server_holds_to_the_rigs_network() -> None:
    rig = demo()
    network = replace(rig.network, units=(7,), connections=3, per_address=2, idle_s=9.0, requests_per_s=11.0)
    network = replace(network, allow=(ip_network("10.0.0.0/8"),))
    settings = server_settings(replace(rig, network=network))
    assert (settings.units, settings.connections, settings.per_address) == ((7,), 3, 2)
    assert (settings.idle_s, settings.requests_per_s, settings.allow) == (9.0, 11.0, network.allow)


@pytest.mark.parametrize(("is_allowed", "role"), [(True, Role.CALIBRATION), (False, Role.SETPOINT)])
def test_a_plain_face_has_the_role_that_the_rig_gives_it(is_allowed: bool, role: Role) -> None:
    rig = demo()
    rig = replace(rig, network=replace(rig.network, allow_plain_upload=is_allowed))
    assert (plain_role(rig), server_settings(rig).role) == (role, role)


def test_a_disk_that_takes_no_mark_is_no_reason_not_to_begin(tmp_path: Path) -> None:
    assert not CleanShutdownMarker(tmp_path / "gone").mark_running()


def test_a_device_without_a_watchdog_and_a_coarse_clock_are_warned_of_for_good() -> None:
    device = SimpleNamespace(name="a DAC")
    without, armed = (
        cast(Rig, SimpleNamespace(lacks_device_watchdog=lacks, output=SimpleNamespace(device=device)))
        for lacks in (True, False)
    )
    assert lasting_warnings(without, is_coarse_clock=True) == WarningBit.CLOCK_FALLBACK | WarningBit.NO_WATCHDOG
    assert lasting_warnings(without, is_coarse_clock=False) == WarningBit.NO_WATCHDOG
    assert lasting_warnings(armed, is_coarse_clock=False) == WarningBit(0)
    (note,) = warning_notes(without)
    assert note.startswith("A343 a DAC has no watchdog: it holds its last voltage")
    assert warning_notes(armed) == ()


class HeldPort:
    """A port that fails with these codes, one at each try."""

    path = "/dev/ttyUSB7"

    def __init__(self, *codes: str) -> None:
        self.codes, self.tries = iter(codes), 0
        self.lost: list[str] = []

    async def open(self) -> None:
        self.tries += 1
        if code := next(self.codes, ""):
            raise PortError(code, "no")

    def begin_lost(self, error: PortError) -> None:
        self.lost.append(error.code)


@pytest.mark.parametrize(("codes", "tries", "lost"), [((), 1, []), (("E103", "E103"), 3, []), (("E102",), 1, ["E102"])])
def test_after_a_restart_a_port_that_is_held_is_waited_for_and_one_that_is_away_is_lost(
    codes: tuple[str, ...], tries: int, lost: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(starting, "_RETRY_S", 0.0)
    port = HeldPort(*codes)
    error = asyncio.run(open_again(port))  # type: ignore[arg-type]
    assert (port.tries, port.lost, error and error.code) == (tries, lost, lost[0] if lost else None)


def test_after_a_restart_too_a_permission_that_is_missing_is_an_end() -> None:
    """Waiting does not change it: the sentence says what does."""
    port = HeldPort("E101")
    with pytest.raises(PortError, match="E101"):
        asyncio.run(open_again(port))  # type: ignore[arg-type]
    assert port.lost == []


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (PermissionError(13, "Permission denied"), exit_codes.PERMISSION, "E120 port 502 needs the capability"),
        (OSError(errno.EADDRINUSE, "Address already in use"), exit_codes.DEVICE, "E121 cannot listen on"),
        (OSError(errno.EADDRNOTAVAIL, "Cannot assign"), exit_codes.DEVICE, "is no address of this machine"),
    ],
)
def test_who_cannot_listen_ends_with_a_sentence_and_by_its_kind(error: OSError, code: int, words: str) -> None:
    class Server:
        async def start(self, host: str, port: int) -> None:
            raise error

    with pytest.raises(StartError, match=words) as refused:
        asyncio.run(listen(Server(), "192.0.2.1", 502))  # type: ignore[arg-type]
    assert refused.value.exit_code == code
