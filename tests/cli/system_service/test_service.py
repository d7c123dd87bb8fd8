"""The unit is what systemd accepts and judges safe; nothing is written but what is said."""

import os
import re
import shutil
import subprocess
from dataclasses import replace
from functools import partial
from ipaddress import ip_network
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gateway.cli.errors import CliError
from gateway.cli.main import command
from gateway.cli.system_service import installation
from gateway.cli.system_service.installation import plan_installation
from gateway.cli.system_service.unit_file import UnitOptions, device_classes, unit_text
from gateway.cli.system_service.unit_status import parse_status
from gateway.processes import exit_codes
from gateway.profiles import Rig, load_rig
from gateway.profiles.http_sections import Metrics, Web
from gateway.profiles.rigs.faces import TlsFace
from gateway.profiles.telemetry_sections import Mqtt

ANALYZE = shutil.which("systemd-analyze")
needs_systemd = pytest.mark.skipif(ANALYZE is None, reason="systemd-analyze is not here: nobody judges the unit")


def gateway(*words: str | Path) -> Result:
    return CliRunner().invoke(command, [*map(str, words)])


def options(**others: object) -> UnitOptions:
    facts = {"command": Path("/usr/bin/true"), "rig": "irc5-cell", "stem": "irc5-cell", "ports": (5020,)} | others
    return UnitOptions(**facts)  # type: ignore[arg-type]


def exposure(text: str, folder: Path) -> float:
    unit = folder / "force-gateway-x.service"
    unit.write_text(text)
    done = subprocess.run(
        [str(ANALYZE), "security", "--offline=true", "--no-pager", str(unit)],
        capture_output=True,
        text=True,
        check=False,
    )
    found = re.search(r"Overall exposure level for .*: ([0-9.]+)", done.stdout)
    assert found, done.stdout + done.stderr
    return float(found[1])


@needs_systemd
@pytest.mark.parametrize("compiles", [False, True])
def test_systemd_judges_the_unit_with_its_devices_at_most_1_5(tmp_path: Path, compiles: bool) -> None:
    assert exposure(unit_text(options(devices=("/dev/ttyUSB0",), compiles=compiles)), tmp_path) <= 1.5


@needs_systemd
def test_systemd_understands_every_line(tmp_path: Path) -> None:
    unit = tmp_path / "force-gateway-x.service"
    unit.write_text(unit_text(options(ports=(502,), devices=("/dev/ttyUSB0",), networks=("192.168.125.0/24",))))
    done = subprocess.run([str(ANALYZE), "verify", str(unit)], capture_output=True, text=True, check=False)
    assert str(unit) not in done.stderr, done.stderr


@needs_systemd
def test_systemd_reads_any_path_as_it_is_written(tmp_path: Path) -> None:
    program = tmp_path / "100%n" / "force gateway"
    program.parent.mkdir()
    program.symlink_to("/usr/bin/true")
    unit = tmp_path / "force-gateway-x.service"
    unit.write_text(unit_text(options(command=program, rig=f"{tmp_path}/50% $HOME it's/cell.yaml")))
    done = subprocess.run([str(ANALYZE), "verify", str(unit)], capture_output=True, text=True, check=False)
    assert "is not executable" not in done.stderr, done.stderr
    assert str(unit) not in done.stderr, done.stderr
    assert "/50%% $$HOME it's/cell.yaml\"" in unit.read_text()


def test_a_rig_whose_file_cannot_name_a_unit_is_refused(tmp_path: Path) -> None:
    rig = Path("/etc/force-gateway/my cell.yaml")
    plan = partial(plan_installation, rig=load_rig("demo"), networks=(), command=Path("/opt/force-gateway"))
    with pytest.raises(CliError, match=r"E107 .*my cell\.yaml: its name names the unit"):
        plan(str(rig))


def test_a_port_of_a_cabinet_is_allowed_by_its_class_and_one_by_id_as_any_usb_adapter() -> None:
    assert device_classes(("/dev/ttyS0", "/dev/ttyS1", "/dev/ttyAMA0")) == ["char-ttyS", "char-ttyAMA"]
    assert device_classes(("/dev/ttymxc2",)) == ["char-ttymxc"], (
        "of an i.MX: as an adapter's it was refused to the service"
    )
    assert device_classes(("/dev/serial/by-id/usb-FTDI-port0",)) == ["char-ttyUSB", "char-ttyACM"]


