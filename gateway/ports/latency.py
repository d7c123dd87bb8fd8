"""USB adapters wait before they hand over what they received: 16 ms on an FTDI chip as it comes, which halves the rate of a
question-and-answer line. Ask the driver for low latency, and say so where it stays slow.
"""

import contextlib
import fcntl
import os
import struct
from pathlib import Path
from typing import Final

from gateway.ports.errors import SERIAL_FAILURES

_TIOCGSERIAL: Final = 0x541E  # linux/serial.h; Python's termios does not have these
_TIOCSSERIAL: Final = 0x541F
_SERIAL_STRUCT_BYTES: Final = 128  # struct serial_struct is 72 bytes on 64-bit machines, 60 on 32-bit ones
_FLAGS_OFFSET: Final = 16  # int type, line; unsigned port; int irq; then flags
_ASYNC_LOW_LATENCY: Final = 1 << 13
SLOW_MS: Final = 16  # what FTDI adapters start with: at 9600 baud it costs half of the cycle


def set_low_latency(descriptor: int, path: str, system: Path = Path("/sys")) -> str:
    """Ask for low latency; a sentence when an FTDI adapter stays at 16 ms, else empty. Never raises."""
    with contextlib.suppress(*SERIAL_FAILURES):  # ptys and many drivers know nothing of this
        _set_flag(descriptor)
    timer = latency_timer(path, system)
    if (latency_ms(path, system) or 0) >= SLOW_MS:
        with contextlib.suppress(OSError):
            timer.write_text("1")
    remaining_ms = latency_ms(path, system)
    if remaining_ms is None or remaining_ms < SLOW_MS:
        return ""
    return f"{path} hands over received bytes only every {remaining_ms} ms: echo 1 | sudo tee {timer} (lasting by a udev rule)"


def latency_timer(path: str, system: Path) -> Path:
    """Return where the FTDI driver keeps its timer."""
    return system / "class" / "tty" / Path(os.path.realpath(path)).name / "device" / "latency_timer"


def latency_ms(path: str, system: Path = Path("/sys")) -> int | None:
    """Return the adapter's latency timer, ms; None where the driver has none."""
    try:
        return int(latency_timer(path, system).read_text())
    except (OSError, ValueError):
        return None


def _set_flag(descriptor: int) -> None:
    settings = bytearray(fcntl.ioctl(descriptor, _TIOCGSERIAL, bytes(_SERIAL_STRUCT_BYTES)))
    (flags,) = struct.unpack_from("i", settings, _FLAGS_OFFSET)
    if not flags & _ASYNC_LOW_LATENCY:
        struct.pack_into("i", settings, _FLAGS_OFFSET, flags | _ASYNC_LOW_LATENCY)
        fcntl.ioctl(descriptor, _TIOCSSERIAL, bytes(settings))
