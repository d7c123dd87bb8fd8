"""What a start says and leaves behind: the flag of an unclean run, the rules for the bank."""

import asyncio
import errno
import json
import os
from collections.abc import Callable, Coroutine
from dataclasses import replace
from ipaddress import ip_network
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.warning_bits import WarningBit
from gateway.modbus import Role
from gateway.ports import PortError
from gateway.processes import exit_codes
from gateway.processes.exit_cause import EndCause, Ending
from gateway.profiles import Rig
from gateway.service.clean_shutdown_marker import CleanShutdownMarker
from gateway.service.running_rig import starting
from gateway.service.running_rig.bank_rules import bank_rules, plain_role, server_settings
from gateway.service.running_rig.handover import left_of
from gateway.service.running_rig.lines.rig_ports import RigPorts
from gateway.service.running_rig.starting import (
    StartError,
    cause_of_restart,
    lasting_warnings,
    listen,
    open_again,
    open_first,
    waiting_s,
    warning_notes,
    why_silent,
)
from tests.service.rigs import demo

Opens = Callable[[Any], Coroutine[Any, Any, Any]]


def test_only_a_run_that_never_ended_is_unclean(tmp_path: Path) -> None:
    flag = CleanShutdownMarker(tmp_path)
    assert not flag.mark_running()
    assert CleanShutdownMarker(tmp_path).mark_running(), "the one before was killed"
    flag.clear()
    assert not CleanShutdownMarker(tmp_path).mark_running()
    flag.clear()
    flag.clear()  # twice is no trouble


def test_a_run_whose_end_cannot_be_known_is_unclean(tmp_path: Path) -> None:
    """Whatever pressed may press still: a disk that gives no answer is no word that it has ended."""
    assert CleanShutdownMarker(tmp_path / ("x" * 300)).mark_running(), "its name is refused as too long"


def test_what_a_clean_end_leaves_counts_at_the_next_start_until_the_next_clean_end(tmp_path: Path) -> None:
    """A fault of a program that hung was restarted away, and its next frame pressed."""
    flag, left = CleanShutdownMarker(tmp_path), {"lost_beats": {"10.0.0.5": [7]}, "held_runs": {"10.0.0.6": 32}}
    assert flag.left == {}
    flag.clear({**left})
    assert CleanShutdownMarker(tmp_path).left == left and (tmp_path / "left.json").stat().st_mode & 0o777 == 0o600
    for content in ("", "[]", "{", "[" * 100_000):
        (tmp_path / "left.json").write_text(content)
        assert flag.left == {}, content[:9]
    flag.clear()
    assert not (tmp_path / "left.json").exists()
    CleanShutdownMarker(tmp_path / "gone").clear(left)  # a disk that does not take it is no reason not to end


def test_an_end_that_could_not_store_who_had_hung_is_an_unclean_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: Any) -> None:
        raise OSError(errno.ENOSPC, "full")

    flag = CleanShutdownMarker(tmp_path)
    assert not flag.mark_running()
    with monkeypatch.context() as full:
        full.setattr("gateway.processes.durable_file.write_whole", refuse)
        flag.clear({"lost_beats": {"10.0.0.5": [7]}})
    assert flag.mark_running()
    flag.clear()
    assert not flag.mark_running(), "with nothing to store nothing is missing"


@pytest.mark.parametrize(
    ("kept", "left"),
    [
        ({}, {}),
        ({"zero_n": 1.0, "owner": "10.0.0.5", "recording": None, "lost_beats": {}}, {}),
        (
            {"held_runs": {"a": 32}, "lost_beats": {"a": [0]}, "plant": 3},
            {"held_runs": {"a": 32}, "lost_beats": {"a": [0]}},
        ),
        (
            {"held_runs": {"a": 32.0}, "lost_beats": {"a": True}, "held_enables": {"a": 1.5}},
            {"held_enables": {"a": 1.5}},
        ),
        ({"held_runs": [1], "lost_beats": {"a": None}, "held_enables": "x"}, {}),
        ({"lost_beats": {"a": [7], "b": [[8]]}}, {}),
    ],
)
def test_by_what_nothing_begins_alone_is_left_behind_a_clean_end(kept: dict[str, Any], left: dict[str, Any]) -> None:
    assert left_of(kept) == left


