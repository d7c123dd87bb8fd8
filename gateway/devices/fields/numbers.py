"""Shapes of numbers in text: whole, hexadecimal, with decimals, with an exponent."""

import re
from dataclasses import dataclass
from functools import cache
from math import ceil, isfinite, log10, nan
from typing import Final

from gateway.devices.fields.field import LONGEST_NUMBER, Value, finite, of_width, refuse

_DECIMALS_OF_G: Final = 5  # behind its first digit
_PADDED_NUMBER = r"(?:[+-] *| *[+-]?)"  # "+  12" and "  +12": both orders are sent by real indicators


_WHOLE_NUMBER: Final = re.compile(rf"{_PADDED_NUMBER}\d+")


@cache
def _number_with_decimals(decimals: int, point: str) -> re.Pattern[str]:
    return re.compile(rf"{_PADDED_NUMBER}\d+[{point}]\d{{{decimals}}}")


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
        return rf"[+-]?\d{{1,{LONGEST_NUMBER}}}" if self.is_open else rf"[ +\-0-9]{{{self.width}}}"

    def encode(self, value: Value) -> str:
        """Return the digits. ValueRefused for a fraction, or a number that does not fit."""
        number = finite(self.name, value)
        if number != int(number):
            raise refuse(self.name, value, "not a whole number")
        if abs(number) >= 10**LONGEST_NUMBER:
            raise refuse(self.name, value, "too large")
        return of_width(self.name, format(int(number), f"{self.sign}{self.zero}{self.width or ''}d"), self.width)

    def decode(self, text: str) -> Value | None:
        """Return the whole number, None for blanks between digits or signs alone."""
        return int(text.replace(" ", "")) if _WHOLE_NUMBER.fullmatch(text) else None


@dataclass(frozen=True, slots=True)
class HexNumber:
    """{address:02X}; with a sign, {counts:+04X}, the two's complement: FFFF is -1."""

    name: str
    width: int
    is_signed: bool = False
    letter: str = "X"

    @property
    def is_open(self) -> bool:
        """Return False: a hexadecimal number has a fixed width."""
        return False

    @property
    def pattern(self) -> str:
        """Regular expression of hexadecimal digits, in upper case or, {x:04x}, in lower case."""
        return rf"[0-9{'A-F' if self.letter == 'X' else 'a-f'}]{{{self.width}}}"

    def encode(self, value: Value) -> str:
        """Return the digits, with leading zeros. ValueRefused for a fraction, a number that does not fit, or a negative one
        without a sign."""
        number = finite(self.name, value)
        if self.is_signed:
            return self._complement(number)
        if number != int(number) or number < 0:
            raise refuse(self.name, value, "not a whole number from 0")
        return of_width(self.name, format(int(number), f"0{self.width}{self.letter}"), self.width)

    def decode(self, text: str) -> Value | None:
        """Return the number of these digits."""
        number = int(text, 16)
        return number - self._span if self.is_signed and 2 * number >= self._span else number

    @property
    def _span(self) -> int:
        return int(16**self.width)

    def _complement(self, number: float) -> str:
        if number != int(number):
            raise refuse(self.name, number, "not a whole number")
        if not -self._span <= 2 * number < self._span:
            raise refuse(self.name, number, f"does not fit in {self.width} characters with a sign")
        return format(int(number) % self._span, f"0{self.width}{self.letter}")


@dataclass(frozen=True, slots=True)
class Decimals:
    """{voltage_v:+07.3f}, with a comma {force:8,2f}; width 0 is open. All blanks decode to nan: an indicator shows nothing."""

    name: str
    sign: str
    zero: str
    width: int
    decimals: int
    point: str = "."

    @property
    def is_open(self) -> bool:
        """Decide whether the number takes as many digits as it needs."""
        return self.width == 0

    @property
    def pattern(self) -> str:
        """Regular expression of a number with a fixed count of decimals, padded to the width where there is one."""
        if self.is_open:
            return rf"[+-]?\d{{1,{LONGEST_NUMBER}}}[{self.point}]\d{{{self.decimals}}}"
        return rf"[ +\-0-9{self.point}]{{{self.width}}}"

    def encode(self, value: Value) -> str:
        """Return the rounded number, never as -0.00. ValueRefused for one that is not finite or does not fit."""
        number = _bounded(self.name, value)
        text = format(number, f"{self.sign}z{self.zero}{self.width or ''}.{self.decimals}f")  # z: no minus before 0.00
        return of_width(self.name, text.replace(".", self.point), self.width)

    @property
    def blank(self) -> str:
        """Return the text of a display that shows nothing."""
        return " " * self.width

    def decode(self, text: str) -> Value | None:
        """Return the number, NaN for a blank display, None for anything else."""
        if not self.is_open and not text.strip(" +-"):
            return nan
        if _number_with_decimals(self.decimals, self.point).fullmatch(text):
            return float(text.replace(" ", "").replace(",", "."))
        return None


