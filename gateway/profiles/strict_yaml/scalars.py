"""What an unquoted word in YAML means: the core schema of YAML 1.2, without its traps.

PyYAML follows YAML 1.1, where `no` is false, `1e3` is text, `0123` is 83, `1:30` is 90 and `2024-01-01` is a date.
Here: only true and false are booleans, `1e3` is a number, `yes`, `1:30`, `1_000` and dates are text (and a field that
wants a number says so), and what people read in two ways (`0123`) or nobody may use (`.nan`, `1e999`) is a fault.
"""

import re
from math import isfinite
from typing import Final

_NULL: Final = frozenset(("", "~", "null", "Null", "NULL"))
_BOOLEAN: Final = {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}
_INTEGER: Final = re.compile(r"[-+]?[0-9]+")
_LEADING_ZERO: Final = re.compile(r"[-+]?0[0-9]+")
_OTHER_BASE: Final = re.compile(r"0x[0-9a-fA-F]+|0o[0-7]+")
_FLOAT: Final = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_NOT_FINITE: Final = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_LONGEST_NUMBER: Final = 40

Scalar = str | int | float | bool | None


def plain_scalar(text: str) -> Scalar:
    """Return the value of an unquoted word. ValueError (a sentence without its subject) for what is refused."""
    if text in _NULL:
        return None
    if text in _BOOLEAN:
        return _BOOLEAN[text]
    return _number(text) if text[0] in "0123456789+-." else text


def _number(text: str) -> Scalar:
    if _NOT_FINITE.fullmatch(text):
        raise ValueError(f"{text} is not a finite number")
    if len(text) > _LONGEST_NUMBER and (_INTEGER.fullmatch(text) or _FLOAT.fullmatch(text)):
        raise ValueError(f"a number of {len(text)} characters: {_LONGEST_NUMBER} are enough")
    if _LEADING_ZERO.fullmatch(text):
        raise ValueError(f'{text} has a leading zero (octal or decimal?): write {int(text)}, or "{text}" if it is text')
    if _INTEGER.fullmatch(text):
        return int(text)
    if _OTHER_BASE.fullmatch(text):
        return int(text, 0)
    return _float(text) if _FLOAT.fullmatch(text) else text


def _float(text: str) -> float:
    value = float(text)
    if not isfinite(value):
        raise ValueError(f"{text} is too large for a number")
    return value
