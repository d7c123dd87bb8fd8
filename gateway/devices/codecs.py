"""Which codec speaks for a profile. A table, no registry: a new codec is one import and one line."""

from collections.abc import Callable
from typing import Final, TypeVar

from gateway.devices.binary.hbm_cell import HbmCellDevice, HbmCellHost
from gateway.devices.binary.modbus_cell import ModbusCellDevice, ModbusCellHost
from gateway.devices.profile import MODBUS_RTU, TEMPLATE, DeviceProfile, DeviceRole
from gateway.devices.roles import CellDevice, CellHost, OutputDevice, OutputHost
from gateway.devices.template_codecs.cell import TemplateCellDevice, TemplateCellHost
from gateway.devices.template_codecs.output_device import TemplateOutputDevice
from gateway.devices.template_codecs.output_host import TemplateOutputHost

Ends = TypeVar("Ends")
OutputEnds = tuple[Callable[[DeviceProfile], OutputHost], Callable[[DeviceProfile], OutputDevice]]
CellEnds = tuple[
    Callable[[DeviceProfile, int, str | None], CellHost], Callable[[DeviceProfile, str | None], CellDevice]
]

OUTPUT_CODECS: Final[dict[str, OutputEnds]] = {
    TEMPLATE: (TemplateOutputHost, TemplateOutputDevice),
    MODBUS_RTU: (TemplateOutputHost, TemplateOutputDevice),  # its registers are templates of PDUs
}
CELL_CODECS: Final[dict[str, CellEnds]] = {
    TEMPLATE: (TemplateCellHost, TemplateCellDevice),
    MODBUS_RTU: (ModbusCellHost, ModbusCellDevice),
    "hbm-binary": (HbmCellHost, HbmCellDevice),
}


class UnknownCodecError(ValueError):
    """The profile names a codec that is none of its role."""


def _find(table: dict[str, Ends], profile: DeviceProfile, role: DeviceRole) -> Ends:
    if profile.role is not role:
        raise ValueError(f"{profile.name} is of role {profile.role}, {role} is needed here")
    if profile.codec not in table:
        raise UnknownCodecError(f"{profile.name}: codec {profile.codec} is not one of {', '.join(table)}")
    return table[profile.codec]


def output_host(profile: DeviceProfile) -> OutputHost:
    """Return our end of an output device's line.
    ValueError when the profile is of no output, or its codec is unknown; so the three below."""
    return _find(OUTPUT_CODECS, profile, DeviceRole.OUTPUT)[0](profile)


def output_device(profile: DeviceProfile) -> OutputDevice:
    """Return the device's end of an output's line."""
    return _find(OUTPUT_CODECS, profile, DeviceRole.OUTPUT)[1](profile)


def cell_host(profile: DeviceProfile, sign: int = 1, unit: str | None = None) -> CellHost:
    """Return our end of a load cell's line; sign and unit are the rig's (see CellLine)."""
    return _find(CELL_CODECS, profile, DeviceRole.LOAD_CELL)[0](profile, sign, unit)


def cell_device(profile: DeviceProfile, unit: str | None = None) -> CellDevice:
    """Return the amplifier's end; unit as for `cell_host`."""
    return _find(CELL_CODECS, profile, DeviceRole.LOAD_CELL)[1](profile, unit)
