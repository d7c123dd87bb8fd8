"""`init` at a terminal: asks for both devices, asks the devices themselves, and fills the answers into the starter rig.

Nothing that is asked of a device changes anything (see port_probing). What is left open keeps its mark EDIT. The file is
checked before it is written, and what does not fit is asked again.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from shlex import quote
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final, get_args

import click

from gateway.cli.command_line.numbers import Quantity
from gateway.cli.command_line.questions import is_yes
from gateway.cli.errors import CliError
from gateway.cli.setup import port_probing as probing
from gateway.cli.setup.starter_rig import starter_rig
from gateway.plain_file import is_file

if TYPE_CHECKING:
    from gateway.devices import DeviceProfile
    from gateway.profiles import Checked

_LATER: Final = "later"
_OVER: Final = 1.3  # of force_max_n: where the over-force fault trips, unless the cell ends before
_SATURATION: Final = 0.98  # of the cell's range
_LEAST_TIMEOUT_S: Final = 0.05  # and of the starter rig
_OUTPUT_TIMEOUT_S: Final = 0.1  # where the file does not say it, as the one below
_RESPONSE_LAG_S: Final = 0.2
_TOLERANCE_N: Final = 1.0  # of the starter rig, as the three below it
_SMALLEST_N: Final = 2.0
_PRECONTACT_N: Final = 3.0
_CONTACT_N: Final = 0.5
_MOST_N: Final = 40.0
_STUCK_N: Final = 15.0  # where the file does not say it
_LEAST_STUCK_N: Final = 1.0  # the starter rig's calibration expects a little less at 0 V
_ATTEMPTS: Final = 3  # to mend answers that check refuses; then the file is written with its faults told
_OF_FORCES: Final = ("limits.", "load_cell.range_n")  # what is asked again where check refuses it
Settings = dict[tuple[str, str], Any]


@dataclass(slots=True)
class GuidedRig:
    """Answers so far: (section, key) -> value as the file has it."""

    name: str
    settings: Settings = field(default_factory=dict)

    def text(self) -> str:
        """Return the file."""
        text = starter_rig(self.name)
        for (section, key), value in self.settings.items():
            text = set_in(text, section, key, value)
        return text


def ask_rig(name: str) -> str:
    """Ask a person for a rig at the terminal; return its file."""
    click.echo("Enter takes what stands in brackets. Nothing is moved: the probe asks only what changes nothing.")
    for file in faulty_devices():
        click.echo(f"  {file} has faults and is not offered: force-gateway check {quote(str(file))}")
    rig = GuidedRig(name)
    _ask_line(rig, "output", "output", "the DAC or pressure regulator")
    _ask_line(rig, "load_cell", "load cell", "the load-cell amplifier")
    _ask_forces(rig)
    for left in range(_ATTEMPTS, -1, -1):
        faults = list(faults_of(rig))
        for path, sentence in faults:
            click.echo(f"  {path}: {sentence}")
        if not left or not any(path.startswith(_OF_FORCES) for path, _ in faults):
            break
        _ask_forces(rig)
    return rig.text()


def _ask_line(rig: GuidedRig, section: str, role: str, what: str) -> None:
    port = _ask_port(what, rig.settings.get(("output", "port")))
    device, baud = _ask_device(role, what, port)
    rig.settings[section, "device"] = device.name
    rig.settings[section, "baud"] = baud
    if port != _LATER:
        rig.settings[section, "port"] = port
    if role == "output":
        _ask_watchdog(rig, device)
        _fit_output(rig, device, baud)
    else:
        _ask_unit(rig, device)
        _fit_supervision(rig, device, baud)


def _ask_port(what: str, taken: str | None) -> str:
    from gateway.ports import list_ports

    ports = [port.path for port in list_ports()]
    for number, path in enumerate(ports, 1):
        click.echo(f"  {number}  {path}")
    free = (str(number) for number, path in enumerate(ports, 1) if path != taken)

    def read(answer: str) -> str:
        path = ports[int(answer) - 1] if answer.isdecimal() and 0 < int(answer) <= len(ports) else answer
        if path != _LATER and not path.startswith("/"):
            raise click.UsageError(f"{answer} is no number of this list, and no path such as /dev/ttyUSB0")
        if path == taken:
            raise click.UsageError(f"{path} is the output's port already: each device has its own")
        return path

    text = f"port of {what}: number, path, or {_LATER}"
    return str(click.prompt(text, default=next(free, _LATER), value_proc=read))


def _ask_device(role: str, what: str, port: str) -> "tuple[DeviceProfile, int]":
    profiles = {one.name: one for one in (*own_profiles(role), *probing.known_profiles(role))}
    found: tuple[str, int] | None = None
    if port != _LATER and is_yes("ask the device which it is?", default=True):
        found = _probe(port, list(profiles.values()))
    default = found[0] if found else ("smc-itv-rc" if role == "output" else "stream-st-gs")
    click.echo(f"  known: {', '.join(profiles)}")
    name = click.prompt(
        f"device profile of {what}", default=default, type=click.Choice(list(profiles)), show_choices=False
    )
    device = profiles[name]
    baud = found[1] if found and found[0] == name else device.serial.baud
    return device, click.prompt("baud", default=str(baud), value_proc=_speed)


def _speed(answer: str) -> int:
    from gateway.devices.line_settings import Baud

    speeds = get_args(Baud)
    if not answer.isdecimal() or int(answer) not in speeds:
        raise click.UsageError(f"{answer} is no speed of a serial port; known are {', '.join(map(str, speeds))}")
    return int(answer)


def _probe(port: str, profiles: "list[DeviceProfile]") -> tuple[str, int] | None:
    from gateway.cli.diagnosis.progress_line import show_progress

    words = f"in the words of {len(profiles)} profiles at their own speeds, then at others"
    click.echo(f"  listens, then asks {words}: 10 s or so where nothing answers")
    try:
        with show_progress("probing"):
            report = probing.probe_path(port, profiles)
    except CliError as error:
        click.echo(f"  {error.message}")
        return None
    for line in probing.tell_report(report):
        click.echo(f"  {line}")
    answer = next(iter(report.answers), None)
    return (answer.profile.name, answer.settings.baud) if answer else None


def own_profiles(role: str) -> "Iterator[DeviceProfile]":
    """Yield the device files of this folder that are of a role and have no fault."""
    for _, checked in _own_devices():
        if not checked.faults and checked.value.role.value == role:
            yield checked.value


def faulty_devices() -> "Iterator[Path]":
    """Yield the device files of this folder that have a fault."""
    return (path for path, checked in _own_devices() if checked.faults)


def _own_devices() -> "Iterator[tuple[Path, Checked]]":
    from gateway.profiles import check_file

    for path in sorted(own_files()):
        if re.search(r"^role:", path.read_text(encoding="utf-8", errors="replace"), re.MULTILINE):
            checked = check_file(str(path))
            if checked.kind == "device":
                yield path, checked


def _ask_watchdog(rig: GuidedRig, device: "DeviceProfile") -> None:
    if device.own_watchdog:
        click.echo(f"  {device.name} has a watchdog of its own: armed at {device.own_watchdog.time_s:g} s")
        rig.settings["", "accept_no_device_watchdog"] = "false"
        return
    click.echo(f"  {device.name} has no watchdog: it holds its last voltage when this machine loses power")
    accepted = is_yes("does something else help then, such as an air dump valve?")
    rig.settings["", "accept_no_device_watchdog"] = "true" if accepted else "true # EDIT: nothing else helps yet"


def _ask_unit(rig: GuidedRig, device: "DeviceProfile") -> None:
    reading = device.reading
    if reading.newton_per_unit or reading.template.field("unit"):
        return
    unit = click.prompt("unit of its numbers", type=click.Choice(["N", "kg", "g", "lb", "counts"]), default="N")
    if unit != "counts":
        rig.settings["load_cell", "unit"] = unit
        return
    rig.settings["load_cell", "zero_count"] = click.prompt("counts without a force", default=0.0, type=Quantity())
    rig.settings["load_cell", "newton_per_count"] = click.prompt("newtons of one count", type=Quantity(0, above=True))


def _fit_output(rig: GuidedRig, device: "DeviceProfile", baud: int) -> None:
    """A bound on silence that this output can keep: it may take as long as its profile says, and one answer may be lost."""
    from gateway.profiles.rigs.checks.wire_times import wire_cycle_s

    longest_s = max(device.reply_timeout_s, 3.0 * wire_cycle_s(device, device.serial.at(baud)))
    if longest_s > _OUTPUT_TIMEOUT_S:
        rig.settings["supervision", "output_timeout_s"] = f"{1.05 * longest_s:.2g}"


def _fit_supervision(rig: GuidedRig, device: "DeviceProfile", baud: int) -> None:
    """Bounds that this amplifier can keep: of a slow one a sample is older, of a coarse one a count is larger."""
    from gateway.profiles.rigs.checks.wire_times import wire_cycle_s
    from gateway.units import NEWTON_PER_UNIT

    reading, said = device.reading, rig.settings
    period_s = max(wire_cycle_s(device, device.serial.at(baud)), 1.0 / reading.rate_hz if reading.rate_hz else 0.0)
    gap_s = 2.2 * period_s + (device.reply_timeout_s if reading.ask else 0.0)  # one lost answer is no fault
    if period_s > _RESPONSE_LAG_S:
        said["supervision", "response_lag_s"] = f"{1.1 * period_s:.2g}"
    said["supervision", "sample_timeout_s"] = f"{max(_LEAST_TIMEOUT_S, gap_s):.2g}"
    unit = said.get(("load_cell", "unit"), reading.unit)
    per_unit = NEWTON_PER_UNIT[unit] if unit else said.get(("load_cell", "newton_per_count"), reading.newton_per_count)
    if per_unit:
        count_n = reading.step * per_unit
        said["supervision", "sample_quantum_n"] = f"{count_n:.3g}"


def _ask_forces(rig: GuidedRig) -> None:
    positive = Quantity(0, above=True)
    range_n = click.prompt("rated force of the load cell, N", default=98.07, type=positive)
    most_n = click.prompt(
        "largest force that tool and workpiece take, N", default=round(min(0.4 * range_n, _MOST_N), 1), type=positive
    )
    band_n, count_n = (
        min(_TOLERANCE_N, most_n / 10.0),
        float(rig.settings.get(("supervision", "sample_quantum_n"), 0.0)),
    )
    rig.settings |= {
        ("load_cell", "range_n"): f"{range_n:g}",
        ("limits", "force_max_n"): f"{most_n:g}",
        ("limits", "over_force_n"): f"{min(_OVER * most_n, 0.95 * range_n):.4g}",
        ("supervision", "saturation_n"): f"{_SATURATION * range_n:.4g}",
        ("supervision", "stuck_n"): f"{max(_LEAST_STUCK_N, min(_STUCK_N, most_n)):.4g}",
        ("limits", "smallest_force_n"): f"{min(_SMALLEST_N, most_n / 10.0):.2g}",
        ("defaults", "precontact_force_n"): f"{min(_PRECONTACT_N, most_n / 5.0):.2g}",
        ("defaults", "contact_threshold_n"): f"{min(_CONTACT_N, most_n / 10.0):.2g}",
        ("defaults", "in_band_tolerance_n"): f"{2.0 * count_n if count_n > band_n else band_n:.2g}",
    }


def faults_of(rig: GuidedRig) -> Iterator[tuple[str, str]]:
    """Yield (path, sentence) of what `check` would refuse, apart from ports that are still to come."""
    from gateway.profiles import check_report

    with TemporaryDirectory(dir=".", prefix=".init-") as folder:  # here, so that devices beside the rig are found
        for path in own_files():
            (Path(folder) / path.name).write_bytes(path.read_bytes())
        file = Path(folder) / f"{rig.name}.yaml"
        file.write_text(rig.text(), encoding="utf-8")
        for fault in check_report(file).faults:
            if not fault.path.endswith(".port"):
                yield fault.path, fault.message


def own_files() -> list[Path]:
    """Return the YAML files of this folder, which a rig may name."""
    return [path for path in (*Path().glob("*.yaml"), *Path().glob("devices/*.yaml")) if is_file(path)]


def set_in(text: str, section: str, key: str, value: Any) -> str:
    """Return the starter's text with one value written, and its mark EDIT gone; a key that it does not have is added."""
    lines, inside, end = text.splitlines(), section == "", -1
    for index, line in enumerate(lines):
        if re.match(r"\S", line) and not line.startswith("#"):
            inside = line.startswith(f"{section}:") if section else True
        head = f"{key}:" if section == "" else f"  {key}:"
        if inside and line.startswith(head):
            comment = re.search(r" # (?!EDIT)[^#]*$", line)
            lines[index] = f"{head} {value}" + (comment[0] if comment and "EDIT" not in comment[0] else "")
            return "\n".join(lines) + "\n"
        if inside and section and line.startswith("  "):
            end = index
    lines.insert(end + 1, f"  {key}: {value}")
    return "\n".join(lines) + "\n"
