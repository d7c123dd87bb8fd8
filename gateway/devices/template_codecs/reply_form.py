"""What acknowledges a voltage where an answer may be spelt in several ways, as an expression for the guardian.

It knows no grammar, only bytes. A device's answer carries more than the setting (an Alicat's frame the pressure, too), and a
number whose decimals come and go may be 0, 0.000 or 0e+00: what the gateway reads as this voltage counts. A digit or a blank
more ahead does not, for the 00 at the end of 500 is no 0.
"""

import re
from collections.abc import Mapping

from gateway.devices.exchange import VoltageExchange
from gateway.devices.fields import Field, Plain, Scientific, Value
from gateway.devices.grammar import Grammar
from gateway.devices.template import compile_template, join_patterns


def reply_form(grammar: Grammar, exchange: VoltageExchange, voltage_v: float) -> str:
    """Return an expression of the device's sentence that says this voltage, V, its end left out; empty where it is always the
    same bytes, or has a checksum over what may differ."""
    profile, template = grammar.profile, compile_template(exchange.answer)
    number, decimals = grammar.number_in(exchange.answer)
    others = [one for one in template.fields if one is not number and one.name not in profile.constants]
    if profile.is_modbus or profile.checksum != "none" or not (others or isinstance(number, Plain | Scientific)):
        return ""
    scale = exchange.range.scale
    said = _spelt(number, scale.on_grid(scale.to_number(voltage_v), decimals), decimals) if number else ""
    patterns = [said if piece is number else _pattern(piece, profile.constants) for piece in template.pieces]
    return join_patterns(template.pieces, patterns)


def _pattern(piece: str | Field, constants: Mapping[str, Value]) -> str:
    """Return the expression of a piece that is not the number: only a constant has to be there as it says."""
    if isinstance(piece, str):
        return re.escape(piece)
    return re.escape(piece.encode(constants[piece.name])) if piece.name in constants else f"(?:{piece.pattern})"


def _spelt(number: Field, value: float, decimals: int) -> str:
    """Return how this number may be spelt; 0 with either sign, and with any exponent."""
    if not isinstance(number, Plain | Scientific):
        return re.escape(number.encode(round(value, decimals)))
    sign = " *-" if value < 0.0 else r" *\+?" if value else " *[+-]?"
    if not value:
        return rf"{sign}0(?:\.0*)?(?:[Ee][+-]?\d{{1,3}})?"
    forms = [_scientific(value, number.decimals if isinstance(number, Scientific) else decimals)]
    if isinstance(number, Plain):
        forms.append(_with_zeros(*f"{abs(value):.{decimals}f}".partition(".")))
    return f"{sign}(?:{'|'.join(forms)})"


def _scientific(value: float, decimals: int) -> str:
    mantissa, _, exponent = f"{abs(value):.{decimals}e}".partition("e")
    power = rf"[Ee]{'-' if int(exponent) < 0 else '[+]?'}0*{abs(int(exponent))}"
    return _with_zeros(*mantissa.partition(".")) + power


def _with_zeros(whole: str, _: str, digits: str) -> str:
    kept = digits.rstrip("0")
    return rf"{whole}\.{kept}0*" if kept else rf"{whole}(?:\.0*)?"
