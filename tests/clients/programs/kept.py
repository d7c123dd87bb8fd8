"""What a variable of a type keeps of a value that is assigned to it, and what it holds at first."""

import struct
from collections.abc import Callable
from functools import partial
from typing import Any

WIDTHS = {"WORD": 16, "UINT": 16, "BYTE": 8, "USINT": 8, "DWORD": 32, "UDINT": 32}
SIGNED = {"INT": 16, "DINT": 32}
LARGEST_NUM = 8_388_608
"""RAPID: whole numbers are exact in num up to here (data type num)."""
FIRST_VALUES = {"BOOL": False, "REAL": 0.0, "NUM": 0, "DNUM": 0, "STRING": "", "TIME": 0.0}


def keep_word(width: int, value: Any) -> Any:
    return int(value) & ((1 << width) - 1)


def keep_signed(width: int, value: Any) -> Any:
    if not -(1 << width - 1) <= value < 1 << width - 1:
        raise OverflowError(f"{value} in {width} bits")
    return value


def keep_single(value: Any) -> Any:
    return struct.unpack(">f", struct.pack(">f", value))[0] if isinstance(value, float) else value


def keep_num(value: Any) -> Any:
    if isinstance(value, int) and abs(value) > LARGEST_NUM:
        raise OverflowError(f"{value} is not exact in num")
    return keep_single(value)


def keep_string(value: Any) -> Any:
    if len(value) > 80:
        raise OverflowError(f"{value!r} is longer than 80 characters")
    return value


Keeps = Callable[[Any], Any]
KEEPERS: dict[str, Keeps] = {
    **{name: partial(keep_word, width) for name, width in WIDTHS.items()},
    **{name: partial(keep_signed, width) for name, width in SIGNED.items()},
    "REAL": keep_single,
    "NUM": keep_num,
    "STRING": keep_string,
}
