"""Whether the two serial lines of a rig fit: the right device at each end, and stable ports. How fast they are: wires."""

import os
import re
from collections.abc import Iterator
from typing import Final

from gateway.devices import DeviceProfile, DeviceRole, cell_host
from gateway.devices.device_checks.watchdog import FEEDS_PER_TIME
from gateway.plain_file import is_directory, is_file
from gateway.profiles.rigs.checks.parts import Check, Found, Parts
from gateway.profiles.rigs.device_settings import find_unfit_settings
from gateway.profiles.rigs.edit_marks import PLACEHOLDER
from gateway.profiles.rigs.rig_file import CellFile, OutputFile
from gateway.profiles.strict_yaml.fault_sentences import number, second, volt

UNSTABLE_PATHS: Final = ("/dev/ttyUSB", "/dev/ttyACM")
"""Ports that are numbered in the order of plugging."""
UNSTABLE: Final = "may be another adapter after a replug: `force-gateway ports` lists its /dev/serial/by-id/... path"

NO_PORT: Final = "is missing: `force-gateway ports` lists what is plugged in"
SIMULATED_PORT: Final = "a simulated rig has no ports: delete this line, or write `simulated: false`"
_HOST: Final = re.compile(r"://|:\d+$|^\d+(\.\d+){3}$")  # an address of the network, with a port or without
_POLLED_S: Final = 0.3  # three questions of an idle line: what a watchdog that any sentence feeds must outlast
_ROLES: Final = {"output": DeviceRole.OUTPUT, "load_cell": DeviceRole.LOAD_CELL}
_ARTICLE: Final = {DeviceRole.OUTPUT: "an output", DeviceRole.LOAD_CELL: "a load cell", DeviceRole.VALVE: "a valve"}


def lines_of(parts: Parts) -> Iterator[tuple[str, OutputFile | CellFile, DeviceProfile | None]]:
    """Yield each line that the file describes: (key, what it says, the device's profile)."""
    if parts.output:
        yield "output", parts.output, parts.output_device
    if parts.load_cell:
        yield "load_cell", parts.load_cell, parts.cell_device


def of_role(device: DeviceProfile | None, role: DeviceRole) -> DeviceProfile | None:
    """Return the device where it has this role; one at the wrong end is told once, and other checks leave it alone."""
    return device if device and device.role is role else None


def check_device_roles(parts: Parts) -> Found:
    """Yield a fault for a device at the wrong end: an output named as load cell, say."""
    for key, _, device in lines_of(parts):
        if device and device.role is not _ROLES[key]:
            yield f"{key}.device", f"{device.name} is {_ARTICLE[device.role]}, {_ARTICLE[_ROLES[key]]} is needed here"


def check_simulated_ports(parts: Parts) -> Found:
    """Yield a fault for a port in a simulated rig."""
    for key, line, _ in lines_of(parts):
        if parts.simulated and line.port is not None:
            yield f"{key}.port", SIMULATED_PORT


def check_ports_given(parts: Parts) -> Found:
    """Yield a fault for a real rig's line without a port, or with one that is no path of a device."""
    for key, line, _ in [] if parts.simulated else lines_of(parts):
        if line.port is None:
            yield f"{key}.port", f"{NO_PORT} (no hardware: `simulated: true`)"
        elif reason := why_no_path(line.port):
            yield f"{key}.port", reason


def why_no_path(port: str) -> str:
    """Return why this is no path of a device, empty where it is one."""
    if PLACEHOLDER.search(port):
        cure = "put your adapter's path here, `force-gateway ports` lists them"
        return f"{port} is a placeholder: {cure}"
    if port.startswith("/"):
        other = "a directory" if is_directory(port) else "a file" if is_file(port) else ""
        return f"{port} is {other} and no serial port: `force-gateway ports` lists what is plugged in" if other else ""
    wanted = f'"{port}" is not the path of a device, such as /dev/serial/by-id/usb-...'
    cure = "a device is on a serial line, and what has Ethernet needs a serial server whose driver makes a port here"
    return f"{wanted}: {cure}" if _HOST.search(port) else wanted


def is_same_port(one: str | None, other: str | None) -> bool:
    """Decide whether both name one adapter: by-id names are followed."""
    return one is not None and other is not None and os.path.realpath(one) == os.path.realpath(other)


