"""Which shape {name:spec} is."""

import re

from gateway.devices.fields.field import Field, TemplateError
from gateway.devices.fields.numbers import Decimals, HexNumber, Plain, Scientific, WholeNumber
from gateway.devices.fields.registers import RegisterNumber
from gateway.devices.fields.words import Choice, Text

_WHOLE = re.compile(r"(\+?)(0?)(\d{0,2})d")
_HEX = re.compile(r"(\+?)0([1-8])([Xx])")
_DECIMALS = re.compile(r"(\+?)(0?)(\d{0,2})([.,])([1-9])f")
_SCIENTIFIC = re.compile(r"(\+?)\.([1-9])([Ee])")
_PLAIN = re.compile(r"(\+?)([1-9]\d?)?g")
_TEXT = re.compile(r"(\d{0,2})s")
_REGISTERS = re.compile(r"(u?int16|u?int32|float32)(-cdab)?")
_WORD = re.compile(r"[!-~]+| +")
_PADDED = (re.compile(r"[!-~]+ *| +"), re.compile(r" *[!-~]+| +"))  # on the right, on the left


def field_from(name: str, spec: str) -> Field:
    """Return the field that {name:spec} means; TemplateError where it is none of the shapes."""
    if match := _WHOLE.fullmatch(spec):
        return WholeNumber(name, match[1], match[2], int(match[3] or 0))
    if match := _HEX.fullmatch(spec):
        return HexNumber(name, int(match[2]), bool(match[1]), match[3])
    if match := _DECIMALS.fullmatch(spec):
        return Decimals(name, match[1], match[2], int(match[3] or 0), int(match[5]), match[4])
    if match := _SCIENTIFIC.fullmatch(spec):
        return Scientific(name, match[1], int(match[2]), match[3])
    if match := _PLAIN.fullmatch(spec):
        return Plain(name, match[1], int(match[2] or 0))
    if match := _TEXT.fullmatch(spec):
        return Text(name, int(match[1] or 0))
    if match := _REGISTERS.fullmatch(spec):
        return RegisterNumber(name, match[1], bool(match[2]))
    if "|" in spec:
        return _choice(name, spec)
    alone = "; one word alone is text: write it without braces" if spec.isalpha() else ""
    raise TemplateError(f"{{{name}:{spec}}} is none of d, 04d, 02X, +07.3f, +.6E, g, ONE|TWO, s{alone}")


def _choice(name: str, spec: str) -> Choice:
    words = tuple(spec.split("|"))
    odd = next((word for word in words if not _WORD.fullmatch(word)), None)
    if odd is not None and not _is_padded(words):
        raise TemplateError(
            f"{{{name}:{spec}}}: {odd!r} is no word: characters without blanks, blanks alone, or all of one length and padded "
            "on one side"
        )
    if len(set(words)) < len(words):
        raise TemplateError(f"{{{name}:{spec}}} has a word twice")
    return Choice(name, words)


def _is_padded(words: tuple[str, ...]) -> bool:
    """Decide whether the words fill one column. `ST | US` do not: it is a slip that no line would ever match."""
    is_column = len({len(word) for word in words}) == 1
    return is_column and any(all(side.fullmatch(word) for word in words) for side in _PADDED)