def test_a_port_below_1024_has_the_one_privilege_that_it_needs_and_no_other_rig_has_it() -> None:
    assert "AmbientCapabilities=CAP_NET_BIND_SERVICE\n" in unit_text(options(ports=(502,)))
    assert "AmbientCapabilities=\n" in unit_text(options())


def test_no_exit_code_that_says_it_would_fail_again_starts_it_again() -> None:
    assert "RestartPreventExitStatus=2 65 77 78\n" in unit_text(options())


def test_a_device_that_comes_an_hour_late_finds_the_gateway_still_trying() -> None:
    """`run` ends where a port is absent; with a bound on starts the unit stayed off for good."""
    text = unit_text(options())
    assert "\nStartLimitIntervalSec=0\n" in text and "StartLimitBurst" not in text
    pause_s = float(text.partition("\nRestartSec=")[2].partition("\n")[0])
    assert pause_s >= 10.0, "each start costs a second of processor and two lines of the journal"
    assert str(exit_codes.DEVICE) not in text.partition("\nRestartPreventExitStatus=")[2].partition("\n")[0].split()


def test_a_dry_run_shows_the_unit_of_the_rig_and_writes_nothing(tmp_path: Path) -> None:
    done = gateway(
        "service", "install", "irc5-cell", "--dry-run", "--root", tmp_path, "--command", "/opt/force-gateway"
    )
    assert done.exit_code == 0, done.stderr
    assert "ExecStart=/opt/force-gateway run irc5-cell --state %S/force-gateway/irc5-cell" in done.stdout
    assert "IPAddressAllow=localhost 192.168.125.0/24" in done.stdout, "as the rig's own `allow` says"
    assert not any(tmp_path.iterdir())


def test_an_image_gets_the_files_and_one_unit_a_rig(tmp_path: Path) -> None:
    for rig in ("irc5-cell", "demo"):
        assert gateway("service", "install", rig, "--root", tmp_path, "--command", "/opt/force-gateway").exit_code == 0
    units = sorted(path.name for path in (tmp_path / "etc/systemd/system").iterdir())
    assert units == ["force-gateway-demo.service", "force-gateway-irc5-cell.service"]
    assert gateway("service", "uninstall", "demo", "--root", tmp_path).exit_code == 0
    again = gateway("service", "uninstall", "demo", "--root", tmp_path)
    assert again.exit_code == 65 and "E107" in again.stderr and "force-gateway-irc5-cell.service" in again.stderr


@pytest.mark.parametrize(
    ("target", "told"), [("/dev/null", "unmask force-gateway-demo.service"), ("mine", "a link to mine")]
)
def test_a_unit_that_is_masked_or_linked_by_somebody_is_left_alone(tmp_path: Path, target: str, told: str) -> None:
    units = tmp_path / "etc/systemd/system"
    units.mkdir(parents=True)
    (units / "force-gateway-demo.service").symlink_to(target)
    result = gateway("service", "install", "demo", "--root", tmp_path, "--command", "/usr/bin/true")
    assert result.exit_code == exit_codes.CONFIGURATION and told in result.output
    assert [str(path.readlink()) for path in tmp_path.rglob("*") if not path.is_dir()] == [target]


