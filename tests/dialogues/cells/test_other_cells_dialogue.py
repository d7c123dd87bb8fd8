"""Bytes of the manuals of Mantracourt DSC, HBM AD104 and ADAM-4016, and lines of an HX711; and what they are mistaken for."""

from dataclasses import replace

import pytest

from gateway.devices import DeviceProfile, cell_device, cell_host
from gateway.devices.force_reading import ForceReading
from gateway.devices.messages import ForceSample, Garbage, Quality, RepeatedSample
from gateway.devices.rehearsal import rehearse
from tests.profile_files import load_device

DSC = load_device("mantracourt-dsc")
HX711 = load_device("hx711-line")


def counting(name: str, newton_per_count: float = 0.01, zero: float = 0.0, **changes: object) -> DeviceProfile:
    """A profile with what its rig says of the counts."""
    profile = load_device(name)
    key = "stream" if profile.stream else "read_force"
    reading = replace(profile.reading, newton_per_count=newton_per_count, zero_count=zero)
    return replace(profile, **{key: reading}, **changes)  # type: ignore[arg-type]


HBM, BINARY = counting("hbm-aed"), counting("hbm-aed-binary")
ADAM = counting("adam-4016", 10.0, constants={"address": 7})


def sample(raw: float, force_n: float, quality: Quality = Quality.OK) -> ForceSample:
    return ForceSample(pytest.approx(raw), pytest.approx(force_n), quality, 0.0)


@pytest.mark.parametrize(
    ("profile", "unit", "asked", "answered", "found"),
    [
        (DSC, "N", b"!001:SYS?\r", b"+00032.100\r", sample(32.1, 32.1)),
        (DSC, "kg", b"!001:SYS?\r", b"123.456\r", sample(123.456, 1210.6897824)),
        (DSC, "N", b"!001:SYS?\r", b"-00000.250\r", sample(-0.25, -0.25)),
        (DSC, "N", b"!001:SYS?\r", b"?\r", Garbage(b"?\r")),
        (DSC, "N", b"!001:SYS?\r", b"+00032100\r", Garbage(b"+00032100\r")),  # no decimal point
        (HBM, None, b"MSV?;", b"+0012345\r\n", sample(12345, 123.45)),
        (HBM, None, b"MSV?;", b"-0000250\r\n", sample(-250, -2.5)),
        (HBM, None, b"MSV?;", b"?\r\n", Garbage(b"?\r\n")),
        (BINARY, None, b"MSV?;", bytes.fromhex("003039000D0A"), sample(12345, 123.45)),
        (BINARY, None, b"MSV?;", bytes.fromhex("FFFF06550D0A"), sample(-250, -2.5)),  # the lowest byte is a status
        (BINARY, None, b"MSV?;", bytes.fromhex("0D0A0D000D0A"), sample(0x0D0A0D, 8545.41)),  # ends of lines within
        (BINARY, None, b"MSV?;", bytes.fromhex("7FFFFF000D0A"), sample(8388607, 83886.07, Quality.OVERLOAD)),
        (BINARY, None, b"MSV?;", bytes.fromhex("800001000D0A"), sample(-8388607, -83886.07, Quality.OVERLOAD)),
        (ADAM, None, b"#**\r$074\r", b">071+5.8222\r", sample(5.8222, 58.222)),
        (ADAM, None, b"#**\r$074\r", b"!071-0.0100\r", sample(-0.01, -0.1)),
        (ADAM, None, b"#**\r$074\r", b">070+5.8222\r", RepeatedSample()),  # measured nothing since
        (ADAM, None, b"#**\r$074\r", b">081+5.8222\r", Garbage(b">081+5.8222\r")),  # another module
    ],
)
def test_a_reading_as_it_is_printed(
    profile: DeviceProfile, unit: str | None, asked: bytes, answered: bytes, found: object
) -> None:
    host = cell_host(profile, unit=unit)
    assert host.poll() == asked
    assert host.receive(answered, 0.0) == [found]


