"""Numbers with an exponent, with a comma, as a program prints them, and in hexadecimal: what is one, and what is none."""

from math import isnan

import pytest

from gateway.devices import cell_device, cell_host
from gateway.devices.fields import ValueRefused
from gateway.devices.force_reading import ForceReading
from gateway.devices.messages import ForceSample, Quality
from gateway.devices.rehearsal import rehearse
from gateway.devices.template import compile_template
from tests.dialogues.cells.test_overload_dialogue import cell


@pytest.mark.parametrize("sent", ["+5.0000E+00", "5.0000E+00", "+5.0000e+000", "+5.0000E0", "50.0000E-1"])
def test_an_exponent_is_read_however_long_and_a_mantissa_has_one_digit(sent: str) -> None:
    decoded = compile_template("{x:+.4E}").decode(sent.encode())
    assert decoded == (None if sent.startswith("50") else {"x": 5.0})


def test_a_number_that_rounds_to_nothing_has_no_minus_and_a_sign_alone_is_a_display_that_shows_nothing() -> None:
    for template, sent in (
        ("{x:.2f}", b"0.00"),
        ("{x:+07.2f}", b"+000.00"),
        ("{x:.1E}", b"0.0E+00"),
        ("{x:g}", b"0.0"),
    ):
        assert compile_template(template).encode({"x": -0.0 if "E" in template else -1e-5}) == sent
    blank = compile_template("{x:+07.2f}").decode(b"-      ", "x")
    assert blank and isnan(float(blank["x"]))


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


@pytest.mark.parametrize(
    ("sent", "number"),
    [
        *(("   12.34", 12.34), ("   123.4", 123.4), ("    1234", 1234.0), ("   1234.", 1234.0), ("-   12.5", -12.5)),
        *(("    -0.5", -0.5), ("+0012.50", 12.5), ("12345678", 12345678.0), (" 1.2e-05", 1.2e-5)),
        *(
            (text, None)
            for text in ("  12.34", "    12.34", "        ", "-       ", "12.34   ", "  12 .34", " 1.2.3.4")
        ),
        *((text, None) for text in ("  12,34 ", "     nan", "--  12.5", "   1 2.5", "       .")),
    ],
)
def test_a_number_in_a_column_may_have_its_point_anywhere(sent: str, number: float | None) -> None:
    """As a display of two ranges prints it, or a panel meter."""
    decoded = compile_template("S {x:8g} g").decode(f"S {sent} g".encode())
    assert decoded == (None if number is None else {"x": number})


@pytest.mark.parametrize(
    ("template", "number", "sent"),
    [
        ("{x:8g}", 12.345678, b" 12.3457"),
        ("{x:8g}", -12.5, b"   -12.5"),
        ("{x:+8g}", 12.5, b"   +12.5"),
        ("{x:5g}", 123.456, b"123.5"),
        ("{x:5g}", 1234.56, b" 1235"),
        ("{x:5g}", -0.00001, b"  0.0"),
    ],
)
def test_it_shows_as_many_decimals_as_its_column_has_room_for(template: str, number: float, sent: bytes) -> None:
    compiled = compile_template(template)
    assert compiled.encode({"x": number}) == sent
    step = compiled.fields[0].step_below(abs(number) + 1e-9)  # type: ignore[attr-defined]
    assert compiled.decode(sent) == {"x": pytest.approx(number, abs=0.5 * step)}
    with pytest.raises(ValueRefused):
        compiled.encode({"x": -123456789.0})


@pytest.mark.parametrize(
    ("template", "largest", "step"), [("{x:g}", 5.0, 1e-4), ("{x:g}", 20_000.0, 0.1), ("{x:5g}", 1500.0, 1.0)]
)
def test_the_widest_gap_is_that_of_six_digits_or_of_what_the_column_has_room_for(
    template: str, largest: float, step: float
) -> None:
    assert compile_template(template).fields[0].step_below(largest) == pytest.approx(step)  # type: ignore[attr-defined]


def test_a_cell_whose_point_moves_is_a_profile_without_faults() -> None:
    profile = cell(stream=ForceReading(frame="S {status:S|D} {force:10g} g", unit="g", rate_hz=10.0,
                                       quality={"S": Quality.OK, "D": Quality.UNSTABLE}, overload=("S +",)))  # fmt: skip
    assert list(rehearse(profile)) == []
    host = cell_host(profile)
    found = host.receive(b"S S     100.00 g\r\nS D     1000.0 g\r\nS S    10000 g\r\n", 0.0)
    assert [getattr(one, "raw", None) for one in found] == [100.0, 1000.0, None]
    for force_n in (-20.0, 0.0, 0.001, 7.5, 90.0):
        (sample,) = host.receive(cell_device(profile).frame(force_n), 0.0)
        assert isinstance(sample, ForceSample) and sample.force_n == pytest.approx(force_n, abs=1e-6)


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
    for number in (-32769, 32768):  # which would come back as the other end
        with pytest.raises(ValueRefused, match="does not fit in 4 characters with a sign"):
            compiled.encode({"x": number})
