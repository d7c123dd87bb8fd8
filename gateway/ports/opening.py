"""Open and configure a serial port: pyserial knows every termios corner, so it opens; we keep only the descriptor."""

import errno
import os
import termios
from collections.abc import Callable
from typing import Any, Final

import serial

from gateway.devices import SerialSettings
from gateway.ports.errors import SERIAL_FAILURES, PortError, classify_open_failure, explain_open_failure
from gateway.ports.listing import present_paths

_PARITY: Final = {"none": serial.PARITY_NONE, "even": serial.PARITY_EVEN, "odd": serial.PARITY_ODD}
_MINIMUM, _TIME = termios.VMIN, termios.VTIME
_MAKER_OF_TERMINALS: Final = os.makedev(5, 2)  # /dev/ptmx, wherever it is, see pts(4)
TerminalSettings = list[Any]  # as termios.tcgetattr returns them
Explain = Callable[[str, Exception], PortError]


def explain_in_full(path: str, error: Exception) -> PortError:
    """Return the reason why a port did not open, for people. Who holds it is looked for among all that every process has open,
    which may take longer than a control loop has."""
    return explain_open_failure(path, error, present_paths())


def explain_in_brief(path: str, error: Exception) -> PortError:
    """Return the same in no time, for one try of many."""
    return PortError(classify_open_failure(error), f"{path} does not open: {error}")


def open_descriptor(path: str, settings: SerialSettings, explain: Explain = explain_in_full) -> int:
    """Return a raw, non-blocking, exclusively locked descriptor of the port, input flushed. PortError says why there is none.

    The lock is flock's: TIOCEXCL would outlive a killed process as EBUSY for the guardian too. Ptys have no modem lines,
    which pyserial tolerates.
    """
    try:
        return _take_descriptor(_open_quietly(path, settings))
    except (*SERIAL_FAILURES, ValueError) as error:  # ValueError: a baud rate that termios does not know
        raise explain(path, error) from error


def open_serial(path: str, settings: SerialSettings, timeout_s: float) -> serial.Serial:
    """Return pyserial's own object of the port, locked, for whoever reads and writes without a loop. PortError as above.

    timeout_s is given now, because a pty takes no settings a second time once it was told of a parity.
    """
    try:
        return _open_quietly(path, settings, timeout_s)
    except (*SERIAL_FAILURES, ValueError) as error:
        raise explain_in_full(path, error) from error


def settings_of(descriptor: int) -> TerminalSettings:
    """Return what the terminal is set to now. SERIAL_FAILURES where there is none any more."""
    return termios.tcgetattr(descriptor)


def let_send(descriptor: int) -> None:
    """Let the terminal send, where another program has stopped it: that stays, behind its end too."""
    termios.tcflow(descriptor, termios.TCOON)


def restore_settings(descriptor: int, settings: TerminalSettings, baud: int) -> bool:
    """Set the terminal as it was; return whether it is. A speed that has no name of its own cannot be told
    this way. SERIAL_FAILURES where there is none any more."""
    if not hasattr(termios, f"B{baud}"):
        return False
    termios.tcsetattr(descriptor, termios.TCSANOW, settings)
    return settings_of(descriptor) == settings


def _open_quietly(path: str, settings: SerialSettings, timeout_s: float = 0.0) -> serial.Serial:
    try:
        return _open_configured(path, settings, timeout_s)
    except termios.error as error:
        if error.args[0] != errno.EINVAL or not os.path.realpath(path).startswith("/dev/pts/"):
            raise
        return _open_configured(
            path, SerialSettings(baud=settings.baud), timeout_s
        )  # a pty has no frame, and refuses to be told of one


def _take_descriptor(port: serial.Serial) -> int:
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


def _open_configured(path: str, settings: SerialSettings, timeout_s: float) -> serial.Serial:
    if os.path.exists(path) and os.stat(path).st_rdev == _MAKER_OF_TERMINALS:  # noqa: PTH110, PTH116
        # it would open, as a new terminal, and nobody answers there
        raise OSError(errno.ENOTTY, os.strerror(errno.ENOTTY), path)
    return serial.Serial(
        path,
        settings.baud,
        bytesize=settings.data_bits,
        parity=_PARITY[settings.parity],
        stopbits=settings.stop_bits,
        timeout=timeout_s,
        write_timeout=timeout_s or None,
        exclusive=True,
    )


def _return_eagain_for_nothing(descriptor: int) -> None:
    """With VMIN 0, as pyserial leaves it, a read of nothing and a hang-up are both b""; with 1 the first is EAGAIN."""
    attributes = termios.tcgetattr(descriptor)
    attributes[6][_MINIMUM], attributes[6][_TIME] = 1, 0
    termios.tcsetattr(descriptor, termios.TCSANOW, attributes)
    let_send(descriptor)
    os.set_blocking(descriptor, False)
