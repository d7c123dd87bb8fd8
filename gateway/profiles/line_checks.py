"""Whether the two serial lines of a rig fit: the right device at each end, stable ports, and a wire that is fast enough."""

from collections.abc import Iterator
from typing import Final

from gateway.devices import DeviceProfile, Role, cell_device, cell_host, output_host
from gateway.devices.messages import ReadPressure
from gateway.profiles.checks import Check, Found, Parts
from gateway.profiles.edit_marks import PLACEHOLDER
from gateway.profiles.models import CellFile, OutputFile
from gateway.profiles.sentences import newton, number, second, volt

_SLOWEST_HZ: Final = 20.0  # DEVICES: the pneumatics settle in 0.27-0.49 s and need 20-50 Hz
_BY_CHANCE: Final = ("/dev/ttyUSB", "/dev/ttyACM")  # numbered in the order of plugging
_ROLES: Final = {"output": Role.OUTPUT, "load_cell": Role.LOAD_CELL}
_ARTICLE: Final = {Role.OUTPUT: "an output", Role.LOAD_CELL: "a load cell"}


def _lines(parts: Parts) -> Iterator[tuple[str, OutputFile | CellFile, DeviceProfile | None]]:
    """Each line that the file describes: (key, what it says, the device's profile)."""
    if parts.output:
        yield "output", parts.output, parts.output_device
    if parts.load_cell:
        yield "load_cell", parts.load_cell, parts.cell_device


def _of_role(device: DeviceProfile | None, role: Role) -> DeviceProfile | None:
    """A device at the wrong end is told once; other checks leave it alone."""
    return device if device and device.role is role else None


def devices_have_their_role(parts: Parts) -> Found:
    for key, _, device in _lines(parts):
        if device and device.role is not _ROLES[key]:
            yield f"{key}.device", f"{device.name} is {_ARTICLE[device.role]}, {_ARTICLE[_ROLES[key]]} is needed here"


def simulated_lines_have_no_port(parts: Parts) -> Found:
    for key, line, _ in _lines(parts):
        if parts.simulated and line.port is not None:
            yield f"{key}.port", "a simulated rig has no ports: delete this line, or write `simulated: false`"


def ports_are_given(parts: Parts) -> Found:
    for key, line, _ in [] if parts.simulated else _lines(parts):
        if line.port is None:
            yield (
                f"{key}.port",
                "is missing: `force-gateway ports` lists what is plugged in (no hardware: `simulated: true`)",
            )
        elif PLACEHOLDER.search(line.port):
            told = "is the placeholder that init wrote: put your adapter's path here, `force-gateway ports` lists them"
            yield f"{key}.port", f"{line.port} {told}"
        elif not line.port.startswith("/"):
            yield f"{key}.port", f'"{line.port}" is not the path of a device, such as /dev/serial/by-id/usb-...'


def ports_differ(parts: Parts) -> Found:
    output, cell = parts.output, parts.load_cell
    if output and cell and output.port is not None and output.port == cell.port:
        yield "load_cell.port", "is the output's port too: each device has its own"


def the_unit_is_known(parts: Parts) -> Found:
    """A frame without a unit needs the rig's, one with a unit must not get a second."""
    device, line = _of_role(parts.cell_device, Role.LOAD_CELL), parts.load_cell
    if device and line:
        try:
            cell_host(device, line.sign, line.unit)
        except ValueError as error:
            yield "load_cell.unit", str(error)


def the_output_reaches(parts: Parts) -> Found:
    device, limits = _of_role(parts.output_device, Role.OUTPUT), parts.limits
    if not device or not limits:
        return
    low, high = device.voltage_range_v
    for key in ("voltage_min_v", "voltage_max_v", "safe_voltage_v"):
        value = getattr(limits, key)
        if not low <= value <= high:
            yield f"limits.{key}", f"{volt(value)} is outside {number(low)} .. {volt(high)}, the range of {device.name}"


def silence_is_accepted(parts: Parts) -> Found:
    """DESIGN: without a watchdog in the device, nothing but the rig's own word lets it be enabled."""
    device = _of_role(parts.output_device, Role.OUTPUT)
    if device and device.watchdog == "none" and not parts.accept_no_device_watchdog:
        risk = f"{device.name} has no watchdog and keeps its last output when this machine loses power"
        yield (
            "accept_no_device_watchdog",
            f"must be true: {risk}; accept it when something else, such as an air dump valve, helps",
        )


