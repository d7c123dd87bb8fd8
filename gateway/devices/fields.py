"""The five field shapes of a text template: whole number, hex number, decimals, choice, text.

    {counts:d} {counts:04d} {counts:+05d}   whole number, open or of fixed width
    {address:02X}                           upper-case hex of fixed width
    {voltage_v:+07.3f} {voltage_v:.4f}      decimals, open or of fixed width; the point is always there
    {status:ST|US|OL} {status: |M|O}        one of the words; the first is the default; one may be a blank
    {text:s} {model:8s}                     printable text, open or of fixed width

Each shape is both ways: it encodes a value or refuses it (nan, inf, too wide), and decodes its own text. A shape with a
width reads blanks where zeros could stand, as displays that suppress leading zeros send them, and nothing else leniently:
a missing decimal point is no number.

A sixth shape is not for people: {force:int32} and its like are Modbus registers as hexadecimal digits, in templates that
`modbus:` of a profile stands for (binary/register_access.py).
"""

import re
import struct
from dataclasses import dataclass
from functools import cache
from math import isfinite, nan
from typing import Final, Protocol

Value = float | int | str

_LONGEST_NUMBER: Final = 10  # digits of an open number: more is not a reading but noise


class TemplateError(ValueError):
    """The profile's author wrote a template that means nothing; the sentence quotes it."""


class ValueRefused(ValueError):  # noqa: N818 - says what happened, as Refused does
    """A value that this device's grammar cannot carry: nan, inf, too wide, not one of the words, out of range."""


class Field(Protocol):
    """One hole of a template. pattern: regular expression of its bytes; is_open: its length is not fixed."""

    @property
    def name(self) -> str:
        """Name that stands in the template's braces."""

    @property
    def pattern(self) -> str:
        """Regular expression that matches every text of this field."""

    @property
    def is_open(self) -> bool:
        """Decide whether the field is of open length."""

    def encode(self, value: Value) -> str:
        """Return the text of a value on the wire. ValueRefused when the field cannot hold it."""

    def decode(self, text: str) -> Value | None:
        """Return the value of a text that matches `pattern`, None where it means none."""


def _refuse(name: str, value: Value, why: str) -> ValueRefused:
    return ValueRefused(f"{name} = {value}: {why}")


def _finite(name: str, value: Value) -> float:
    if isinstance(value, str):
        raise _refuse(name, value, "not a number")
    if not isfinite(value):
        raise _refuse(name, value, "not a finite number")
    return value


def _of_width(name: str, text: str, width: int) -> str:
    if width and len(text) != width:
        raise _refuse(name, text, f"does not fit in {width} characters")
    return text


_PADDED_NUMBER = r"(?:[+-] *| *[+-]?)"  # "+  12" and "  +12": both orders are sent by real indicators


_WHOLE_NUMBER: Final = re.compile(rf"{_PADDED_NUMBER}\d+")


@cache
def _number_with_decimals(decimals: int) -> re.Pattern[str]:
    return re.compile(rf"{_PADDED_NUMBER}\d+\.\d{{{decimals}}}")


@dataclass(frozen=True, slots=True)
class WholeNumber:
    """{counts:d}; width 0 is open."""

    name: str
    sign: str = ""
    zero: str = ""
    width: int = 0

    @property
    def is_open(self) -> bool:
        """Decide whether the number takes as many digits as it needs."""
        return self.width == 0

    @property
    def pattern(self) -> str:
        """Regular expression of a signed whole number, padded to the width where there is one."""
        return rf"[+-]?\d{{1,{_LONGEST_NUMBER}}}" if self.is_open else rf"[ +\-0-9]{{{self.width}}}"

    def encode(self, value: Value) -> str:
        """Return the digits. ValueRefused for a fraction, or a number that does not fit."""
        number = _finite(self.name, value)
        if number != int(number):
            raise _refuse(self.name, value, "not a whole number")
        if abs(number) >= 10**_LONGEST_NUMBER:
            raise _refuse(self.name, value, "too large")
        return _of_width(self.name, format(int(number), f"{self.sign}{self.zero}{self.width or ''}d"), self.width)

    def decode(self, text: str) -> Value | None:
        """Return the whole number, None for blanks between digits or signs alone."""
        return int(text.replace(" ", "")) if _WHOLE_NUMBER.fullmatch(text) else None


@dataclass(frozen=True, slots=True)
class HexNumber:
    """{address:02X}"""

    name: str
    width: int

    @property
    def is_open(self) -> bool:
        """Return False: a hexadecimal number has a fixed width."""
        return False

    @property
    def pattern(self) -> str:
        """Regular expression of upper-case hexadecimal digits."""
        return rf"[0-9A-F]{{{self.width}}}"

    def encode(self, value: Value) -> str:
        """Return the digits, with leading zeros. ValueRefused for a fraction, a negative number, or one that does not fit."""
        number = _finite(self.name, value)
        if number != int(number) or number < 0:
            raise _refuse(self.name, value, "not a whole number from 0")
        return _of_width(self.name, format(int(number), f"0{self.width}X"), self.width)

    def decode(self, text: str) -> Value | None:
        """Return the number of these digits."""
        return int(text, 16)