def test_counts_have_a_zero_and_a_size_of_the_rig_and_no_unit_by_themselves() -> None:
    host = cell_host(counting("hx711-line", 0.001, 84000.0), sign=-1)
    assert host.receive(b"184000\r\n", 0.0) == [sample(184000, -100.0)]
    assert host.receive(b"8388607\r\n", 0.0)[0].quality is Quality.OVERLOAD  # type: ignore[union-attr]
    with pytest.raises(ValueError, match="the rig must, as unit, or newton_per_count for raw counts"):
        cell_host(HX711)


@pytest.mark.parametrize("start", range(1, 6))
def test_a_binary_stream_that_begins_in_the_middle_costs_a_frame(start: int) -> None:
    """After an unplug it goes on wherever it is."""
    device, host = cell_device(BINARY), cell_host(BINARY)
    frames = b"".join(device.frame(0.5 * index) for index in range(20))
    found = host.receive(frames[start:], 0.0)
    read = [one.force_n for one in found if isinstance(one, ForceSample)]
    assert read == pytest.approx([0.5 * index for index in range(1, 20)])
    assert sum(len(one.data) for one in found if isinstance(one, Garbage)) == 6 - start


def test_a_line_stream_that_begins_in_the_middle_costs_a_line() -> None:
    host = cell_host(load_device("stream-st-gs"))
    found = host.receive(b"0012.34kg\r\nST,GS,+0001.00kg\r\n", 0.0)
    assert found == [Garbage(b"0012.34kg\r\n"), sample(1.0, 9.80665)]


@pytest.mark.parametrize("profile", [BINARY, HBM, ADAM], ids=lambda one: one.name)
def test_the_simulated_amplifier_knows_its_question_and_answers(profile: DeviceProfile) -> None:
    device, host = cell_device(profile), cell_host(profile)
    assert device.receive(host.poll(), 0.0) == 1
    for force_n in (-30.0, -0.1, 0.0, 12.5, 58.2):
        (found,) = host.receive(device.frame(force_n), 0.0)
        assert isinstance(found, ForceSample)
        assert found.force_n == pytest.approx(force_n, abs=0.6 * host.resolution_n)


MARK_10 = replace(  # Series 4, page 16: an operator may switch the unit at the gauge
    DSC,
    terminator="\r\n",
    question_terminator="\r",
    constants={},
    read_force=ForceReading(ask="?", frame="{force:g} {unit:N|lbF|kgF|gF}", unit="N"),
)
SELLETON = replace(  # SL-7515, page 12, whose print has its unit in capitals
    DSC,
    terminator="\r\n",
    constants={},
    read_force=ForceReading(
        ask="R",
        frame="{status:ST|US|OL}, {mode:GS|NT}{force:+6.2f}{unit:KG|LB}",
        quality={"ST": Quality.OK, "US": Quality.UNSTABLE, "OL": Quality.OVERLOAD},
    ),
)


@pytest.mark.parametrize(
    ("profile", "line", "found"),
    [
        (MARK_10, b"-18.78 lbF\r\n", sample(-18.78, -83.5376020)),
        (MARK_10, b"4.285 N\r\n", sample(4.285, 4.285)),
        (MARK_10, b"1.5 kgF\r\n", sample(1.5, 14.709975)),
        (MARK_10, b"150 gF\r\n", sample(150.0, 1.4709975)),
        (MARK_10, b"0.30 ozF\r\n", Garbage(b"0.30 ozF\r\n")),
        (SELLETON, b"ST, GS+ 5.12KG\r\n", sample(5.12, 50.2100480)),
        (SELLETON, b"US, GS- 5.12LB\r\n", sample(-5.12, -22.7748947, Quality.UNSTABLE)),
    ],
)
def test_a_unit_is_read_as_the_device_spells_it(profile: DeviceProfile, line: bytes, found: object) -> None:
    assert list(rehearse(profile)) == []
    assert cell_host(profile).receive(line, 0.0) == [found]


def test_a_simulated_device_says_its_unit_in_its_own_word() -> None:
    assert cell_device(MARK_10).frame(-2.5) == b"-2.5 N\r\n"
    in_pounds = replace(MARK_10, read_force=replace(MARK_10.reading, unit="lb"))
    assert cell_device(in_pounds).frame(1.5 * 4.4482216152605) == b"1.5 lbF\r\n"
    assert cell_device(SELLETON).frame(9.80665) == b"ST, GS +1.00KG\r\n"
