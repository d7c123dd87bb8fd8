"""The field shapes, both ways, and what they refuse."""

import re
from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.devices import TemplateError, ValueRefused
from gateway.devices.checksum import add_checksum, strip_checksum
from gateway.devices.fields import (
    Choice,
    Decimals,
    HexNumber,
    Plain,
    RegisterNumber,
    Scientific,
    Text,
    WholeNumber,
    field_from,
)
from gateway.devices.fields.field import LONGEST_NUMBER
from gateway.devices.template import compile_template


@pytest.mark.parametrize(
    ("template", "values", "wire"),
    [
        ("SET {counts:d}", {"counts": 512}, b"SET 512"),
        ("S{counts:04d}", {"counts": 7}, b"S0007"),
        ("S{counts:+05d}", {"counts": -7}, b"S-0007"),
        ("S{counts:4d}", {"counts": 7}, b"S   7"),
        ("#{address:02X}{voltage_v:+07.3f}", {"address": 10, "voltage_v": 5.0}, b"#0A+05.000"),
        ("{voltage_v:.4f}", {"voltage_v": 5.0}, b"5.0000"),
        ("{status:ST|US|OL},{force:+08.2f}", {"status": "US", "force": 12.34}, b"US,+0012.34"),
        ("model {name:s}!", {"name": "X-1 a"}, b"model X-1 a!"),
        ("{name:8s};", {"name": "ITV"}, b"ITV     ;"),
        ("a{{b}}{counts:d}", {"counts": 1}, b"a{b}1"),
        ("\x02{force:+08.2f} N\x03", {"force": 12.34}, b"\x02+0012.34 N\x03"),
        ("\n{x:8.3f} kg\r\nS{y:d}", {"x": -1.5, "y": 2}, b"\n  -1.500 kg\r\nS2"),
        ("\x1bP{x:d}", {"x": 1}, b"\x1bP1"),
        ("{x:+.4E}", {"x": 0.5}, b"+5.0000E-01"),
        ("{x:.2e}", {"x": 1230.0}, b"1.23e+03"),
        ("{x:+04X}", {"x": -128}, b"FF80"),
        ("{x:04x}", {"x": 171}, b"00ab"),
        ("{x:+08,2f} kg", {"x": -12.34}, b"-0012,34 kg"),
        ("{x:,1f};", {"x": 0.5}, b"0,5;"),
        ("F={x:g} N", {"x": -0.25}, b"F=-0.25 N"),
        ("F={x:+g}", {"x": 12.0}, b"F=+12.0"),
        ("{unit: kg|  g}", {"unit": "  g"}, b"  g"),
        ("one:\t{x:.1f}\t| average:\t{y:d}", {"x": 12.3, "y": 7}, b"one:\t12.3\t| average:\t7"),
    ],
)
def test_one_text_is_encoder_and_decoder(template: str, values: dict[str, float | str], wire: bytes) -> None:
    compiled = compile_template(template)
    assert compiled.encode(values) == wire
    assert compiled.decode(wire) == values


@pytest.mark.parametrize("shape", ["+07.3f", ".3f", "d", "04d", "02X"])
@pytest.mark.parametrize("value", [nan, inf, -inf, "5", 1e12, -1e12])
def test_nan_inf_and_what_is_too_wide_are_refused(shape: str, value: float | str) -> None:
    with pytest.raises(ValueRefused):
        compile_template(f"{{x:{shape}}}").encode({"x": value})


@pytest.mark.parametrize(
    ("shape", "value"),
    [("+07.3f", 100.0), ("+07.3f", -99.9996), ("03d", 1000), ("03d", -100), ("d", 0.5), ("02X", 256), ("02X", -1)],
)
def test_a_value_that_does_not_fit_is_refused_not_truncated(shape: str, value: float) -> None:
    with pytest.raises(ValueRefused):
        compile_template(f"{{x:{shape}}}").encode({"x": value})


@pytest.mark.parametrize(
    ("template", "values"),
    [
        ("{x:A|B}", {"x": "C"}),
        ("{x:s}", {"x": "a\r\nSET 1023"}),
        ("{x:s}", {"x": ""}),
        ("{x:s}", {"x": "ends "}),
        ("{x:3s}", {"x": "four"}),
        ("{x:s},{y:s}", {"x": "a,b", "y": "c"}),
        ("{x:d}", {}),
    ],
)
def test_text_that_would_not_come_back_is_refused(template: str, values: dict[str, str]) -> None:
    compiled = compile_template(template)
    with pytest.raises(ValueRefused):
        encoded = compiled.encode(values)
        if compiled.decode(encoded) != values:
            raise ValueRefused(encoded)


