"""Shapes of words and of free text."""

import re
from dataclasses import dataclass

from gateway.devices.fields.field import Value, of_width, refuse


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
            raise refuse(self.name, value, f"not one of {', '.join(self.words)}")
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
            raise refuse(self.name, repr(value), "not printable text")
        return of_width(self.name, text.ljust(self.width), self.width)

    def decode(self, text: str) -> Value | None:
        """Return the text without the blanks that pad it."""
        return text.rstrip(" ")
