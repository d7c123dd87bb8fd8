"""What every shape of a field does, and what it says when it refuses."""

from math import isfinite
from typing import Final, Protocol

Value = float | int | str

LONGEST_NUMBER: Final = 10  # digits of an open number: more is not a reading but noise


class TemplateError(ValueError):
    """The profile's author wrote a template that means nothing; the sentence quotes it. written: the template, where it is
    known: a reader of the file finds its line by that."""

    def __init__(self, sentence: str, *, written: str = "") -> None:
        super().__init__(sentence)
        self.written = written


class ProfileMisfit(ValueError):  # noqa: N818  what it is, as ValueRefused
    """A key that does not fit the rest of its profile. misfits: the keys that may be meant; a reader of the file tells the line
    of the first that is there."""

    def __init__(self, misfits: tuple[str, ...], sentence: str) -> None:
        super().__init__(sentence)
        self.misfits = misfits


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


def refuse(name: str, value: Value, why: str) -> ValueRefused:
    """Return the refusal of a value, for its field to raise."""
    return ValueRefused(f"{name} = {value}: {why}")


def finite(name: str, value: Value) -> float:
    """Return a number that is one. ValueRefused for text, nan and inf."""
    if isinstance(value, str):
        raise refuse(name, value, "not a number")
    if not isfinite(value):
        raise refuse(name, value, "not a finite number")
    return value


def of_width(name: str, text: str, width: int) -> str:
    """Return the text as it is. ValueRefused where a width is asked for that it does not have."""
    if width and len(text) != width:
        raise refuse(name, text, f"does not fit in {width} characters")
    return text