@dataclass(frozen=True, slots=True)
class Decimals:
    """{voltage_v:+07.3f}; width 0 is open. All blanks decode to nan: an indicator that shows nothing."""

    name: str
    sign: str
    zero: str
    width: int
    decimals: int

    @property
    def is_open(self) -> bool:
        """Decide whether the number takes as many digits as it needs."""
        return self.width == 0

    @property
    def pattern(self) -> str:
        """Regular expression of a number with a fixed count of decimals, padded to the width where there is one."""
        if self.is_open:
            return rf"[+-]?\d{{1,{_LONGEST_NUMBER}}}\.\d{{{self.decimals}}}"
        return rf"[ +\-0-9.]{{{self.width}}}"

    def encode(self, value: Value) -> str:
        """Return the rounded number, never as -0.00. ValueRefused for one that is not finite or does not fit."""
        number = _finite(self.name, value)
        if abs(number) >= 10.0**_LONGEST_NUMBER:
            raise _refuse(self.name, value, "too large")
        text = format(number, f"{self.sign}z{self.zero}{self.width or ''}.{self.decimals}f")  # z: no minus before 0.00
        return _of_width(self.name, text, self.width)

    @property
    def blank(self) -> str:
        """Return the text of a display that shows nothing."""
        return " " * self.width

    def decode(self, text: str) -> Value | None:
        """Return the number, NaN for a blank display, None for anything else."""
        if not self.is_open and not text.strip(" +-"):
            return nan
        if _number_with_decimals(self.decimals).fullmatch(text):
            return float(text.replace(" ", ""))
        return None


_WORD_FORMATS: Final = {"uint16": ">H", "int16": ">h", "uint32": ">I", "int32": ">i", "float32": ">f"}
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

    @property
    def pattern(self) -> str:
        """Regular expression of the registers' digits."""
        return rf"[0-9A-F]{{{2 * struct.calcsize(_WORD_FORMATS[self.kind])}}}"

    def encode(self, value: Value) -> str:
        """Return the digits. ValueRefused for what the registers cannot hold."""
        number = _finite(self.name, value)
        if self.kind != "float32" and number != int(number):
            raise _refuse(self.name, value, "not a whole number")
        try:
            data = struct.pack(_WORD_FORMATS[self.kind], number if self.kind == "float32" else int(number))
        except (struct.error, OverflowError):
            raise _refuse(self.name, value, f"does not fit into {self.kind}") from None
        return self._ordered(data).hex().upper()

    def decode(self, text: str) -> Value | None:
        """Return the number, None for a float that is none."""
        (number,) = struct.unpack(_WORD_FORMATS[self.kind], self._ordered(bytes.fromhex(text)))
        return number if isfinite(number) else None

    def _ordered(self, data: bytes) -> bytes:
        return data[2:] + data[:2] if self.is_low_first else data


@dataclass(frozen=True, slots=True)
class Choice:
    """{status:ST|US|OL}"""

    name: str
    words: tuple[str, ...]

    @property
    def is_open(self) -> bool:
        """Return False: each word is known with its length."""
        return False

    @property
    def pattern(self) -> str:
        """Regular expression of the words, longest first."""
        return "|".join(re.escape(word) for word in sorted(self.words, key=len, reverse=True))

    def encode(self, value: Value) -> str:
        """Return the word itself. ValueRefused for another one."""
        if value not in self.words:
            raise _refuse(self.name, value, f"not one of {', '.join(self.words)}")
        return str(value)

    def decode(self, text: str) -> Value | None:
        """Return the word itself."""
        return text


@dataclass(frozen=True, slots=True)
class Text:
    """{model:8s}; width 0 is open. Fixed width is padded with blanks on the right."""

    name: str
    width: int = 0

    @property
    def is_open(self) -> bool:
        """Decide whether the text takes as many characters as it has."""
        return self.width == 0

    @property
    def pattern(self) -> str:
        """Regular expression of printable ASCII."""
        return "[ -~]+?" if self.is_open else rf"[ -~]{{{self.width}}}"

    def encode(self, value: Value) -> str:
        """Return the text, padded to the width. ValueRefused for characters that do not print or blanks at the end."""
        text = str(value)
        if not re.fullmatch("[ -~]+", text) or text != text.rstrip(" "):
            raise _refuse(self.name, repr(value), "not printable text")
        return _of_width(self.name, text.ljust(self.width), self.width)

    def decode(self, text: str) -> Value | None:
        """Return the text without the blanks that pad it."""
        return text.rstrip(" ")


_WHOLE = re.compile(r"(\+?)(0?)(\d{0,2})d")
_HEX = re.compile(r"0([1-8])X")
_DECIMALS = re.compile(r"(\+?)(0?)(\d{0,2})\.([1-9])f")
_TEXT = re.compile(r"(\d{0,2})s")
_REGISTERS = re.compile(r"(u?int16|u?int32|float32)(-cdab)?")
_WORD = re.compile(r"[!-~]+| +")  # no blank beside letters: `ST | US` would be a slip that no line ever matches


def field_from(name: str, spec: str) -> Field:
    """Return the field that {name:spec} means; TemplateError where it is none of the five shapes."""
    if match := _WHOLE.fullmatch(spec):
        return WholeNumber(name, match[1], match[2], int(match[3] or 0))
    if match := _HEX.fullmatch(spec):
        return HexNumber(name, int(match[1]))
    if match := _DECIMALS.fullmatch(spec):
        return Decimals(name, match[1], match[2], int(match[3] or 0), int(match[4]))
    if match := _TEXT.fullmatch(spec):
        return Text(name, int(match[1] or 0))
    if match := _REGISTERS.fullmatch(spec):
        return RegisterNumber(name, match[1], bool(match[2]))
    if "|" in spec:
        return _choice(name, spec)
    raise TemplateError(f"{{{name}:{spec}}} is none of d, 04d, 02X, +07.3f, ONE|TWO, s")


def _choice(name: str, spec: str) -> Choice:
    words = tuple(spec.split("|"))
    for word in words:
        if not _WORD.fullmatch(word):
            raise TemplateError(f"{{{name}:{spec}}}: {word!r} is no word: characters without blanks, or blanks alone")
    if len(set(words)) < len(words):
        raise TemplateError(f"{{{name}:{spec}}} has a word twice")
    return Choice(name, words)
