"""One Modbus request of a device profile: which registers are written or read, and which number is in them.

A request becomes a pair of templates, its question and its answer as PDUs in hexadecimal digits: `06 0000 {counts:uint16}`
without the blanks. So everything that is built on templates holds for Modbus devices too; unit and checksum are added by
rtu_framing. Function codes and PDUs: Modbus Application Protocol V1.1b3, sections 6.3, 6.4, 6.6 and 6.12.
"""

from dataclasses import dataclass, replace
from typing import Annotated, Final, Literal

from annotated_types import Ge, Le

from gateway.defaults import STRICT

RegisterType = Literal["uint16", "int16", "uint32", "int32", "float32"]
WordOrder = Literal["abcd", "cdab"]
Function = Literal[3, 4, 6, 16]

VALUE: Final = "value"
"""Name of the number in a template that carries several: the others are read over."""

_READING: Final = (3, 4)
_WORDS: Final[dict[RegisterType, int]] = {"uint16": 1, "int16": 1, "uint32": 2, "int32": 2, "float32": 2}


@dataclass(frozen=True, slots=True, kw_only=True)
class RegisterAccess:
    """A number in the registers of a Modbus device. Functions: 3 reads holding registers, 4 input registers, 6 writes one
    register, 16 several."""

    __pydantic_config__ = STRICT
    function: Function  # 3, 4: read; 6, 16: write
    register: Annotated[int, Ge(0), Le(65535)]  # address on the wire, from 0: a manual's 40001 is 0, its 40008 is 7
    type: RegisterType = "uint16"  # what the number is
    word_order: WordOrder = "abcd"  # of a number in two registers: abcd is the high word first

    def __post_init__(self) -> None:
        if self.function == 6 and self.words != 1:
            raise ValueError(f"function 6 writes one register, {self.type} has two: use function 16")

    @property
    def words(self) -> int:
        """Number of registers that the number takes."""
        return _WORDS[self.type]

    @property
    def is_reading(self) -> bool:
        """Decide whether the request changes nothing."""
        return self.function in _READING

    def of_channel(self, channel: int) -> "RegisterAccess":
        """Return the access to the same number of another output, counted from 0: its registers follow one another."""
        return replace(self, register=self.register + channel * self.words)

    def question(self) -> str:
        """Return the request's PDU as a template."""
        head = f"{self.function:02X}{self.register:04X}"
        if self.function == 6:
            return head + number_field(self.type, self.word_order)
        if self.is_reading:
            return f"{head}{self.words:04X}"
        return f"{head}{self.words:04X}{2 * self.words:02X}" + number_field(self.type, self.word_order)

    def answer(self) -> str:
        """Return the answer's PDU as a template; function 16 says only that it was done."""
        if self.is_reading:
            return f"{self.function:02X}{2 * self.words:02X}" + number_field(self.type, self.word_order)
        return self.question() if self.function == 6 else f"10{self.register:04X}{self.words:04X}"


def number_field(kind: RegisterType, word_order: WordOrder, name: str = VALUE) -> str:
    """Return the field of a number in registers, as it stands in a template."""
    return f"{{{name}:{kind}{'-cdab' if word_order == 'cdab' and _WORDS[kind] == 2 else ''}}}"


def check_direction(access: RegisterAccess | None, *, reads: bool) -> None:
    """Raise ValueError for a request that writes where it should read, or the reverse."""
    if access and access.is_reading is not reads:
        wanted = "3 or 4, which read" if reads else "6 or 16, which write"
        raise ValueError(f"modbus: function {access.function} is none of {wanted}")


def templates_of(access: RegisterAccess | None, ask: str, answer: str) -> tuple[str, str]:
    """Return question and answer of an exchange as templates: those in the profile, or those that `modbus` stands for.
    ValueError where there is neither, or both."""
    if access is None:
        if not ask:
            raise ValueError("`ask` is missing: the sentence that asks, or `modbus` with the registers")
        return ask, answer
    made = access.question(), access.answer()
    if (ask, answer) not in (("", ""), made):
        raise ValueError("`modbus` stands for question and answer: leave `ask` and `answer` out")
    return made
