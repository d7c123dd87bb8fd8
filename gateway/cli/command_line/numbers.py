"""Numbers of the command line with bounds: a refusal says what is allowed, as the gateway's own refusals do."""

import re
from math import isfinite
from typing import Any, Final

import click


def describe_allowed(value: str, low: float | None, high: float | None, unit: str = "") -> str:
    """Return `65 N: allowed 0 .. 60 N`; one bound may be open."""
    unit = f" {unit}" if unit else ""
    if low is None or high is None:
        bound = f"at least {low:g}" if low is not None else f"at most {high:g}"
        return f"{value}{unit}: allowed {bound}{unit}"
    return f"{value}{unit}: allowed {low:.10g} .. {high:.10g}{unit}"


_WITH_UNIT: Final = re.compile(r"([+-]?[\d.,]+) ?[^\W\d_][\w/%]*")


def number_hint(text: str) -> str:
    """Return what a number with a comma, or with a unit behind it, should have been, as the end of a sentence; empty for what
    is none either way."""
    with_unit = _WITH_UNIT.fullmatch(text.strip())
    bare = with_unit[1] if with_unit else text
    pointed = bare.replace(",", ".")
    try:
        float(pointed)
    except ValueError:
        return ""
    if with_unit:
        return f"; without its unit{', decimals with a point' if pointed != bare else ''}: {pointed}"
    return f"; decimals take a point: {pointed}" if pointed != bare else ""


class Number(click.types.FloatParamType):
    """A number; one with a comma or a unit is told how it is written."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number; BadParameter for what is none."""
        try:
            return float(value)
        except ValueError:
            return self.fail(f"{value or 'nothing'} is not a number{number_hint(str(value))}", param, ctx)


NUMBER: Final = Number()


class Whole(click.IntRange):
    """A whole number within bounds."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the number; BadParameter with the bounds."""
        try:
            number = int(value)
        except ValueError:
            allowed = describe_allowed("", self.min, self.max) if self.min is not None or self.max is not None else ""
            return self.fail(f"{value} is not a whole number{allowed}", param, ctx)
        if (self.min is not None and number < self.min) or (self.max is not None and number > self.max):
            self.fail(describe_allowed(str(value), self.min, self.max), param, ctx)
        return number


class Quantity(click.FloatRange):
    """A finite number within bounds, in a unit. above: the lower bound itself is not allowed."""

    def __init__(
        self, low: float | None = None, high: float | None = None, unit: str = "", *, above: bool = False
    ) -> None:
        super().__init__(low, high, min_open=above)
        self._unit = unit

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the number; BadParameter for what is none, is not finite (JSON has no word for it) or beyond the bounds."""
        number, low, high = NUMBER.convert(value, param, ctx), self.min, self.max
        if self.min_open and low is not None and not number > low:  # so that nan is none
            self.fail(f"{value}: allowed above {low:g}", param, ctx)
        if not ((low is None or number >= low) and (high is None or number <= high)):
            self.fail(describe_allowed(str(value), low, high, self._unit), param, ctx)
        if not isfinite(number):
            self.fail(f"{value} is not a finite number", param, ctx)
        return number
