"""What the unit asks of the kernel for all processes of a gateway: their turns, and what follows where memory runs out."""

import json
import os
import re
import resource
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from gateway import profiles
from gateway.cli.errors import CliError
from gateway.cli.main import command
from gateway.cli.system_service import installation, unit_status
from gateway.cli.system_service.installation import install_service, plan_installation
from gateway.cli.system_service.unit_file import UnitOptions, unit_text
from gateway.cli.system_service.unit_status import parse_status
from gateway.processes import exit_codes
from gateway.processes.scheduling import priority
from gateway.profiles import load_rig
from gateway.profiles.http_sections import Metrics, OpcUa, Web
from gateway.profiles.recordings_section import Retention

UNIT = unit_text(UnitOptions(command=Path("/usr/bin/true"), rig="irc5-cell", stem="irc5-cell"))


def setting(name: str, default: str) -> str:
    found = re.findall(rf"^{name}=(.*)$", UNIT, re.M)
    return str(found[-1]) if found else default


def test_control_comes_before_other_programs_though_the_process_that_forks_it_does_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The unit's Nice is that of the guardian; the kernel lets nobody take it again who has given it up, without privileges and
    without a limit that says so: the loop of a service had the turns of any program."""
    has, lowest = [int(setting("Nice", "0"))], int(setting("LimitNICE", "20"))

    def set_to(which: int, who: int, nice: int) -> None:
        if nice < has[0] and nice < lowest:
            raise PermissionError
        has[0] = nice

    monkeypatch.setattr(os, "setpriority", set_to)
    monkeypatch.setattr(os, "getpriority", lambda which, who: has[0])
    monkeypatch.setattr(resource, "getrlimit", lambda which: (20 - lowest,) * 2)
    assert priority.set_nice(0) == 0, "the fork server"
    assert priority.set_nice(priority.LOOP_NICE) == priority.LOOP_NICE, "control"


def test_a_stop_leaves_control_its_last_write() -> None:
    """By any other way systemd kills whoever is left as soon as the guardian is gone."""
    assert setting("KillMode", "control-group") == "control-group"


def test_a_loop_that_stands_still_is_started_anew_by_systemd() -> None:
    """Who says nothing to it is killed: without a watchdog a guardian that hangs would hang for good."""
    assert (setting("Type", "simple"), setting("NotifyAccess", "none")) == ("notify", "main")
    assert 1.0 < float(setting("WatchdogSec", "inf")) <= 30.0 and setting("Restart", "no") == "always"


@pytest.mark.parametrize(("port", "needs"), [(0, False), (1, True), (502, True), (1023, True), (1024, False)])
def test_only_a_port_below_1024_needs_a_privilege(port: int, needs: bool) -> None:
    text = unit_text(UnitOptions(command=Path("/usr/bin/true"), rig="demo", stem="demo", ports=(5020, port)))
    assert ("CAP_NET_BIND_SERVICE" in text) == needs and ("PrivateUsers=yes" in text) != needs


def test_whoever_reads_a_unit_meanwhile_reads_the_old_one_to_its_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Half a unit of a disk that was full has no end of its settings, and starts a gateway that may do anything."""
    plan = plan_installation("demo", load_rig("demo"), networks=(), command=Path("/opt/force-gateway"))
    install_service(plan, tmp_path)
    write, written = Path.write_text, list[str]()

    def note(path: Path, text: str, **how: Any) -> int:
        written.append(path.name)
        return write(path, text, **how)

    monkeypatch.setattr(Path, "write_text", note)
    install_service(plan, tmp_path)
    there = [path.name for path in tmp_path.rglob("*") if path.is_file()]
    assert len(written) == 3 and not set(written) & set(there)
    assert sorted(there) == sorted(Path(name).name for name in plan.files)