def check_ports_differ(parts: Parts) -> Found:
    """Yield a fault for a port that both lines name."""
    output, cell = parts.output, parts.load_cell
    if output and cell and is_same_port(output.port, cell.port):
        yield "load_cell.port", "is the output's port too: each device has its own"


def check_unit(parts: Parts) -> Found:
    """Yield a fault for a frame without a unit where the rig names none, and for one that gets a second."""
    device, line = of_role(parts.cell_device, DeviceRole.LOAD_CELL), parts.load_cell
    if device and line and (line.newton_per_count is None or device.reading.newton_per_count):  # else it does not fit
        try:
            cell_host(device, line.sign, line.unit)
        except ValueError as error:
            yield "load_cell.unit", str(error)


def check_device_settings(parts: Parts) -> Found:
    """Yield a fault for a setting that the device does not have, or cannot be set to."""
    for key, line, device in lines_of(parts):
        if device and device.role is _ROLES[key]:
            for name, sentence in find_unfit_settings(device, line):
                yield f"{key}.{name}", sentence


def check_output_range(parts: Parts) -> Found:
    """Yield a fault for a voltage limit outside the output's range."""
    device, limits = of_role(parts.output_device, DeviceRole.OUTPUT), parts.limits
    if not device or not limits:
        return
    low, high = device.voltage_range_v
    for key in ("voltage_min_v", "voltage_max_v", "safe_voltage_v"):
        value = getattr(limits, key)
        if not low <= value <= high:
            yield f"limits.{key}", f"{volt(value)} is outside {number(low)} .. {volt(high)}, the range of {device.name}"


def check_device_watchdog(parts: Parts) -> Found:
    """Yield a fault for an output without a watchdog, until the rig accepts that it has none."""
    device = of_role(parts.output_device, DeviceRole.OUTPUT)
    if device and device.watchdog == "none" and not parts.accept_no_device_watchdog:
        risk = f"{device.name} has no watchdog and keeps its last output when this machine loses power"
        yield (
            "accept_no_device_watchdog",
            f"must be true: {risk}; accept it when something else, such as an air dump valve, helps",
        )


def check_watchdog_time(parts: Parts) -> Found:
    """Yield a fault for a device watchdog that the gateway could not keep from tripping while all is well."""
    device = of_role(parts.output_device, DeviceRole.OUTPUT)
    watchdog = device.own_watchdog if device else None
    if watchdog is None or device is None or not parts.loop_hz:
        return
    period_s = FEEDS_PER_TIME / parts.loop_hz if watchdog.feed else _POLLED_S
    time_s = watchdog.ticks * watchdog.tick_s
    if time_s < period_s:
        feeds = "signs of life" if watchdog.feed else "questions"
        least = f"{second(period_s)} is the least at {number(parts.loop_hz)} Hz with the {feeds} that feed it"
        yield "output.watchdog_s", f"{second(time_s)} of {device.name}'s watchdog would trip in normal work: {least}"


def check_ports_stable(parts: Parts) -> Found:
    """Yield a warning for a port whose name depends on the order of plugging."""
    named = {key: line.port for key, line, _ in lines_of(parts)} | {"valve": parts.valve.port if parts.valve else None}
    for key, port in named.items():
        if port is not None and port.startswith(UNSTABLE_PATHS):
            yield f"{key}.port", f"{port} {UNSTABLE}"


def check_baud(parts: Parts) -> Found:
    """Yield a warning for a speed that differs from the device profile's."""
    for key, line, device in lines_of(parts):
        if device and line.baud not in (None, device.serial.baud):
            end = "the simulated device speaks" if parts.simulated else f"profile {device.name} says"
            yield f"{key}.baud", f"{line.baud} differs from the other end: {end} {device.serial}"


HARDWARE: Final[tuple[Check, ...]] = (check_ports_given, check_ports_differ)
"""Faults that a run with simulated devices does not mind."""

FAULTS: Final[tuple[Check, ...]] = (
    check_device_roles,
    check_simulated_ports,
    check_device_settings,
    check_unit,
    check_output_range,
    check_device_watchdog,
    check_watchdog_time,
)
WARNINGS: Final[tuple[Check, ...]] = (
    check_ports_stable,
    check_baud,
)
