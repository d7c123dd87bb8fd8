"""The registers of a Modbus load-cell amplifier: one request, one moment. All that a weight is made of is in one answer.

Many amplifiers keep the weight as a positive number and its sign as a bit of another register. Read in two requests, the
sign may be another moment's: a force that passes zero would be read with the wrong sign. So there is one request.
"""

from dataclasses import dataclass
from typing import Annotated, Final, Literal

from annotated_types import Ge, Le

from gateway.defaults import STRICT
from gateway.devices.binary.register_access import RegisterType, WordOrder, number_field

FORCE: Final = "force"
MOST_REGISTERS: Final = 32  # of a request: what small amplifiers answer at a time

_WORDS: Final[dict[RegisterType, int]] = {"uint16": 1, "int16": 1, "uint32": 2, "int32": 2, "float32": 2}
_FLOAT_DECIMALS: Final = 4
_LARGEST: Final[dict[RegisterType, float]] = {
    "uint16": 65535.0,
    "int16": 32767.0,
    "uint32": 999_999.0,  # six digits: what the displays of such amplifiers have
    "int32": 999_999.0,
    "float32": 999_999.0,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class RegisterBit:
    """One bit of a register, and which value of it means what it stands for: 0 where it is 1 while all is well."""

    __pydantic_config__ = STRICT
    register: Annotated[int, Ge(0), Le(65535)]  # address on the wire, from 0
    bit: Annotated[int, Ge(0), Le(15)]  # 0 is the lowest
    value: Literal[0, 1] = 1  # of the bit, that means it


@dataclass(frozen=True, slots=True, kw_only=True)
class WeightRegisters:
    """One request for registers first..last, in which the weight, its sign and its health stand."""

    __pydantic_config__ = STRICT
    function: Literal[3, 4] = 3  # 3 reads holding registers, 4 input registers
    first: Annotated[int, Ge(0), Le(65535)]  # first register of the request, from 0 as on the wire
    last: Annotated[int, Ge(0), Le(65535)]  # last register of the request
    weight: Annotated[int, Ge(0), Le(65535)]  # register of the weight, of its first where it has two
    type: RegisterType = "int16"  # what the weight is
    word_order: WordOrder = "abcd"  # of a weight in two registers: abcd is the high word first
    decimals: Annotated[int, Ge(0), Le(6)] = 0  # of a weight in whole numbers: 2 means that 1234 is 12.34
    negative: RegisterBit | None = None  # says that the weight is negative
    overload: tuple[RegisterBit, ...] = ()  # any one says: no weight to rely on, counts as over-force
    unstable: tuple[RegisterBit, ...] = ()  # any one says: in motion

    def __post_init__(self) -> None:
        if not 1 <= self.count <= MOST_REGISTERS:
            raise ValueError(f"first..last = {self.first}..{self.last}: 1 to {MOST_REGISTERS} registers in one request")
        for name, register, words in self._wanted():
            if not self.first <= register <= self.last + 1 - words:
                raise ValueError(f"{name}: register {register} is not within first..last = {self.first}..{self.last}")
        if self.is_float and self.decimals:
            raise ValueError("decimals are of whole numbers: a float32 has its own point, leave them out")
        taken = range(self.weight, self.weight + _WORDS[self.type])
        if any(register in taken for name, register, _ in self._wanted() if name != "weight"):
            raise ValueError("a bit of the weight's own register is no sign and no state")

    def _wanted(self) -> list[tuple[str, int, int]]:
        bits = [("negative", self.negative)] if self.negative else []
        bits += [("overload", one) for one in self.overload] + [("unstable", one) for one in self.unstable]
        return [("weight", self.weight, _WORDS[self.type]), *((name, one.register, 1) for name, one in bits)]

    @property
    def count(self) -> int:
        """Number of registers of the request."""
        return self.last - self.first + 1

    @property
    def is_signed(self) -> bool:
        """Decide whether the weight can be negative."""
        return self.negative is not None or not self.type.startswith("uint")

    @property
    def is_float(self) -> bool:
        """Decide whether the weight carries its own point."""
        return self.type == "float32"

    @property
    def shown_decimals(self) -> int:
        """Decimals that a reading has: of a float32 as many as it tells apart at a hundred units."""
        return _FLOAT_DECIMALS if self.is_float else self.decimals

    @property
    def largest_shown(self) -> float:
        """The largest weight that fits, in the device's unit."""
        return _LARGEST[self.type] / 10.0**self.decimals

    def templates(self) -> tuple[str, str]:
        """Return question and answer as templates of PDUs in hexadecimal digits."""
        ask = f"{self.function:02X}{self.first:04X}{self.count:04X}"
        head = "".join(f"{{{word_name(register)}:04X}}" for register in range(self.first, self.weight))
        after = range(self.weight + _WORDS[self.type], self.last + 1)
        tail = "".join(f"{{{word_name(register)}:04X}}" for register in after)
        force = number_field(self.type, self.word_order, FORCE)
        return ask, f"{self.function:02X}{2 * self.count:02X}{head}{force}{tail}"


def word_name(register: int) -> str:
    """Return the name of a register's field in the template."""
    return f"register_{register}"
