"""Serial lines: bytes in and out with a time of arrival. What the bytes mean is not known here (see gateway.devices).

`SerialPort` is the real one; `PacedPty` is the device's end of a simulated one; `list_ports` says
what is plugged in.
"""

from gateway.ports.errors import PortError
from gateway.ports.holders import Holder, holders_of
from gateway.ports.listing import PortInfo, list_ports
from gateway.ports.paced_pty import PacedPty
from gateway.ports.port import PortEvents
from gateway.ports.pseudo_terminal import Pty
from gateway.ports.serial_port import SerialPort

__all__ = [
    "Holder",
    "PacedPty",
    "PortError",
    "PortEvents",
    "PortInfo",
    "Pty",
    "SerialPort",
    "holders_of",
    "list_ports",
]
