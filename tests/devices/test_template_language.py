"""The five field shapes, both ways, and what they refuse."""

from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.devices import TemplateError, ValueRefused
from gateway.devices.checksum import add_checksum, strip_checksum
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
        ("{x:A|A}", "none of"),
        ("{x:A|}", "none of"),
        ("{x:.0f}", "none of"),
        ("{x:d", "'{x:d'"),
        ("x}", "Single '}'"),
        ("{:d}", "{name:shape}"),
        ("{x!r:d}", "{name:shape}"),
        ("{x:d}{y:d}", "nothing marks the end of {x}"),
        ("{x:d}5", "nothing marks the end of {x}"),
        ("{x:d},{x:d}", "twice"),
        ("SET {x:d}\r\n", "not printable"),
        ("", "not printable"),
        ("µ{x:d}", "not printable"),
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


@given(st.binary(max_size=40), st.sampled_from(["none", "dcon-sum", "xor"]))
def test_a_checksum_opens_what_it_sealed(body: bytes, name: str) -> None:
    assert strip_checksum(add_checksum(body, name), name) == body  # type: ignore[arg-type]


@given(st.binary(min_size=1, max_size=40), st.integers(0, 7), st.data())
def test_a_flipped_bit_does_not_pass_a_checksum(body: bytes, bit: int, data: st.DataObject) -> None:
    for name in ("dcon-sum", "xor"):
        sentence = bytearray(add_checksum(body, name))  # type: ignore[arg-type]
        sentence[data.draw(st.integers(0, len(sentence) - 1))] ^= 1 << bit
        assert strip_checksum(bytes(sentence), name) is None  # type: ignore[arg-type]
