"""What `service install` writes, and what it asks systemd for: a plan first, so that it can be shown and then done.

Files go below a root, which is `/` on a running machine, and a folder where an image is built; only on `/` is systemd asked
for anything.
"""

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from ipaddress import ip_address, ip_network
from pathlib import Path
from typing import TYPE_CHECKING, Final

from gateway.cli.errors import CliError
from gateway.cli.system_service import unit_file
from gateway.cli.system_service.user_access import refuse_closed_program, refuse_unreadable
from gateway.plain_file import exists, is_directory
from gateway.processes import exit_codes
from gateway.profiles.find import list_shipped, locate, shipped_profiles_folder
from gateway.profiles.http_sections import split_listen
from gateway.profiles.rigs.faces import RtuFace, TlsFace
from gateway.service.supervisor.run_options import stem_of

if TYPE_CHECKING:
    from gateway.profiles import Rig

UNITS: Final = "etc/systemd/system"
_BEFORE_ENABLE: Final = (
    ("systemd-sysusers", "force-gateway.conf"),
    ("udevadm", "control", "--reload"),
    ("udevadm", "trigger", "--subsystem-match=tty"),
    ("systemctl", "daemon-reload"),
)
_HIDDEN: Final = ("/home", "/root", "/run/user", "/tmp", "/var/tmp")
_STEM: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")
_NOT_OF_PROGRAMS: Final = frozenset("'\"\\$*?[")  # what systemd takes in no path of a program
_RIG_OF_UNIT: Final = re.compile(r"^ExecStart=.* run (.+) --state ", re.M)
_BOOTED: Final = Path("/run/systemd/system")  # sd_booted(3): in a container a systemctl may have nobody to ask
_WITHOUT: Final = "without systemd the gateway runs by `force-gateway run`, in a container or under another supervisor"
_NAMED_NETWORKS: Final = ("any", "localhost", "link-local", "multicast")


@dataclass(frozen=True, slots=True)
class Installation:
    """files: path below the root -> text; commands: what is run behind them, in order; notes: what to know of it besides;
    reads: files that the service's user must be able to read; program: what it must be able to run."""

    unit: str
    files: dict[str, str]
    commands: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()
    reads: tuple[str, ...] = ()
    program: Path | None = None


def plan_installation(rig_name: str, rig: "Rig", *, networks: Sequence[str], command: Path | None) -> Installation:
    """Return the plan for a rig that `check` has accepted. CliError E107 where the service could not run it."""
    program = (command or _own_command()).absolute()
    is_file = rig_name not in list_shipped("rig")
    named = _path_of(rig_name) if is_file else rig_name
    _refuse_hidden(
        str(program if command else sys.executable), str(program), *([named] if is_file else []), *_files_of(rig)
    )
    if not _NOT_OF_PROGRAMS.isdisjoint(str(program)):
        raise CliError(f"E107 {program}: systemd starts no program with such a path", exit_codes.CONFIGURATION)
    if not _STEM.fullmatch(stem := stem_of(named)):
        raise CliError(f"E107 {named}: its name names the unit: letters, digits, _ . - only", exit_codes.CONFIGURATION)
    _refuse_no_networks(networks)
    options = unit_file.UnitOptions(
        command=program,
        rig=named,
        stem=stem,
        ports=_ports_of(rig),
        devices=_devices_of(rig),
        networks=_networks_of(rig, networks),
        compiles=rig.is_watched or rig.web is not None,
        waits_for_network=any(map(_is_own_address, _addresses_of(rig))),
    )
    return Installation(
        options.name,
        {
            f"{UNITS}/{options.name}": unit_file.unit_text(options),
            "etc/sysusers.d/force-gateway.conf": unit_file.sysusers_text(),
            "etc/udev/rules.d/70-force-gateway.rules": unit_file.udev_text(),
        },
        (*_BEFORE_ENABLE, ("systemctl", "enable", "--now", options.name)),
        (*_faces_cut_off(rig, () if networks else options.networks), *_unbounded(rig)),
        tuple(_files_of(rig)),
        program,
    )


