"""A cell that speaks otherwise than its profile is quoted, with the unit where only that differs; what is no text is not."""

from dataclasses import replace
from random import Random

import pytest

from gateway.devices import cell_host
from gateway.devices.binary.rtu_framing import rtu_frame
from gateway.devices.binary.weight_registers import WeightRegisters
from gateway.devices.force_reading import ForceReading
from gateway.devices.messages import ForceSample
from gateway.devices.template_codecs.unread_line import explain_unread
from gateway.devices.wire import resample_at_baud
from gateway.profiles import list_shipped, load_device

STREAM = load_device("stream-st-gs")


def in_newtons():
    assert STREAM.stream
    return replace(
        STREAM, stream=replace(STREAM.stream, frame="{status:ST|US|OL},{mode:GS|NT},{force:+08.2f} N", unit="N")
    )


@pytest.mark.parametrize("unit", ["kN", "t", "oz", " daN"])
def test_another_unit_is_told_with_those_that_are_read(unit: str) -> None:
    line = f"ST,GS,+0012.34{unit}\r\n".encode()
    words = explain_unread(STREAM, line)
    assert words.startswith(
        f"it says 'ST,GS,+0012.34{unit}', in {unit.strip()}: stream-st-gs reads kg or lb or g or N;"
    )


def test_kilograms_are_told_where_a_profile_reads_newtons_only() -> None:
    words = explain_unread(in_newtons(), b"ST,GS,+0012.34 kg\r\n")
    assert words.startswith("it says 'ST,GS,+0012.34 kg', in kg: stream-st-gs reads N; set the device to that unit")


@pytest.mark.parametrize("line", [b"ST,GS,+00123.4kg\r\n", b"+12.34\r\n", b"$GPGGA,123519\r\n"])
def test_another_format_is_quoted_beside_what_is_read(line: bytes) -> None:
    words = explain_unread(STREAM, line)
    assert words.startswith(f"it says {line.decode().strip()!r}, stream-st-gs reads '{{status:ST|US|OL}}")
    assert "other decimals, another format" in words


@pytest.mark.parametrize("heard_baud", [9600, 19200, 38400, 57600])
def test_what_another_speed_makes_of_a_line_is_no_text(heard_baud: int) -> None:
    """Seldom it looks like some: then only as one line among many."""
    rng, told = Random(1), 0
    for _ in range(200):
        frame = b"ST,GS,%+08.2fkg\r\n" % rng.uniform(-20.0, 60.0)
        told += bool(explain_unread(STREAM, resample_at_baud(frame, 115200, heard_baud)))
    assert told <= 2


@pytest.mark.parametrize("line", [b"\r\n", b"", b"\x00\xff\x80abc", b"ST,\x01", b"A" * 200])
def test_what_is_no_sentence_is_not_quoted(line: bytes) -> None:
    assert explain_unread(STREAM, line) == ""


@pytest.mark.parametrize("name", list_shipped("device"))
def test_no_profile_and_no_bytes_are_too_odd(name: str) -> None:
    rng, profile = Random(2), load_device(name)
    for length in range(60):
        assert isinstance(explain_unread(profile, rng.randbytes(length)), str)
        assert isinstance(explain_unread(profile, bytes(rng.choices(range(32, 127), k=length))), str)


@pytest.mark.parametrize(
    ("line", "told"), [(b"!02\r", "it says '!02', no answer that its profile knows"), (b"\xff!\r", "")]
)
def test_an_answer_of_an_output_is_quoted_alone(line: bytes, told: str) -> None:
    for name in ("icpdas-7024", "smc-itv-rc"):
        assert explain_unread(load_device(name), line).partition(":")[0] == told
    assert explain_unread(load_device("waveshare-ao8b"), line) == ""


def test_a_modbus_cell_that_has_no_such_register_is_not_said_to_have_no_wires() -> None:
    profile = load_device("laumas-tlb")
    told = explain_unread(profile, rtu_frame(1, b"8302"))
    assert told == "it answers exception 2 (illegal data address): are registers and function those of laumas-tlb?"
    assert explain_unread(profile, rtu_frame(2, b"8302")) == "", "of another unit"
    assert explain_unread(profile, rtu_frame(1, b"0302000A")) == ""


@pytest.mark.parametrize(
    ("name", "line", "told"),
    [
        ("mantracourt-dsc", b"?\r", "it says '?', its word for no: has it an answer to '!001:SYS?'?"),
        ("hbm-aed", b"?\r\n", "it says '?', its word for no: has it an answer to 'MSV?'?"),
        ("hbm-aed", b"!\r\n", ""),
    ],
)
def test_a_cell_that_says_no_is_not_said_to_be_silent(name: str, line: bytes, told: str) -> None:
    """Its power, its cable and its stream mode were to be checked."""
    assert explain_unread(load_device(name), line) == told


@pytest.mark.parametrize(("digits", "is_told"), [("7FC00000", True), ("FF800000", True), ("3FC00000", False)])
def test_an_amplifier_whose_number_is_none_is_not_said_to_be_silent(digits: str, is_told: bool) -> None:
    reading = ForceReading(ask="", modbus=WeightRegisters(first=63, last=65, weight=63, type="float32"), unit="kg")
    profile = replace(load_device("laumas-tlb"), name="own", read_force=reading)
    told = "it answers no number, but NaN or infinity: no reading, or is register 63 no float32 of that word order?"
    assert explain_unread(profile, rtu_frame(1, f"0306{digits}0000".encode())) == (told if is_told else "")
    assert explain_unread(profile, rtu_frame(1, f"0304{digits}".encode())) == ""


def test_what_is_read_is_never_said_to_be_in_another_unit() -> None:
    host = cell_host(STREAM)
    for unit in ("kg", "lb", "g", "N"):
        (message,) = host.receive(f"ST,GS,+0012.34{unit}\r\n".encode(), 0.0)
        assert isinstance(message, ForceSample)


@pytest.mark.parametrize(
    ("name", "exchange", "changes", "hint"),
    [
        (
            "laumas-tlb",
            "read_force",
            {"first": 40007, "last": 40011, "weight": 40008},
            "; a manual's 40008 is 7 on the wire",
        ),
        ("waveshare-ao8b", "set_voltage", {"register": 40001}, "; a manual's 40001 is 0 on the wire"),
        ("waveshare-ao8b", "read_voltage", {"register": 30100, "function": 4}, "; a manual's 30100 is 99 on the wire"),
        ("waveshare-ao8b", "set_voltage", {"register": 99}, ""),
    ],
)
def test_a_number_that_a_manual_has_is_told_as_one_on_the_wire(
    name: str, exchange: str, changes: dict[str, object], hint: str
) -> None:
    shipped = load_device(name)
    asked = getattr(shipped, exchange)
    is_cell = exchange == "read_force"
    registers = replace(asked.modbus, **changes, **({"negative": None, "overload": ()} if is_cell else {}))
    said = replace(asked, modbus=registers, ask="", **{"frame" if is_cell else "answer": ""})
    profile = replace(shipped, **{exchange: said})
    told = explain_unread(profile, rtu_frame(1, b"8302"))
    assert told == f"it answers exception 2 (illegal data address): are registers and function those of {name}?{hint}"
