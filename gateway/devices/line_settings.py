"""How a serial line is set: what both ends must agree on before a byte means anything."""

from dataclasses import dataclass, replace
from typing import Annotated, Final, Literal

from annotated_types import Ge, Le

STRICT: Final = {"extra": "forbid"}  # read by pydantic in gateway.profiles

Parity = Literal["none", "even", "odd"]
_PARITY_LETTER: Final = {"none": "N", "even": "E", "odd": "O"}


@dataclass(frozen=True, slots=True, kw_only=True)
class SerialSettings:
    """Speed and frame of a serial line; `str()` is what people write: 9600 8N1."""

    __pydantic_config__ = STRICT
    baud: Annotated[int, Ge(300), Le(4_000_000)]  # bits per second
    data_bits: Literal[7, 8] = 8  # bits of a character
    parity: Parity = "none"  # check bit of a character
    stop_bits: Literal[1, 2] = 1  # pause after a character

    @property
    def bits_per_character(self) -> int:
        """On the wire: start bit, data, parity, stop bits."""
        return 1 + self.data_bits + (self.parity != "none") + self.stop_bits

    @property
    def character_s(self) -> float:
        """Time that one character takes on the wire, s."""
        return self.bits_per_character / self.baud

    def at(self, baud: int) -> "SerialSettings":
        """The same frame at another speed: what a rig file says about a device that can be set."""
        return replace(self, baud=baud)

    def __str__(self) -> str:
        return f"{self.baud} {self.data_bits}{_PARITY_LETTER[self.parity]}{self.stop_bits}"