def test_a_disk_that_does_not_say_how_the_last_run_ended_counts_as_unclean(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: Path) -> os.stat_result:
        raise OSError(errno.EIO, "Input/output error")

    marker = CleanShutdownMarker(tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr(os, "stat", refuse)
        assert marker.mark_running()


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
    limits = replace(rig.control.limits, voltage_min_v=0.5, safe_voltage_v=0.5)
    rules = bank_rules(rig := replace(rig, control=replace(rig.control, limits=limits)))
    assert (rules.rig_name, rules.force_max_n) == ("demo", limits.force_max_n)
    assert (rules.voltage_min_v, rules.voltage_max_v) == (limits.voltage_min_v, limits.voltage_max_v)
    assert rules.payload_max_kg == pytest.approx(rig.load_cell.range_n / 9.80665)
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


OPENS: tuple[Opens, ...] = (lambda port: open_first(port.open), open_again)


@pytest.mark.parametrize("opens", OPENS)
def test_a_permission_that_comes_a_moment_behind_the_name_is_waited_for(
    opens: Opens, monkeypatch: pytest.MonkeyPatch
) -> None:
    """udev gives it some milliseconds after the kernel has given the name: a service that began between them ended with 77, and
    systemd does not start again what ends so. A cabinet that was switched on an hour later found no gateway for good."""
    monkeypatch.setattr(starting, "_RETRY_S", 0.0)
    port = HeldPort("E101", "E101")
    asyncio.run(opens(port))
    assert (port.tries, port.lost) == (3, [])


def test_a_first_start_of_a_rig_waits_for_the_permission_of_each_of_its_ports() -> None:
    ports = RigPorts.__new__(RigPorts)
    held = ports.output, ports.cell, ports.valve = HeldPort("E101"), HeldPort(), HeldPort("E101")  # type: ignore[assignment]
    asyncio.run(ports.open(is_restart=False))
    assert [port.tries for port in held] == [2, 1, 2]


@pytest.mark.parametrize("opens", OPENS)
def test_a_permission_that_is_missing_is_an_end_at_each_start(opens: Opens, monkeypatch: pytest.MonkeyPatch) -> None:
    """Waiting longer does not change it: the sentence says what does."""
    monkeypatch.setattr(starting, "_HELD_BOUND_S", 0.02)
    monkeypatch.setattr(starting, "_RETRY_S", 0.005)
    port = HeldPort(*["E101"] * 1000)
    with pytest.raises(PortError, match="E101"):
        asyncio.run(opens(port))
    assert port.lost == [] and port.tries < 1000


def test_a_port_that_stays_held_is_lost_behind_a_restart(monkeypatch: pytest.MonkeyPatch) -> None:
    """The rig goes on without it; who waited for ever told its masters nothing."""
    monkeypatch.setattr(starting, "_HELD_BOUND_S", 0.02)
    monkeypatch.setattr(starting, "_RETRY_S", 0.005)
    port = HeldPort(*["E103"] * 1000)
    error = asyncio.run(open_again(port))  # type: ignore[arg-type]
    assert (error and error.code, port.lost) == ("E103", ["E103"]) and port.tries < 1000


@pytest.mark.parametrize("code", ["E102", "E103"])
def test_a_port_that_is_away_or_held_ends_the_first_start_at_once(code: str) -> None:
    port = HeldPort(code)
    with pytest.raises(PortError, match=code):
        asyncio.run(open_first(port.open))
    assert (port.tries, port.lost) == (1, [])


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (PermissionError(13, "Permission denied"), exit_codes.PERMISSION, "E120 port 502 needs the capability"),
        (
            OSError(errno.EADDRINUSE, "Address already in use"),
            exit_codes.DEVICE,
            "1:502: Address already in use; another program .*`ss -ltnp`",
        ),
        (OSError(errno.EADDRNOTAVAIL, "Cannot assign"), exit_codes.DEVICE, "is no address of this machine"),
        (OSError(errno.EMFILE, "Too many open files"), exit_codes.DEVICE, "Too many open files; .*LimitNOFILE"),
    ],
)
def test_who_cannot_listen_ends_with_a_sentence_and_by_its_kind(error: OSError, code: int, words: str) -> None:
    class Server:
        async def start(self, host: str, port: int) -> None:
            raise error

    with pytest.raises(StartError, match=words) as refused:
        asyncio.run(listen(Server(), "192.0.2.1", 502))  # type: ignore[arg-type]
    assert refused.value.exit_code == code


def test_behind_a_restart_masters_wait_no_second_for_a_device_that_is_silent() -> None:
    assert waiting_s(is_restart=True) <= 1.0 < waiting_s(is_restart=False)


@pytest.mark.parametrize(("is_restart", "words"), [(True, "0.5 s of the restart"), (False, "3 s of the start")])
def test_where_the_machine_is_to_blame_no_port_is_closed_to_listen_at_other_speeds(
    is_restart: bool, words: str
) -> None:
    """Nobody would hear the device meanwhile, which is silent for no reason of its own."""
    port = HeldPort()
    sentence = asyncio.run(why_silent(port, demo().output, "the machine slept", 0.0, is_restart=is_restart))  # type: ignore[arg-type]
    assert sentence == f"E111 {port.path}: nothing heard within {words}; the machine slept"
