"""Device files: the profile's own rules, the codec that it names, and whether both ends of its wire understand each other."""

from collections.abc import Callable
from typing import Final

from gateway.devices import DeviceProfile, DeviceRole, ValveHost, cell_device, output_host
from gateway.devices.codecs import UnknownCodecError
from gateway.devices.rehearsal import rehearse
from gateway.profiles.strict_yaml.faults import ProfileFault
from gateway.profiles.strict_yaml.text import Document
from gateway.profiles.strict_yaml.typed import build

_MAKE: Final[dict[DeviceRole, Callable[[DeviceProfile], object]]] = {
    DeviceRole.OUTPUT: output_host,
    DeviceRole.LOAD_CELL: cell_device,
    DeviceRole.VALVE: ValveHost,
}


def read_device(document: Document) -> tuple[DeviceProfile | None, list[ProfileFault]]:
    """Return the device profile of a file, or None and every fault."""
    device, faults = build(DeviceProfile, document)
    if device is None:
        return None, faults
    try:
        _MAKE[device.role](device)
    except UnknownCodecError as error:
        return None, [document.fault(("codec",), str(error))]
    except ValueError as error:
        return None, [document.fault((), str(error))]
    faults = [document.fault(place, reason) for place, reason in rehearse(device)]
    return (None, faults) if faults else (device, [])
