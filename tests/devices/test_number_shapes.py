"""Numbers with an exponent, with a comma, as a program prints them, and in hexadecimal: what is one, and what is none."""

import pytest

from gateway.devices.template import compile_template


@pytest.mark.parametrize("sent", ["+5.0000E+00", "5.0000E+00", "+5.0000e+000", "+5.0000E0", "50.0000E-1"])
def test_an_exponent_is_read_however_long_and_a_mantissa_has_one_digit(sent: str) -> None:
    decoded = compile_template("{x:+.4E}").decode(sent.encode())
    assert decoded == (None if sent.startswith("50") else {"x": 5.0})


def test_a_number_that_no_double_holds_is_none() -> None:
    for template in ("{x:.1E}", "{x:g}"):
        assert compile_template(template).decode(b"9.9E999") is None


@pytest.mark.parametrize(
    ("sent", "number"),
    [
        *(
            ("12", 12.0),
            ("12.", 12.0),
            ("12.0", 12.0),
            ("-12.345", -12.345),
            ("+.0273", 0.0273),
            ("1e-05", 1e-5),
            ("2.73E+2", 273.0),
        ),
        *((text, None) for text in ("", ".", "-", "1,5", "0x12", "nan", "inf", "1e", "1_0", " 12", "12345678901")),
    ],
)
def test_a_number_as_a_program_prints_it_is_read_and_nothing_else(sent: str, number: float | None) -> None:
    decoded = compile_template("F={x:g}").decode(f"F={sent}".encode())
    assert decoded == (None if number is None else {"x": number})


def test_a_comma_is_no_point_and_a_point_no_comma() -> None:
    assert compile_template("{x:8,2f}").decode(b"-  12,34") == {"x": -12.34}
    for template, sent in (
        ("{x:8,2f}", b"   12.34"),
        ("{x:8.2f}", b"   12,34"),
        ("{x:,2f}", b"12.34"),
        ("{x:.2f}", b"12,34"),
    ):
        assert compile_template(template).decode(sent) is None


def test_hexadecimal_digits_have_the_case_of_their_shape() -> None:
    assert compile_template("{x:02x}").decode(b"AB") is None
    assert compile_template("{x:02X}").decode(b"ab") is None


def test_twos_complement_comes_back() -> None:
    compiled = compile_template("{x:+04X}")
    for number in (-32768, -1, 0, 1, 32767):
        assert compiled.decode(compiled.encode({"x": number})) == {"x": number}
