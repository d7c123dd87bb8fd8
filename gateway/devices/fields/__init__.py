"""The field shapes of a text template: numbers, words, text.

    {counts:d} {counts:04d} {counts:+05d}   whole number, open or of fixed width
    {address:02X} {counts:+04X} {bits:02x}  hex of fixed width, in upper or lower case; with a sign the two's complement
    {voltage_v:+07.3f} {voltage_v:.4f}      decimals, open or of fixed width; the point is always there
    {force:8,2f}                            the same with a decimal comma
    {volts:+.8E}                            decimals with an exponent, as SCPI devices answer
    {force:g} {force:10g}                   decimals that come and go, as programs print them: 12, 12.5, 1e-05
    {status:ST|US|OL} {status: |M|O}        one of the words; the first is the default; one may be a blank
    {unit:kg|lb} {unit: kg|  g}             words of one length may be padded, all on one side
    {text:s} {model:8s}                     printable text, open or of fixed width

Each shape is both ways: it encodes a value or refuses it (nan, inf, too wide), and decodes its own text. A shape with a
width reads blanks where zeros could stand, as displays that suppress leading zeros send them, and nothing else leniently:
a missing decimal point is no number.

One more shape is not for people: {force:int32} and its like are Modbus registers as hexadecimal digits, in templates that
`modbus:` of a profile stands for (binary/register_access.py).
"""

from typing import Final

from gateway.devices.fields.field import Field, ProfileMisfit, TemplateError, Value, ValueRefused
from gateway.devices.fields.numbers import Decimals, HexNumber, Plain, Scientific, WholeNumber
from gateway.devices.fields.registers import RegisterNumber
from gateway.devices.fields.shapes import field_from
from gateway.devices.fields.words import Choice, Text

__all__ = [
    "NUMBERS",
    "Choice",
    "Decimals",
    "Field",
    "HexNumber",
    "Plain",
    "ProfileMisfit",
    "RegisterNumber",
    "Scientific",
    "TemplateError",
    "Text",
    "Value",
    "ValueRefused",
    "WholeNumber",
    "field_from",
]

NUMBERS: Final = (WholeNumber, HexNumber, Decimals, Scientific, Plain, RegisterNumber)
"""The shapes that carry a number."""