def test_a_service_with_a_dot_in_its_name_is_not_another_one(tmp_path: Path) -> None:
    """`uninstall cell-1.2` stopped and removed cell-1, whose force went with it."""
    units = tmp_path / "etc/systemd/system"
    units.mkdir(parents=True)
    for stem in ("cell-1", "cell-1.2"):
        (units / f"force-gateway-{stem}.service").write_text("")
    result = gateway("service", "uninstall", "cell-1.2", "--root", tmp_path)
    assert result.exit_code == exit_codes.OK, result.output
    assert [path.name for path in units.iterdir()] == ["force-gateway-cell-1.service"]
    assert "/var/lib/force-gateway/cell-1.2 stays" in result.output


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("nowhere",), 78, "nowhere"),
        (("irc5-cell", "--command", "/home/me/venv/bin/force-gateway"), 78, "E107 /home/me/venv/bin/force-gateway"),
        (("irc5-cell", "--command", "/tmp/venv/bin/force-gateway"), 78, "E107 /tmp/venv/bin/force-gateway"),
        (("irc5-cell", "--command", "/opt/x\nExecStartPre=/bin/rm"), 78, "E107"),
        (("irc5-cell", "--command", "/opt/$x/force-gateway"), 78, "E107 /opt/$x/force-gateway: systemd starts no"),
        (("irc5-cell", "--command", "/opt/x", "--allow", "10.0.0.0/8 any"), 78, "E107 --allow 10.0.0.0/8 any"),
        (("demo", "--allow"), 2, "--allow"),
    ],
)
def test_what_cannot_work_is_refused_before_anything_is_written(
    tmp_path: Path, words: tuple[str, ...], code: int, said: str
) -> None:
    done = gateway("service", "install", *words[:1], "--root", tmp_path, *words[1:])
    assert (done.exit_code, said in done.stderr) == (code, True), done.stderr
    assert not any(tmp_path.iterdir())


RUNNING = (
    "ActiveState=active\nActiveEnterTimestamp=Mon 2026-11-23 05:00:00 UTC\nNRestarts=1\nStatusText=rig demo, x=1\n"
)
FAILED = "ActiveState=failed\nNRestarts=0\nResult=exit-code\nExecMainStatus=78\n"


def test_the_status_is_a_sentence() -> None:
    runs, failed = parse_status("a.service", RUNNING), parse_status("a.service", FAILED)
    assert runs.is_running and not failed.is_running
    assert runs.sentence == "a.service: runs since Mon 2026-11-23 05:00:00 UTC, started again 1 time; rig demo, x=1"
    assert failed.sentence == "a.service: failed (exit-code, exit code 78); force-gateway service logs shows why"
    missing = parse_status("a.service", "LoadState=not-found\nActiveState=inactive\nResult=success\n")
    assert not missing.is_running and missing.sentence.startswith("a.service: there is no such unit;"), "no success"


def test_a_service_that_runs_goes_on_and_it_is_said_what_takes_the_new_unit(monkeypatch: pytest.MonkeyPatch) -> None:
    """systemd starts nothing again: the gateway ran with the rig and the networks of before, and was said to run."""
    asked: list[str] = []

    def answer(words: tuple[str, ...], *, quiet: bool = False) -> str:
        asked.append(" ".join(words))
        return state + "\n" if words[1] == "is-active" else ""

    monkeypatch.setattr(installation, "run_command", answer)
    plan = installation.Installation("force-gateway-x.service", {}, (("systemctl", "enable", "--now", "x"),))
    state = "inactive"
    assert installation.install_service(plan, Path("/")) == ([], False)
    state = "active"
    asked.clear()
    assert installation.install_service(plan, Path("/")) == ([], True)
    assert asked == ["systemctl is-active force-gateway-x.service", "systemctl enable --now x"]
    monkeypatch.setattr(installation, "plan_installation", lambda *_, **__: plan)
    assert "systemctl restart force-gateway-x.service takes what is new" in gateway("service", "install", "demo").stdout