SHAPES = {
    "d": WholeNumber("x", "", "", 0),
    "+d": WholeNumber("x", "+", "", 0),
    "04d": WholeNumber("x", "", "0", 4),
    "+012d": WholeNumber("x", "+", "0", 12),
    "7d": WholeNumber("x", "", "", 7),
    "02X": HexNumber("x", 2),
    "+04X": HexNumber("x", 4, True),
    "04x": HexNumber("x", 4, False, "x"),
    "9,1f": Decimals("x", "", "", 9, 1, ","),
    "g": Plain("x", ""),
    "+g": Plain("x", "+"),
    ".3e": Scientific("x", "", 3, "e"),
    "+.8E": Scientific("x", "+", 8, "E"),
    ".3f": Decimals("x", "", "", 0, 3),
    "+07.2f": Decimals("x", "+", "0", 7, 2),
    "9.1f": Decimals("x", "", "", 9, 1),
    "s": Text("x", 0),
    "8s": Text("x", 8),
    "int32": RegisterNumber("x", "int32", False),
    "float32-cdab": RegisterNumber("x", "float32", True),
    "uint16": RegisterNumber("x", "uint16", False),
    "ST|US": Choice("x", ("ST", "US")),
    " |M": Choice("x", (" ", "M")),
    "kg |g  |   ": Choice("x", ("kg ", "g  ", "   ")),
    " kg|  g|   ": Choice("x", (" kg", "  g", "   ")),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_each_shape_is_read_to_its_last_letter(shape: str) -> None:
    assert field_from("x", shape) == SHAPES[shape]


@pytest.mark.parametrize(
    ("shape", "value", "sentence"),
    [
        ("03d", 1000, "x = 1000: does not fit in 3 characters"),
        ("d", 10**30, "too large"),
        ("d", 0.5, "x = 0.5: not a whole number"),
        ("02X", 256, "x = 100: does not fit in 2 characters"),
        ("02X", -1, "x = -1: not a whole number from 0"),
        ("+04X", 32768, "x = 32768: does not fit in 4 characters with a sign"),
        ("+04X", -32769, "x = -32769: does not fit in 4 characters with a sign"),
        ("+04X", 0.5, "x = 0.5: not a whole number"),
        (".3f", 1e30, "x = 1e+30: too large"),
        (".3E", 1e30, "x = 1e+30: too large"),
        ("g", 1e30, "x = 1e+30: too large"),
        ("+07.3f", 100.0, "x = +100.000: does not fit in 7 characters"),
        ("3s", "four", "x = four: does not fit in 3 characters"),
        ("s", "a ", "x = 'a ': not printable text"),
        ("ST|US", "OL", "x = OL: not one of ST, US"),
        ("int32", 0.5, "x = 0.5: not a whole number"),
        ("uint16", -1, "x = -1: does not fit into uint16"),
        ("uint16", 65536, "x = 65536: does not fit into uint16"),
        ("float32", 1e39, "x = 1e+39: does not fit into float32"),
        ("d", nan, "x = nan: not a finite number"),
        ("d", "5", "x = 5: not a number"),
    ],
)
def test_a_refused_value_is_told_with_its_name_and_why(shape: str, value: float | str, sentence: str) -> None:
    with pytest.raises(ValueRefused, match=re.escape(sentence)):
        field_from("x", shape).encode(value)


def test_the_longest_numbers_are_still_told() -> None:
    longest = 10.0**LONGEST_NUMBER
    for shape in ("d", ".1f", ".9E", "g"):
        field_from("x", shape).encode(longest - 2.0)
        with pytest.raises(ValueRefused, match="too large"):
            field_from("x", shape).encode(longest)


def test_registers_are_read_in_their_own_order() -> None:
    assert field_from("x", "int32").encode(0x12345678) == "12345678"
    assert field_from("x", "int32-cdab").encode(0x12345678) == "56781234"
    assert field_from("x", "int32-cdab").decode("56781234") == 0x12345678
    assert field_from("x", "float32").decode("7FC00000") is None


def test_a_missing_decimal_point_is_no_number() -> None:
    assert compile_template("{x:+07.3f}").decode(b"+005000") is None
    assert compile_template("{x:.3f}").decode(b"5000") is None


def test_blanks_are_a_value_only_where_they_may_be() -> None:
    compiled = compile_template("{x:+07.3f}")
    assert compiled.decode(b"       ") is None
    assert str(compiled.decode(b"       ", may_be_blank="x")) == "{'x': nan}"
    assert compiled.encode({"x": nan}, may_be_blank="x") == b"       "


@pytest.mark.parametrize(
    ("template", "hint"),
    [
        ("{x:q}", "none of"),
        ("{x}", "none of"),
        ("{x:A|A}", "{x:A|A} has a word twice"),
        ("{x:A|}", "'' is no word"),
        (
            "{x:ST | US}",
            "'ST ' is no word: characters without blanks, blanks alone, or all of one length and padded on one side",
        ),
        ("{x:ST |US}", "'ST ' is no word"),
        ("{x:kg | lb}", "'kg ' is no word"),
        ("{x:N}", "one word alone is text: write it without braces"),
        ("{x:.0f}", "none of"),
        ("{x:d", "'{x:d'"),
        ("x}", "a brace that is sent itself is doubled"),
        ("{:d}", "{name:shape}"),
        ("{x!r:d}", "{name:shape}"),
        ("{x:d}{y:d}", "nothing marks the end of {x}"),
        ("{x:g}E", "nothing marks the end of {x}"),
        ("{x:d}5", "nothing marks the end of {x}"),
        ("{x:d},{x:d}", "twice"),
        ("SET {x:d}\r\n", "not printable"),
        ("", "not printable"),
        ("µ{x:d}", "not printable"),
        ("\x00{x:d}", "not printable text, SOH, STX, ETX, EOT, ENQ, ACK, NAK, ESC or tab"),
        ("{x:d}\n", '(CR and LF at its end belong to `terminator`, ahead of an ETX too: "\\r\\x03")'),
        ("<STX>{x:d}", '<STX> would be 5 characters on the wire. Between double quotes STX is "\\x02"'),
        (r"\x02{x:d}", "\\x02 would be 4 characters on the wire"),
        (r"{x:d}\r\n", "\\r would be 2 characters on the wire"),
        ("\x02{x:d}\t{x:d}\x03{x", "'<STX>{x:d}<TAB>{x:d}<ETX>{x'"),
        ("\x02{x:d}{y:d}\x03", "'<STX>{x:d}{y:d}<ETX>': nothing marks the end of {x}"),
    ],
)
def test_an_author_is_told_what_is_wrong(template: str, hint: str) -> None:
    with pytest.raises(TemplateError) as told:
        compile_template(template)
    assert hint in str(told.value)


@given(st.floats(-999.9994, 999.9994))
def test_decimals_come_back_within_half_a_step(value: float) -> None:
    compiled = compile_template("V{x:+08.3f}")
    decoded = compiled.decode(compiled.encode({"x": value}))
    assert decoded is not None
    assert decoded["x"] == pytest.approx(value, abs=0.5001e-3)


@given(st.integers(-999, 9999))
def test_whole_numbers_come_back(value: int) -> None:
    for shape in ("d", "04d", "4d"):
        compiled = compile_template(f"<{{x:{shape}}}>")
        assert compiled.decode(compiled.encode({"x": value})) == {"x": value}


@given(st.binary(max_size=24))
def test_no_bytes_make_a_decoder_raise(data: bytes) -> None:
    for template in ("{s:ST|US},{x:+08.2f}{u:kg|g}", "SET {x:d}", "{t:s}", "{a:02X}{x:04d}"):
        values = compile_template(template).decode(data)
        assert values is None or isinstance(values, dict)


@given(st.binary(max_size=40), st.sampled_from(["none", "dcon-sum", "sum-complement", "xor", "xor-hex"]))
def test_a_checksum_opens_what_it_sealed(body: bytes, name: str) -> None:
    assert strip_checksum(add_checksum(body, name), name) == body  # type: ignore[arg-type]


@given(st.binary(min_size=1, max_size=40), st.integers(0, 7), st.data())
def test_a_flipped_bit_does_not_pass_a_checksum(body: bytes, bit: int, data: st.DataObject) -> None:
    for name in ("dcon-sum", "sum-complement", "xor"):
        sentence = bytearray(add_checksum(body, name))  # type: ignore[arg-type]
        sentence[data.draw(st.integers(0, len(sentence) - 1))] ^= 1 << bit
        assert strip_checksum(bytes(sentence), name) is None  # type: ignore[arg-type]