@dataclass(frozen=True, slots=True)
class Scientific:
    """{volts:+.8E}: a number with an exponent. decimals: of the mantissa; of a number from 1 to 10 its own."""

    name: str
    sign: str
    decimals: int
    letter: str = "E"

    def step_below(self, largest: float) -> float:
        """Return the widest gap between two numbers that it tells apart up to this one."""
        return _digit_below(largest) * 10.0**-self.decimals

    def decimals_below(self, largest: float) -> int:
        """Return the decimals of numbers up to this one: those of the mantissa, and of small numbers the zeros ahead of it."""
        return self.decimals + max(0, -_exponent_below(largest))

    @property
    def is_open(self) -> bool:
        """Return True: an exponent takes as many digits as it needs."""
        return True

    @property
    def pattern(self) -> str:
        """Regular expression of one digit, the decimals and an exponent."""
        return rf"[+-]?\d\.\d{{{self.decimals}}}[Ee][+-]?\d{{1,3}}"

    def encode(self, value: Value) -> str:
        """Return mantissa and exponent of two digits, never as -0. ValueRefused for one that is not finite, or no reading."""
        number = _bounded(self.name, value)
        return format(number, f"{self.sign}z.{self.decimals}{self.letter}")

    def decode(self, text: str) -> Value | None:
        """Return the number, None for one that no double holds."""
        return _finite_or_none(float(text))


_PLAIN: Final = rf"(?:\d{{1,{LONGEST_NUMBER}}}(?:\.\d{{0,9}})?|\.\d{{1,9}})(?:[Ee][+-]?\d{{1,3}})?"
_PLAIN_IN_COLUMN: Final = re.compile(rf"{_PADDED_NUMBER}{_PLAIN}")


@dataclass(frozen=True, slots=True)
class Plain:
    """{force:g}: a number as programs print it, whose decimals come and go: 12, 12.5, .0273, 1e-05; {force:10g}: the same in a
    column, blanks ahead. decimals: those of what is sent, where there is room for them."""

    name: str
    sign: str = ""
    width: int = 0
    decimals: int = 4

    def step_below(self, largest: float) -> float:
        """Return the widest gap between two numbers up to this one, where a program prints six digits of each, as C's %g."""
        return max(_digit_below(largest) * 10.0**-_DECIMALS_OF_G, 10.0 ** -self._decimals_of(largest))

    @property
    def is_open(self) -> bool:
        """Decide whether it takes as many digits as it needs."""
        return self.width == 0

    @property
    def pattern(self) -> str:
        """Regular expression of digits with or without a point and an exponent."""
        return rf"[+-]?{_PLAIN}" if self.is_open else rf"[ +\-0-9.Ee]{{{self.width}}}"

    def encode(self, value: Value) -> str:
        """Return the rounded number without zeros at its end. ValueRefused for one that is not finite, does not fit, or is no
        reading."""
        number = _bounded(self.name, value)
        decimals = self._decimals_of(number)
        text = format(number, f"{self.sign}z.{decimals}f")
        text = text.rstrip("0") if decimals else text
        return of_width(self.name, (f"{text}0" if text.endswith(".") else text).rjust(self.width), self.width)

    def decode(self, text: str) -> Value | None:
        """Return the number, None for one that no double holds, and for a column with anything else in it."""
        if not self.is_open and not _PLAIN_IN_COLUMN.fullmatch(text):
            return None
        return _finite_or_none(float(text.replace(" ", "")))

    def _decimals_of(self, number: float) -> int:
        """Return the decimals that a number has room for beside a sign, its digits and the point."""
        room = self.width - len(format(number, f"{self.sign}z.0f")) - 1
        return self.decimals if self.is_open else max(0, min(self.decimals, room))


def _digit_below(largest: float) -> float:
    """Return what the first digit of the numbers below this one counts."""
    return float(10.0 ** _exponent_below(largest))


def _exponent_below(largest: float) -> int:
    return ceil(log10(largest)) - 1


def _bounded(name: str, value: Value) -> float:
    """Return a finite number of at most LONGEST_NUMBER digits. ValueRefused for another one."""
    number = finite(name, value)
    if abs(number) >= 10.0**LONGEST_NUMBER:
        raise refuse(name, value, "too large")
    return number


def _finite_or_none(number: float) -> float | None:
    return number if isfinite(number) else None
