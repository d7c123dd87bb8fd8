"""Open and configure a serial port: pyserial knows every termios corner, so it opens; we keep only the descriptor."""

import errno
import os
import termios
from typing import Final

import serial

from gateway.devices import SerialSettings
from gateway.ports.errors import SERIAL_FAILURES, explain_open_failure
from gateway.ports.listing import present_paths

_PARITY: Final = {"none": serial.PARITY_NONE, "even": serial.PARITY_EVEN, "odd": serial.PARITY_ODD}
_MINIMUM, _TIME = termios.VMIN, termios.VTIME


def open_descriptor(path: str, settings: SerialSettings) -> int:
    """Return a raw, non-blocking, exclusively locked descriptor of the port, input flushed. PortError says why there is none.

    The lock is flock's: TIOCEXCL would outlive a killed process as EBUSY for the guardian too. Ptys have no modem lines,
    which pyserial tolerates.
    """
    try:
        return _open_quietly(path, settings)
    except (*SERIAL_FAILURES, ValueError) as error:  # ValueError: a baud rate that termios does not know
        raise explain_open_failure(path, error, present_paths()) from error


def _open_quietly(path: str, settings: SerialSettings) -> int:
    try:
        port = _open_configured(path, settings)
    except termios.error as error:
        if error.args[0] != errno.EINVAL or not os.path.realpath(path).startswith("/dev/pts/"):
            raise
        port = _open_configured(
            path, SerialSettings(baud=settings.baud)
        )  # a pty has no frame, and refuses to be told of one
    try:
        descriptor = os.dup(port.fileno())  # the same open file: lock and settings stay, pyserial's four pipes go
    finally:
        port.close()
    try:
        _return_eagain_for_nothing(descriptor)
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def _open_configured(path: str, settings: SerialSettings) -> serial.Serial:
    return serial.Serial(
        path,
        settings.baud,
        bytesize=settings.data_bits,
        parity=_PARITY[settings.parity],
        stopbits=settings.stop_bits,
        timeout=0,
        exclusive=True,
    )


def _return_eagain_for_nothing(descriptor: int) -> None:
    """With VMIN 0, as pyserial leaves it, a read of nothing and a hang-up are both b""; with 1 the first is EAGAIN."""
    attributes = termios.tcgetattr(descriptor)
    attributes[6][_MINIMUM], attributes[6][_TIME] = 1, 0
    termios.tcsetattr(descriptor, termios.TCSANOW, attributes)
    os.set_blocking(descriptor, False)
