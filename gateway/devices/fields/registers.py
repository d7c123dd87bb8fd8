"""The shape that is not for people: numbers of Modbus registers, as hexadecimal digits."""

import struct
from dataclasses import dataclass
from math import frexp, isfinite
from typing import Final

from gateway.devices.fields.field import Value, finite, refuse

_WORD_FORMATS: Final = {"uint16": ">H", "int16": ">h", "uint32": ">I", "int32": ">i", "float32": ">f"}
_FLOAT_BITS: Final = 24  # of its mantissa
_FLOAT_DECIMALS: Final = 4  # of a float32 setting: a tenth of a millivolt, which a float32 of 10 V still tells apart


@dataclass(frozen=True, slots=True)
class RegisterNumber:
    """{counts:int32}, or {counts:int32-cdab} with the low word first: a number in Modbus registers, as hexadecimal digits."""

    name: str
    kind: str
    is_low_first: bool = False

    @property
    def is_open(self) -> bool:
        """Return False: a register has four digits."""
        return False

    @property
    def decimals(self) -> int:
        """Decimals that such a number is rounded to before it is sent."""
        return _FLOAT_DECIMALS if self.kind == "float32" else 0

    def step_below(self, largest: float) -> float:
        """Return the widest gap between two numbers that it tells apart up to this one."""
        is_float = self.kind == "float32"
        return max(10.0**-self.decimals, 2.0 ** (frexp(largest)[1] - _FLOAT_BITS) if is_float else 0.0)

    @property
    def pattern(self) -> str:
        """Regular expression of the registers' digits."""
        return rf"[0-9A-F]{{{2 * struct.calcsize(_WORD_FORMATS[self.kind])}}}"

    def encode(self, value: Value) -> str:
        """Return the digits. ValueRefused for what the registers cannot hold."""
        number = finite(self.name, value)
        if self.kind != "float32" and number != int(number):
            raise refuse(self.name, value, "not a whole number")
        try:
            data = struct.pack(_WORD_FORMATS[self.kind], number if self.kind == "float32" else int(number))
        except (struct.error, OverflowError):
            raise refuse(self.name, value, f"does not fit into {self.kind}") from None
        return self._ordered(data).hex().upper()

    def decode(self, text: str) -> Value | None:
        """Return the number, None for a float that is none."""
        (number,) = struct.unpack(_WORD_FORMATS[self.kind], self._ordered(bytes.fromhex(text)))
        return number if isfinite(number) else None

    def _ordered(self, data: bytes) -> bytes:
        return data[2:] + data[:2] if self.is_low_first else data