def install_service(plan: Installation, root: Path) -> tuple[list[Path], bool]:
    """Write the plan's files below the root and, on a running machine, start the service. Return what was written, and whether
    the service ran before: it goes on as it was then, since a restart would drop the force. CliError where that is refused."""
    written, ran = [], False
    for name in plan.files:
        _refuse_link(root / name)
    _refuse_other_rig(root / UNITS / plan.unit, plan.files.get(f"{UNITS}/{plan.unit}", ""))
    for name, text in plan.files.items():
        path = root / name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            beside = path.with_name(f".{path.name}.new")
            beside.write_text(text, encoding="utf-8")
            beside.replace(path)
        except PermissionError:
            again = shlex.join(
                [str(_own_command()), *sys.argv[1:]]
            )  # `python -m gateway` has no name that sudo could run
            raise CliError(
                f"E107 {path}: only root may write there; sudo {again}, or --root DIR for an image",
                exit_codes.PERMISSION,
            ) from None
        written.append(path)
    if root == Path("/"):
        ran = run_command(("systemctl", "is-active", plan.unit), quiet=True).strip() == "active"
        for words in plan.commands:
            if words[:2] == ("systemctl", "enable"):  # its user is there by now
                if plan.program:
                    refuse_closed_program(plan.program)
                refuse_unreadable(plan.reads)
            run_command(words)
    return written, ran


def uninstall_service(stem: str, root: Path) -> Path:
    """Stop and remove the unit of a rig; its state directory, the user and the udev rule stay."""
    path = root / UNITS / unit_file.unit_name(stem)
    if not exists(path):
        raise CliError(f"E107 {path}: there is no such unit; {_others(root)}", exit_codes.DATA)
    if root == Path("/"):
        run_command(("systemctl", "disable", "--now", path.name))
    path.unlink()
    if root == Path("/"):
        run_command(("systemctl", "daemon-reload"))
    return path


def installed_units(root: Path) -> list[str]:
    """Return the names of the units that are there."""
    return sorted(path.name for path in (root / UNITS).glob(f"{unit_file.NAME}-*.service"))


