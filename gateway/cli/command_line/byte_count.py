"""Sizes on the command line: `500k`, `1MB`, `2G`, or a number of bytes; k is a thousand, as on a disk's label."""

import re
from typing import Any, Final

import click

_TIMES: Final = {"": 1, "k": 10**3, "m": 10**6, "g": 10**9, "t": 10**12}
_SIZE: Final = re.compile(r"(\d{1,18}(?:\.\d{0,9})?) ?([kmgt]?)b?", re.ASCII | re.IGNORECASE)


class ByteCount(click.types.IntParamType):
    """A number of bytes, with or without a unit."""

    name = "size"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the bytes that a text means."""
        match = _SIZE.fullmatch(str(value).strip())
        if not match:
            self.fail(f"{value} is no size such as 500k, 1MB or 2G, or a number of bytes", param, ctx)
        return int(float(match[1]) * _TIMES[match[2].lower()]) if match[2] or "." in match[1] else int(match[1])
