"""How a serial line is set: what both ends must agree on before a byte means anything."""

from dataclasses import dataclass, replace
from typing import Final, Literal, cast

from gateway.defaults import STRICT

Baud = Literal[
    300, 600, 1200, 2400, 4800, 9600, 14400, 19200, 28800, 38400, 56000, 57600, 76800, 115200, 128000, 230400, 250000,
    256000, 460800, 500000, 576000, 921600, 1000000, 1152000, 1500000, 2000000, 2500000, 3000000, 3500000, 4000000,
]  # fmt: skip
"""Speeds that devices offer and Linux can set. A list, not a range, for 115300 is a slip of the finger."""

Parity = Literal["none", "even", "odd"]
_PARITY_LETTER: Final = {"none": "N", "even": "E", "odd": "O"}


@dataclass(frozen=True, slots=True, kw_only=True)
class SerialSettings:
    """Speed and frame of a serial line; `str()` is what people write: 9600 8N1."""

    __pydantic_config__ = STRICT
    baud: Baud  # bits per second
    data_bits: Literal[7, 8] = 8  # bits of a character
    parity: Parity = "none"  # check bit of a character
    stop_bits: Literal[1, 2] = 1  # pause after a character

    @property
    def bits_per_character(self) -> int:
        """Bits of a character on the wire: start bit, data, parity, stop bits."""
        return 1 + self.data_bits + (self.parity != "none") + self.stop_bits

    @property
    def character_s(self) -> float:
        """Time that one character takes on the wire, s."""
        return self.bits_per_character / self.baud

    def at(self, baud: int | None) -> "SerialSettings":
        """Return the same frame at another speed: what a rig file says about a device that can be set. None: at this one."""
        return self if baud is None else replace(self, baud=cast("Baud", baud))

    def __str__(self) -> str:
        return f"{self.baud} {self.data_bits}{_PARITY_LETTER[self.parity]}{self.stop_bits}"