def test_the_logs_are_shown_as_they_are_told_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`service status` names `service logs`, which was no command without a rig; and of `--since -1h` h was taken for help."""
    shown: list[list[str]] = []
    monkeypatch.setattr(os, "execvp", lambda program, words: shown.append(words[1:]))
    monkeypatch.setattr(installation, "UNITS", str(tmp_path))
    assert gateway("service", "logs").exit_code == exit_codes.DATA, "none is installed"
    for rig in ("a", "b"):
        (tmp_path / f"force-gateway-{rig}.service").touch()
    both = ["--unit", "force-gateway-a.service", "--unit", "force-gateway-b.service"]
    for words in (
        (),
        ("-f",),
        ("FORCE_GATEWAY_CODE=A310",),
        ("--since", "-1h"),
        ("a.yaml", "-f"),
        ("a", "--since", "-1h"),
    ):
        assert gateway("service", "logs", *words).exit_code == 0
    assert shown == [
        both,
        [*both, "-f"],
        [*both, "FORCE_GATEWAY_CODE=A310"],
        [*both, "--since", "-1h"],
        [*both[:2], "-f"],
        [*both[:2], "--since", "-1h"],
    ]


def planned(rig: Rig, *networks: str, name: str = "demo") -> str:
    plan = plan_installation(name, rig, networks=networks, command=Path("/opt/force-gateway"))
    return plan.files[f"etc/systemd/system/{plan.unit}"]


def allowed(rig: Rig, *networks: str) -> str:
    return next(line for line in planned(rig, *networks).splitlines() if line.startswith("IPAddressAllow="))


def test_whoever_a_tls_face_lets_in_is_let_in_by_the_kernel() -> None:
    """Its list is its own: a rig without plain Modbus TCP was reached by nobody but this machine."""
    face = TlsFace(type="tls", certificate="/x", key="/y", ca="/z", allow=(ip_network("10.1.0.0/16"),))
    assert allowed(replace(load_rig("demo"), fieldbus=(face,))) == "IPAddressAllow=localhost 10.1.0.0/16"
    both = allowed(replace(load_rig("irc5-cell"), fieldbus=(face,)))
    assert both == "IPAddressAllow=localhost 192.168.125.0/24 10.1.0.0/16"


def test_a_broker_is_reached_and_this_machine_also_where_others_are_given() -> None:
    rig = replace(load_rig("demo"), mqtt=Mqtt(host="192.0.2.7"))
    assert allowed(rig) == "IPAddressAllow=localhost 192.0.2.7"
    assert allowed(rig, "10.0.0.0/8") == "IPAddressAllow=localhost 10.0.0.0/8 192.0.2.7"
    assert allowed(replace(rig, mqtt=Mqtt(host="localhost"))) == "IPAddressAllow=localhost"
    named = replace(rig, mqtt=Mqtt(host="broker.example"))
    with pytest.raises(CliError, match=r"E107 mqtt\.host broker\.example is a name"):
        allowed(named)
    assert allowed(named, "10.0.0.0/8") == "IPAddressAllow=localhost 10.0.0.0/8"


def test_a_rig_by_the_name_of_its_file_here_is_told_to_the_service_by_its_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The service has another working directory: it would have ended at once, without such a rig."""
    (tmp_path / "cell.yaml").write_text("name: cell\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(installation, "_HIDDEN", ())
    assert f" run {tmp_path}/cell.yaml --state %S/force-gateway/cell\n" in planned(load_rig("demo"), name="cell")


def test_a_diagnosis_of_the_page_may_compile_and_without_page_and_watch_nothing_may() -> None:
    """It ended with `cannot allocate executable memory` on every rig of real devices."""
    rig = replace(load_rig("irc5-cell"), web=None)
    assert not rig.is_watched
    denied = "\nMemoryDenyWriteExecute=yes\n"
    assert denied in planned(rig) and denied not in planned(replace(rig, web=Web()))


def test_a_secret_file_that_the_service_cannot_see_is_refused() -> None:
    rig = replace(load_rig("demo"), mqtt=Mqtt(host="127.0.0.1", password_file="/home/me/password"))
    with pytest.raises(CliError, match="E107 /home/me/password: the service sees nothing below /home"):
        planned(rig)


def test_an_address_of_its_own_is_waited_for_and_one_that_is_always_there_is_not() -> None:
    """Five starts before the network is up, and the service stayed off behind a loss of power."""
    rig = load_rig("demo")
    own = planned(replace(rig, network=replace(rig.network, bind="192.0.2.1")))
    assert "Wants=network-online.target\nAfter=network-online.target\n" in own
    assert "Wants=network-online.target" in planned(replace(rig, metrics=Metrics(listen="192.0.2.1:9000")))
    for bind in ("0.0.0.0", "127.0.0.1", "::"):
        assert "\nAfter=network.target\n" in planned(replace(rig, network=replace(rig.network, bind=bind)))
