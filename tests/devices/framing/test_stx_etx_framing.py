"""Frames between STX and ETX: noise and halves cost the frame that they touch, and no reading is ever made of them."""

from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.devices import DeviceProfile, cell_device, cell_host, output_device, output_host
from gateway.devices.force_reading import ForceReading
from gateway.devices.messages import Accepted, ForceSample, Garbage, Quality, SetVoltage

FORCES = st.floats(-900.0, 900.0)
NOISE = st.binary(max_size=30).filter(lambda noise: b"\x03" not in noise)
READING = ForceReading(
    frame="\x02{status:G|M|O}\t{force:+08.2f}",
    unit="N",
    quality={"G": Quality.OK, "M": Quality.UNSTABLE, "O": Quality.OVERLOAD},
    overload=("\x02------",),
    rate_hz=50.0,
)


@pytest.fixture(scope="module")
def framed(indicator: DeviceProfile) -> DeviceProfile:
    return replace(indicator, stream=READING, terminator="\x03")


def raws(found: list[object]) -> list[float]:
    return [one.raw for one in found if isinstance(one, ForceSample)]


@given(FORCES)
def test_the_host_reads_what_the_device_prints(framed: DeviceProfile, force_n: float) -> None:
    frame = cell_device(framed).frame(force_n)
    assert (frame[:1], frame[-1:], frame.count(b"\x03")) == (b"\x02", b"\x03", 1)
    assert raws([*cell_host(framed).receive(frame, 0.0)]) == [pytest.approx(force_n, abs=0.00501)]


@given(st.lists(FORCES, max_size=6), st.binary(max_size=30), st.lists(st.integers(0, 120), max_size=6))
def test_cutting_the_stream_elsewhere_changes_nothing(
    framed: DeviceProfile, forces_n: list[float], noise: bytes, cuts: list[int]
) -> None:
    device = cell_device(framed)
    stream = noise + b"".join(map(device.frame, forces_n)) + noise
    places = sorted({0, *(cut for cut in cuts if cut < len(stream)), len(stream)})
    whole, parted = cell_host(framed), cell_host(framed)
    pieces = [parted.receive(stream[start:end], 0.0) for start, end in pairwise(places)]
    assert [found for piece in pieces for found in piece] == whole.receive(stream, 0.0)


@given(NOISE.filter(len), FORCES)
def test_noise_before_stx_costs_that_frame_and_no_other(framed: DeviceProfile, noise: bytes, force_n: float) -> None:
    frame = cell_device(framed).frame(force_n)
    first, second = cell_host(framed).receive(noise + frame + frame, 0.0)
    assert first == Garbage(noise + frame)
    assert isinstance(second, ForceSample)


@given(st.data(), FORCES)
def test_a_half_frame_is_never_joined_with_the_next_one(
    framed: DeviceProfile, data: st.DataObject, force_n: float
) -> None:
    """The end of the first is lost, or its beginning: the stream was begun in the middle of it."""
    frame = cell_device(framed).frame(force_n)
    place = data.draw(st.integers(1, len(frame) - 1))
    torn, whole, after = cell_host(framed).receive(frame[place:] + frame + frame, 0.0)
    assert (torn, raws([whole, after])) == (Garbage(frame[place:]), raws([after]) * 2)
    lost, after = cell_host(framed).receive(frame[:place] + frame + frame, 0.0)
    assert lost == Garbage(frame[:place] + frame)
    assert isinstance(after, ForceSample)


@given(st.data(), FORCES)
def test_an_unplug_in_the_middle_of_a_frame_costs_no_frame_after_it(
    framed: DeviceProfile, data: st.DataObject, force_n: float
) -> None:
    host, frame = cell_host(framed), cell_device(framed).frame(force_n)
    host.receive(frame[: data.draw(st.integers(1, len(frame) - 1))], 0.0)
    host.forget()
    assert isinstance(host.receive(frame, 1.0)[0], ForceSample)


def test_a_torn_frame_never_becomes_another_number(framed: DeviceProfile) -> None:
    frame = cell_device(framed).frame(12.34)
    for start in range(len(frame)):
        for end in range(start + 1, len(frame)):
            found = cell_host(framed).receive(frame[:start] + frame[end:] + b"\x03", 0.0)
            assert all(raw == 12.34 for raw in raws([*found]))


@given(st.binary(max_size=300))
def test_no_bytes_make_the_reader_raise_and_none_is_lost(framed: DeviceProfile, data: bytes) -> None:
    found = cell_host(framed).receive(data + b"\x03", 0.0)
    if not raws([*found]):
        assert b"".join(one.data for one in found if isinstance(one, Garbage)) == data + b"\x03"


@given(st.floats(0.0, 10.0))
def test_an_output_is_set_and_confirms_between_stx_and_etx(itv: DeviceProfile, voltage_v: float) -> None:
    assert itv.set_voltage
    setting = replace(itv.set_voltage, ask="\x02SET\t{counts:d}", answer="\x02{counts:d}")
    profile = replace(itv, set_voltage=setting, terminator="\x03")
    host, device = output_host(profile), output_device(profile)
    asked = host.request(SetVoltage(voltage_v))
    (understood,) = device.receive(asked, 0.0)
    assert isinstance(understood, SetVoltage)
    (answer,) = host.receive(device.reply(Accepted(understood.voltage_v), to=understood), 0.0)
    assert answer == Accepted(pytest.approx(voltage_v, abs=0.006))
    assert isinstance(device.receive(b"\x02SE" + asked, 0.0)[0], Garbage), "half a command before it swallows it"
