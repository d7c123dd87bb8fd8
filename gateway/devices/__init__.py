"""Serial devices: how each speaks, both ends of its wire, and the simulated wire between them. Pure: bytes in, values out.

A device is a profile (profiles/devices/*.yaml): templates such as "SET {counts:d}" compile to an encoder and a decoder.
`output_host`, `output_device`, `cell_host` and `cell_device` make the four ends. What is said apart from how it is spelled
is in `messages`.
"""

from gateway.devices.codecs import cell_device, cell_host, output_device, output_host
from gateway.devices.fields import TemplateError, ValueRefused
from gateway.devices.line_settings import SerialSettings
from gateway.devices.profile import Certainty, DeviceProfile, DeviceRole
from gateway.devices.roles import CellDevice, CellHost, OutputDevice, OutputHost
from gateway.devices.valve import ValveDevice, ValveHost
from gateway.devices.valve_profile import ValveDirection
from gateway.devices.wire import PacedWire, resample_at_baud

__all__ = [
    "CellDevice",
    "CellHost",
    "Certainty",
    "DeviceProfile",
    "DeviceRole",
    "OutputDevice",
    "OutputHost",
    "PacedWire",
    "SerialSettings",
    "TemplateError",
    "ValueRefused",
    "ValveDevice",
    "ValveDirection",
    "ValveHost",
    "cell_device",
    "cell_host",
    "output_device",
    "output_host",
    "resample_at_baud",
]