def run_command(words: Sequence[str], *, quiet: bool = False) -> str:
    """Run a command of systemd and return what it says. CliError E108 with its own words where it fails."""
    try:
        done = subprocess.run(words, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        raise CliError(f"E108 {words[0]} is not on this machine: {_WITHOUT}", exit_codes.DEVICE) from None
    if done.returncode and not quiet:
        if words[0] == "systemctl" and not is_directory(_BOOTED):
            raise CliError(f"E108 systemd does not run on this machine: {_WITHOUT}", exit_codes.DEVICE)
        said = (done.stderr or done.stdout).strip().splitlines()
        raise CliError(f"E108 {' '.join(words)}: {said[-1] if said else f'exit code {done.returncode}'}")
    return done.stdout


def _own_command() -> Path:
    beside = Path(sys.executable).with_name("force-gateway")
    return beside if exists(beside) else Path(sys.argv[0])


def _refuse_hidden(*paths: str) -> None:
    for path in paths:
        real = os.path.realpath(path)
        if hidden := next((home for home in _HIDDEN for way in (path, real) if way.startswith(f"{home}/")), None):
            leads = f" leads to {real}" if not path.startswith(f"{hidden}/") else ""
            raise CliError(
                f"E107 {path}{leads}: the service sees nothing below {hidden}; install into /opt/force-gateway (python3 "
                "-m venv, pip install) and keep the rig in /etc/force-gateway, or give --command",
                exit_codes.CONFIGURATION,
            )
        if not path.isprintable():
            raise CliError(f"E107 {path!r}: a unit has no such characters in a path", exit_codes.CONFIGURATION)
        if not Path(path).is_absolute():
            raise CliError(f"E107 {path}: the service needs an absolute path", exit_codes.CONFIGURATION)


def _refuse_link(path: Path) -> None:
    """A unit that somebody has masked, which is a link to nothing, must not begin to run by being written anew."""
    if path.is_symlink():
        target = path.readlink()
        masked = f"the unit is masked; sudo systemctl unmask {path.name} allows it again"
        words = masked if str(target) == "/dev/null" else f"a link to {target}; remove it, then install again"
        raise CliError(f"E107 {path}: {words}", exit_codes.CONFIGURATION)


def _refuse_other_rig(path: Path, text: str) -> None:
    """Unit and state directory go by the name of the rig's file: of two `cell.yaml` the later one would get the calibrations,
    and at the next start the place, of the other's machine."""
    there = _RIG_OF_UNIT.search(path.read_text(encoding="utf-8", errors="replace")) if exists(path) else None
    ours = _RIG_OF_UNIT.search(text)
    if there and ours and there[1] != ours[1]:
        stem = path.name.removeprefix(f"{unit_file.NAME}-").removesuffix(".service")
        raise CliError(
            f"E107 {path} is of {there[1]}: give {ours[1]} another name, or, where it takes that one's place, force-gateway "
            f"service uninstall {stem} first",
            exit_codes.CONFIGURATION,
        )


def _refuse_no_networks(networks: Sequence[str]) -> None:
    for network in networks:
        try:
            ip_network(network, strict=False)
        except ValueError as error:
            if network not in _NAMED_NETWORKS:
                example = "such as 192.168.125.0/24"
                raise CliError(f"E107 --allow {network}: {error}; {example}", exit_codes.CONFIGURATION) from None


def _others(root: Path) -> str:
    units = installed_units(root)
    return f"installed: {', '.join(units)}" if units else "none is installed"


def _ports_of(rig: "Rig") -> tuple[int, ...]:
    secure = [face.port for face in rig.fieldbus if isinstance(face, TlsFace)]
    for_people = [split_listen(face.listen)[1] for face in (rig.web, rig.metrics, rig.opcua) if face]
    return (*([rig.network.port] if rig.network.plain else []), *secure, *for_people)


def _devices_of(rig: "Rig") -> tuple[str, ...]:
    lines = (rig.output, rig.load_cell, *([rig.valve] if rig.valve else []))
    ports = [line.port for line in lines] + [face.port for face in rig.fieldbus if isinstance(face, RtuFace)]
    return () if rig.simulated else tuple(dict.fromkeys(port for port in ports if port))


def _addresses_of(rig: "Rig") -> list[str]:
    secure = [face.bind for face in rig.fieldbus if isinstance(face, TlsFace)]
    for_people = [split_listen(face.listen)[0] for face in (rig.web, rig.metrics, rig.opcua) if face]
    return [*([rig.network.bind] if rig.network.plain else []), *secure, *for_people]


def _faces_cut_off(rig: "Rig", networks: Sequence[str]) -> Iterator[str]:
    """Yield a sentence for each face of people's that listens for others: its users are named nowhere in the rig. networks: who
    may connect by the rig, empty where others are given."""
    faces = {"the page": rig.web, "the metrics": rig.metrics, "the OPC UA server": rig.opcua}
    for name, face in faces.items() if networks else ():
        if face and not ip_address(split_listen(face.listen)[0]).is_loopback:
            where = f"is reached from {', '.join(networks)} alone"
            yield f"{name} ({face.listen}) {where}: --allow NETWORK, once for each, says otherwise"


def _unbounded(rig: "Rig") -> Iterator[str]:
    if rig.retention.is_unlimited:
        yield (
            "nothing deletes recordings here, and one that is left on takes 1 GB a day; a rig's "
            "recordings: {retention: {bytes: 20000000000, days: 90}} does"
        )


def _is_own_address(address: str) -> bool:
    """Decide whether it is there only once the network is up."""
    found = ip_address(address)
    return not (found.is_loopback or found.is_unspecified)


def _networks_of(rig: "Rig", given: Sequence[str]) -> tuple[str, ...]:
    """Who may connect by the rig itself may by the kernel, unless others are given; this machine and the broker always may.
    A rig that names nobody is reached from this machine alone."""
    secure = [face.allow for face in rig.fieldbus if isinstance(face, TlsFace)]
    allowed = given or [str(network) for each in (rig.network.allow, *secure) for network in each]
    return tuple(dict.fromkeys(("localhost", *allowed, *_broker_of(rig, is_given=bool(given)))))


def _broker_of(rig: "Rig", *, is_given: bool) -> tuple[str, ...]:
    """Return the address of the rig's broker. CliError E107 for a name: the kernel goes by addresses, also of a name server."""
    host = rig.mqtt.host if rig.mqtt else "localhost"
    try:
        return (str(ip_address(host.partition("%")[0])),)
    except ValueError:
        if host == "localhost" or is_given:
            return ()
        raise CliError(
            f"E107 mqtt.host {host} is a name, and the service reaches only addresses that its unit names: write the broker's "
            "address in the rig, or give --allow for each network: of masters, broker and name server",
            exit_codes.CONFIGURATION,
        ) from None


def _path_of(rig_name: str) -> str:
    """Return the whole path of a rig's file, which `load_rig` has found from here: the service has another directory."""
    try:
        return str(locate("rig", rig_name).absolute())
    except FileNotFoundError:
        return str(Path(rig_name).absolute())


def _files_of(rig: "Rig") -> list[str]:
    """Return the rig's file, and those that it names, but for shipped profiles: the service must see and read them."""
    shipped, texts = shipped_profiles_folder().absolute(), [Path(name).absolute() for name in rig.texts]
    own = [path for path in texts if not path.is_relative_to(shipped)]
    secure = [
        path for face in rig.fieldbus if isinstance(face, TlsFace) for path in (face.certificate, face.key, face.ca)
    ]
    mqtt, tls = rig.mqtt, rig.mqtt and rig.mqtt.tls
    broker = (mqtt and mqtt.password_file, *((tls.ca, tls.certificate, tls.key) if tls else ()))
    return [str(Path(path).absolute()) for path in (*own, *secure, *broker) if path]
