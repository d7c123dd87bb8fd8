"""What a rig says about a device beside its name: address, channel, checksum, watchdog, counts; the profile has defaults."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Final

from gateway.devices import DeviceProfile
from gateway.devices.force_reading import UNIT
from gateway.devices.profile import ADDRESS
from gateway.devices.rehearsal import rehearse
from gateway.profiles.rigs.rig_file import CellFile, OutputFile, ValveFile

CHANNEL: Final = "channel"
_CONSTANTS: Final = (ADDRESS, CHANNEL)
_NAMES: Final = (*_CONSTANTS, "watchdog_s", "watchdog_tick_s", "newton_per_count", "checksum")
Settings = Iterator[tuple[str, str]]
LineFile = OutputFile | CellFile | ValveFile


def set_device(device: DeviceProfile, line: LineFile) -> DeviceProfile:
    """Return the device as the rig says that it is set. ValueError where it cannot be set so."""
    changes: dict[str, Any] = {}
    said = {name: getattr(line, name) for name in _CONSTANTS if getattr(line, name, None) is not None}
    if device.is_modbus and (channel := said.pop(CHANNEL, 0)):
        changes |= _registers(device, channel)
    if said:
        changes["constants"] = {**device.constants, **said}
    if not isinstance(line, ValveFile) and line.checksum is not None:
        changes["checksum"] = line.checksum
    if isinstance(line, OutputFile):
        changes |= _watchdog(device, line)
    elif isinstance(line, CellFile):
        changes |= _counts(device, line)
    return replace(device, **changes) if changes else device


def find_unfit_settings(device: DeviceProfile, line: LineFile) -> Settings:
    """Yield (key, sentence) for what this device cannot be set to."""
    if not _says_any(line):
        return
    for name in _CONSTANTS:
        if (
            getattr(line, name, None) is not None
            and name not in device.constants
            and not (device.is_modbus and (name == ADDRESS or device.channels))
        ):
            yield name, f"{device.name} has no {name}: {_without(device, name)}"
    channel = getattr(line, CHANNEL, None)
    if channel is not None and device.channels and channel >= device.channels:
        yield CHANNEL, f"{device.name} has {device.channels} outputs: 0 to {device.channels - 1}"
        return
    if not isinstance(line, ValveFile) and line.checksum is not None and device.is_modbus:
        yield "checksum", f"{device.name} speaks Modbus RTU, which has its own: leave this line out"
        return
    if isinstance(line, OutputFile) and device.own_watchdog is None:
        for name in ("watchdog_s", "watchdog_tick_s"):
            if getattr(line, name) is not None:
                yield name, f"{device.name} has no watchdog: leave this line out"
    if isinstance(line, CellFile) and (name := _of_counts(line)) and _has_unit(device, line):
        yield name, f"{device.name} says its unit, or `unit` does: raw counts have none, leave one out"
        return
    try:
        complaints = [sentence for _, sentence in rehearse(set_device(device, line))]
    except ValueError as error:
        complaints = [str(error)]
    if complaints:
        yield _blamed(line), complaints[0]


def _without(device: DeviceProfile, name: str) -> str:
    if device.is_modbus and name == CHANNEL:
        return "its file names the registers of one output; `channels` in a copy of it says how many follow"
    return "leave this line out"


def _registers(device: DeviceProfile, channel: int) -> dict[str, Any]:
    """The exchanges of another output of a Modbus device."""
    exchanges = {name: getattr(device, name) for name in ("set_voltage", "read_voltage", "read_pressure")}
    return {
        name: replace(one, ask="", answer="", modbus=one.modbus.of_channel(channel))
        for name, one in exchanges.items()
        if one
    }


def _has_unit(device: DeviceProfile, line: CellFile) -> bool:
    return bool(line.unit or device.reading.unit or device.reading.template.field(UNIT))


def _of_counts(line: CellFile) -> str:
    """Return the setting that is of raw counts, empty where none is given; a zero of 0 changes nothing."""
    return next((name for name in ("newton_per_count", "zero_count") if getattr(line, name)), "")


def _says_any(line: LineFile) -> bool:
    return any(getattr(line, name, None) is not None for name in (*_NAMES, "zero_count"))


def _blamed(line: LineFile) -> str:
    """The setting that a device's own checks have refused: the first that is given."""
    return next((name for name in _NAMES if getattr(line, name, None) is not None), "device")


def _watchdog(device: DeviceProfile, line: OutputFile) -> dict[str, Any]:
    watchdog = device.own_watchdog
    if watchdog is None or (line.watchdog_s is None and line.watchdog_tick_s is None):
        return {}
    time_s, tick_s = line.watchdog_s or watchdog.time_s, line.watchdog_tick_s or watchdog.tick_s
    return {"watchdog": replace(watchdog, time_s=time_s, tick_s=tick_s)}


def _counts(device: DeviceProfile, line: CellFile) -> dict[str, Any]:
    if line.newton_per_count is None and line.zero_count is None:
        return {}
    name = "stream" if device.stream else "read_force"
    reading = device.stream or device.read_force
    if reading is None:
        return {}
    per_count = line.newton_per_count or reading.newton_per_count
    zero = reading.zero_count if line.zero_count is None else line.zero_count
    return {name: replace(reading, newton_per_count=per_count, zero_count=zero)}