def test_a_unit_that_is_gone_is_gone_for_systemd_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It would be started again by its old text."""
    unit, asked = tmp_path / "force-gateway-cell.service", list[tuple[object, ...]]()
    unit.write_text("[Unit]\n")
    monkeypatch.setattr(installation, "UNITS", str(tmp_path))
    monkeypatch.setattr(installation, "run_command", lambda words, **_: asked.append((*words, unit.exists())))
    installation.uninstall_service("cell", Path("/"))
    assert asked == [
        ("systemctl", "disable", "--now", unit.name, True),
        ("systemctl", "daemon-reload", False),
    ]


def test_a_helper_that_the_kernel_ends_for_want_of_memory_does_not_end_the_gateway() -> None:
    """systemd stops a unit of which it ends anybody unless it is told not to: the force went with the residual watch."""
    assert setting("OOMPolicy", "stop") == "continue"
    assert int(setting("OOMScoreAdjust", "0")) < 0, "another program goes first"


@pytest.mark.parametrize(
    ("listen", "allow", "told"),
    [
        (
            "0.0.0.0:8080",
            (),
            "the page (0.0.0.0:8080) is reached from localhost, 192.168.125.0/24 alone: --allow NETWORK",
        ),
        ("127.0.0.1:8080", (), ""),
        ("192.168.1.5:8080", ("--allow", "10.0.0.0/8"), ""),
    ],
)
def test_who_installs_a_page_for_others_is_told_whom_the_kernel_lets_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, listen: str, allow: tuple[str, ...], told: str
) -> None:
    """By `run` the page was there, by the service it was not, and nothing said why."""
    rig = replace(load_rig("irc5-cell"), web=Web(listen=listen, token="x" * 16))
    monkeypatch.setattr(profiles, "load_rig", lambda name: rig)
    words = ["service", "install", "irc5-cell", "--root", str(tmp_path), "--command", "/opt/force-gateway", *allow]
    done = CliRunner().invoke(command, words)
    assert done.exit_code == 0, done.output
    said = [line for line in done.output.splitlines() if "reached from" in line]
    assert [line.startswith(told) for line in said] == ([True] if told else [])


@pytest.mark.parametrize("days", [None, 90.0])
def test_who_installs_a_service_whose_recordings_nothing_deletes_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, days: float | None
) -> None:
    """A recording that somebody has left on fills the disk within weeks; recordings were said to be bounded."""
    rig = replace(load_rig("irc5-cell"), retention=Retention(days=days))
    monkeypatch.setattr(profiles, "load_rig", lambda name: rig)
    words = ["service", "install", "irc5-cell", "--root", str(tmp_path), "--command", "/opt/force-gateway"]
    said = CliRunner().invoke(command, words).output
    assert ("nothing deletes recordings" in said) is (days is None), said


@pytest.mark.parametrize(
    "face",
    [
        {"web": Web(listen="0.0.0.0:80", token="x" * 16)},
        {"metrics": Metrics(listen="127.0.0.1:900")},
        {"opcua": OpcUa(listen="127.0.0.1:484")},
    ],
)
def test_a_page_below_1024_has_the_privilege_that_it_needs(face: dict[str, Any]) -> None:
    """The service ended with 77 at its first start, and stayed off."""
    rig = load_rig("demo")
    for each, needs in ((rig, False), (replace(rig, **face), True)):
        plan = plan_installation("demo", each, networks=(), command=Path("/opt/force-gateway"))
        unit = plan.files[f"etc/systemd/system/{plan.unit}"]
        assert ("AmbientCapabilities=CAP_NET_BIND_SERVICE\n" in unit) is needs


def test_who_makes_an_image_is_told_that_nothing_begins_at_its_boot_yet(tmp_path: Path) -> None:
    """The unit was there, and nobody had enabled it."""
    words = ["service", "install", "demo", "--root", str(tmp_path), "--command", "/opt/force-gateway"]
    last = CliRunner().invoke(command, words).output.splitlines()[-1]
    assert last == f"not enabled yet: systemctl --root {tmp_path} enable force-gateway-demo.service"


def test_an_end_that_nobody_has_asked_systemd_for_starts_it_again() -> None:
    """`systemctl kill -s HUP`, or a `pkill` that meant another program: the gateway ramps down and ends with 0, which is no
    failure, and stayed off for good. What `systemctl stop` ends stays off with any setting."""
    assert setting("Restart", "no") == "always"
    assert str(exit_codes.OK) not in setting("RestartPreventExitStatus", "").split()


@pytest.mark.parametrize("verb", ["install", "uninstall"])
def test_a_mistyped_root_is_not_made(verb: str, tmp_path: Path) -> None:
    done = CliRunner().invoke(command, ["service", verb, "demo", "--root", str(tmp_path / "imgae")])
    assert done.exit_code == exit_codes.USAGE and "imgae is not there: mkdir -p makes a new one" in done.stderr
    assert not any(tmp_path.iterdir())


def test_the_status_is_told_to_programs_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unit_status, "run_command", lambda words: "ActiveState=active\nNRestarts=1\n")
    done = CliRunner().invoke(command, ["service", "status", "demo", "--json"])
    (told,) = json.loads(done.stdout)
    assert done.exit_code == exit_codes.OK
    assert (told["unit"], told["running"], told["restarts"]) == ("force-gateway-demo.service", True, 1)


@pytest.mark.parametrize("is_booted", [True, False])
def test_a_systemctl_without_systemd_is_told_as_none_is(
    is_booted: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a container `service status` said all that it had asked, and "Failed to connect to bus: Host is down"."""
    systemctl = tmp_path / "systemctl"
    systemctl.write_text("#!/bin/sh\necho 'Failed to connect to bus: Host is down' >&2\nexit 1\n")
    systemctl.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    monkeypatch.setattr(installation, "_BOOTED", tmp_path if is_booted else tmp_path / "none")
    done = CliRunner().invoke(command, ["service", "status", "demo"])
    assert ("Host is down" in done.stderr) is is_booted
    assert done.stderr.startswith("E108 systemd does not run on this machine: without systemd") is not is_booted
    assert done.exit_code == (exit_codes.FAILED if is_booted else exit_codes.DEVICE)


def test_the_command_that_root_is_told_to_give_is_one_that_can_be_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By `python -m gateway` it was 'sudo .../gateway/__main__.py', which no shell runs."""

    def refuse(self: Path, *arguments: Any, **named: Any) -> None:
        raise PermissionError(13, "Permission denied", str(self))

    monkeypatch.setattr(sys, "argv", ["/clone/gateway/__main__.py", "service", "install", "irc5-cell"])
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    (tmp_path / "force-gateway").touch()
    monkeypatch.setattr(Path, "write_text", refuse)
    plan = installation.Installation("force-gateway-x", {"etc/x.service": "[Unit]"}, (), (), (), None)
    with pytest.raises(CliError) as caught:
        installation.install_service(plan, tmp_path)
    assert f"; sudo {tmp_path}/force-gateway service install irc5-cell, or " in caught.value.message


@pytest.mark.parametrize(
    ("result", "status", "told"),
    [("exit-code", "78", "exit-code, exit code 78"), ("signal", "9", "signal"), ("oom-kill", "9", "oom-kill")],
)
def test_only_an_exit_code_is_told_as_one(result: str, status: str, told: str) -> None:
    """Of a signal systemd has its number there."""
    shown = f"LoadState=loaded\nActiveState=failed\nNRestarts=0\nResult={result}\nExecMainStatus={status}\n"
    assert parse_status("a.service", shown).sentence.startswith(f"a.service: failed ({told}); ")