def samples_come_in_time(parts: Parts) -> Found:
    device, supervision = parts.cell_device, parts.supervision
    if device and supervision and device.rate_hz and supervision.sample_timeout_s < 2.0 / device.rate_hz:
        told = f"two readings of {device.name} take {second(2.0 / device.rate_hz)}"
        yield "supervision.sample_timeout_s", f"{second(supervision.sample_timeout_s)} is too short: {told}"


def ports_are_stable(parts: Parts) -> Found:
    for key, line, _ in _lines(parts):
        if line.port is not None and line.port.startswith(_BY_CHANCE):
            told = "may be another adapter after a replug: `force-gateway ports` lists its /dev/serial/by-id/... path"
            yield f"{key}.port", f"{line.port} {told}"


def speeds_agree(parts: Parts) -> Found:
    for key, line, device in _lines(parts):
        if device and line.baud != device.serial.baud:
            end = "the simulated device speaks" if parts.simulated else f"profile {device.name} says"
            yield f"{key}.baud", f"{line.baud} differs from the other end: {end} {device.serial}"


def the_output_wire_is_fast_enough(parts: Parts) -> Found:
    device, line = _of_role(parts.output_device, Role.OUTPUT), parts.output
    if not device or not line:
        return
    cycle_s = _setting_and_reading_bytes(device) * device.serial.at(line.baud).character_s
    if cycle_s > 1.0 / _SLOWEST_HZ:
        told = f"a setting and a reading take {cycle_s * 1e3:.0f} ms on the wire, {1 / cycle_s:.0f} Hz"
        yield "output.baud", f"{told}; the pneumatics need {number(_SLOWEST_HZ)} Hz"
    if parts.supervision and parts.supervision.output_timeout_s < 3 * cycle_s:
        timeout = second(parts.supervision.output_timeout_s)
        yield (
            "supervision.output_timeout_s",
            f"{timeout} is less than three settings with readings on the wire: {3 * cycle_s:.2f} s",
        )


def _setting_and_reading_bytes(device: DeviceProfile) -> int:
    """Longest question and answer of a setting, and of a pressure reading (whose answer is taken to be as long)."""
    host = output_host(device)
    setting = host.safe_frame(device.voltage_range_v[1])
    answer = len(host.safe_reply)
    return len(setting) + answer + (len(host.request(ReadPressure())) + answer if device.read_pressure else 0)


def the_cell_wire_is_fast_enough(parts: Parts) -> Found:
    device, line = parts.cell_device, parts.load_cell
    if not device or not line or not device.rate_hz:
        return
    possible_hz = 1.0 / (len(cell_device(device).frame(0.0)) * device.serial.at(line.baud).character_s)
    if device.rate_hz > possible_hz:
        yield (
            "load_cell.baud",
            f"{line.baud} carries {possible_hz:.0f} readings/s, {device.name} sends {number(device.rate_hz)}",
        )


def the_quantum_is_the_amplifiers(parts: Parts) -> Found:
    """supervision.sample_quantum_n decides when a reading counts as frozen."""
    device, line, supervision = _of_role(parts.cell_device, Role.LOAD_CELL), parts.load_cell, parts.supervision
    if not device or not line or not supervision:
        return
    try:
        count_n = cell_host(device, line.sign, line.unit).resolution_n
    except ValueError:  # told by the_unit_is_known
        return
    if not 0.5 <= supervision.sample_quantum_n / count_n <= 2.0:
        told = f"is far from one count of {device.name}, {count_n:.3g} N"
        yield "supervision.sample_quantum_n", f"{newton(supervision.sample_quantum_n)} {told}"


HARDWARE: Final[tuple[Check, ...]] = (ports_are_given, ports_differ)
"""Faults that a run with simulated devices does not mind."""

FAULTS: Final[tuple[Check, ...]] = (
    devices_have_their_role,
    simulated_lines_have_no_port,
    the_unit_is_known,
    the_output_reaches,
    silence_is_accepted,
    samples_come_in_time,
)
WARNINGS: Final[tuple[Check, ...]] = (
    ports_are_stable,
    speeds_agree,
    the_output_wire_is_fast_enough,
    the_cell_wire_is_fast_enough,
    the_quantum_is_the_amplifiers,
)
