"""The table of shipped devices in profiles/README.md, as the files say it."""

from gateway.devices import DeviceProfile, DeviceRole
from gateway.profiles.find import list_shipped
from gateway.profiles.load import load_device


def render_devices() -> str:
    """Return the table: what each device is, how it is wired, and whether it has a watchdog and an identity."""
    head = [
        "| file | what it is | role | wire | watchdog | says what it is | certainty |",
        "|---|---|---|---|---|---|---|",
    ]
    return "\n".join([*head, *map(_row, _shipped())]) + "\n"


def _shipped() -> list[DeviceProfile]:
    devices = [load_device(name) for name in list_shipped("device")]
    return sorted(devices, key=lambda one: (list(DeviceRole).index(one.role), one.name))


def _row(device: DeviceProfile) -> str:
    wire = f"Modbus RTU, {device.serial}" if device.is_modbus else str(device.serial)
    watchdog = f"{device.own_watchdog.time_s:g} s" if device.own_watchdog else "none"
    watchdog = watchdog if device.role is DeviceRole.OUTPUT else ""
    identity = "yes" if device.own_identity else "no"
    cells = [
        f"[{device.name}](devices/{device.name}.yaml)",
        device.description,
        device.role.value,
        wire,
        watchdog,
        identity,
    ]
    return f"| {' | '.join([*cells, f'{device.certainty}; {device.hardware}'])} |"
