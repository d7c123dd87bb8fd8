"""Both ends of the load cell's wire against each other, and the traps of real amplifiers."""

from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.devices import DeviceProfile, TemplateError, cell_device, cell_host, output_host
from gateway.devices.force_reading import ForceReading
from gateway.devices.framing import LONGEST_LINE_BYTES
from gateway.devices.messages import ForceSample, Garbage, Quality, RepeatedSample
from gateway.profiles import load_device

FORCES = st.floats(-900.0, 900.0)


def polled(indicator: DeviceProfile, **reading: object) -> DeviceProfile:
    """A cell that is asked, in the manner of Mantracourt's `!001:SYS?`."""
    asked = ForceReading(ask="!{address:03d}:SYS?", frame="{force:.3f}", **reading)  # type: ignore[arg-type]
    return replace(indicator, stream=None, read_force=asked, constants={"address": 1}, terminator="\r")


@given(FORCES, st.sampled_from([Quality.OK, Quality.UNSTABLE]))
def test_the_host_reads_what_the_device_prints(indicator: DeviceProfile, force_n: float, quality: Quality) -> None:
    host = cell_host(indicator)
    (sample,) = host.receive(cell_device(indicator).frame(force_n, quality), 3.0)
    assert isinstance(sample, ForceSample)
    assert sample.force_n == pytest.approx(force_n, abs=0.5001 * host.resolution_n)
    assert (sample.quality, sample.time_s) == (quality, 3.0)


@given(st.lists(FORCES, max_size=6), st.binary(max_size=30), st.lists(st.integers(0, 150), max_size=6))
def test_cutting_the_stream_elsewhere_changes_nothing(
    indicator: DeviceProfile, forces_n: list[float], noise: bytes, cuts: list[int]
) -> None:
    device = cell_device(indicator)
    stream = noise + b"".join(device.frame(force_n) for force_n in forces_n) + noise
    places = sorted({0, *(cut for cut in cuts if cut < len(stream)), len(stream)})
    whole, parted = cell_host(indicator), cell_host(indicator)
    pieces = [parted.receive(stream[start:end], 0.0) for start, end in pairwise(places)]
    assert [found for piece in pieces for found in piece] == whole.receive(stream, 0.0)


def test_a_sentence_that_is_known_by_heart_is_read_as_when_it_was_new(indicator: DeviceProfile) -> None:
    host, frame = cell_host(indicator), cell_device(indicator).frame(12.0)
    (first,) = host.receive(frame, 1.0)
    for force_n in range(1, 100):
        host.receive(cell_device(indicator).frame(force_n), 1.0)
        assert len(host._known) <= 64, "memory is bounded, whatever comes"
    (again,) = host.receive(frame, 2.0)
    assert isinstance(first, ForceSample)
    assert again == replace(first, time_s=2.0)
    assert host.receive(frame + frame[:5], 3.0) == [replace(first, time_s=3.0)]
    assert host.receive(frame[5:], 4.0) == [replace(first, time_s=4.0)], "its first half waited"


def test_a_known_sentence_at_the_end_of_an_endless_line_is_no_reading(indicator: DeviceProfile) -> None:
    host, frame = cell_host(indicator), cell_device(indicator).frame(12.0)
    assert isinstance(host.receive(frame, 1.0)[0], ForceSample)
    rest_of_it = host.receive(b"#" * LONGEST_LINE_BYTES + frame, 2.0)
    assert rest_of_it == [Garbage(b"#" * LONGEST_LINE_BYTES), Garbage(frame)]
    host.receive(b"##", 3.0)
    assert host.receive(frame, 4.0) == [Garbage(b"##" + frame)]


@given(st.integers(1, 16), FORCES)
def test_a_stream_that_starts_in_the_middle_of_a_frame_costs_that_frame(
    indicator: DeviceProfile, start: int, force_n: float
) -> None:
    frame = cell_device(indicator).frame(force_n)
    first, second = cell_host(indicator).receive(frame[start:] + frame, 0.0)
    assert first == Garbage(frame[start:])
    assert isinstance(second, ForceSample)


def test_an_unplug_in_the_middle_of_a_frame_joins_no_halves(indicator: DeviceProfile) -> None:
    host = cell_host(indicator)
    host.receive(b"ST,GS,+00", 0.0)
    host.forget()
    (sample,) = host.receive(b"ST,GS,+0001.00kg\r\n", 1.0)
    assert isinstance(sample, ForceSample)
    assert sample.raw == 1.0


def test_a_torn_frame_never_becomes_another_number(indicator: DeviceProfile) -> None:
    frame = b"ST,GS,+0012.34kg\r\n"
    for start in range(len(frame)):
        for end in range(start + 1, len(frame)):
            torn = frame[:start] + frame[end:]
            for found in cell_host(indicator).receive(torn + b"\r\n", 0.0):
                assert isinstance(found, Garbage) or found.raw == 12.34


@given(st.binary(max_size=600))
def test_garbage_is_counted_and_never_an_exception(indicator: DeviceProfile, data: bytes) -> None:
    found = cell_host(indicator).receive(data + b"\r\n", 0.0)
    garbage = sum(len(one.data) for one in found if isinstance(one, Garbage))
    if not any(isinstance(one, ForceSample) for one in found):
        assert garbage == len(data) + 2 or data.endswith(b"\r")


def test_the_rig_turns_the_sign(indicator: DeviceProfile) -> None:
    frame = cell_device(indicator).frame(9.80665)
    (as_wired,) = cell_host(indicator, 1).receive(frame, 0.0)
    (turned,) = cell_host(indicator, -1).receive(frame, 0.0)
    assert isinstance(as_wired, ForceSample)
    assert isinstance(turned, ForceSample)
    assert (as_wired.force_n, turned.force_n) == (9.80665, -9.80665)
    assert as_wired.raw == turned.raw == 1.0


@pytest.mark.parametrize(("unit", "newtons"), [("kg", 98.0665), ("lb", 44.482216), ("g", 0.0980665), ("N", 10.0)])
def test_the_unit_that_a_frame_says_counts_and_no_other(unit: str, newtons: float) -> None:
    """Somebody has pressed the unit key of the indicator: 10 of whatever it says now are no 10 kg."""
    (sample,) = cell_host(load_device("stream-st-gs")).receive(f"ST,GS,+0010.00{unit}\r\n".encode(), 1.0)
    assert isinstance(sample, ForceSample) and sample.force_n == pytest.approx(newtons)


def test_a_unit_that_is_spelt_otherwise_is_text_of_the_frame(indicator: DeviceProfile) -> None:
    profile = replace(indicator, stream=ForceReading(frame="{force:.2f} lbF", unit="lb", rate_hz=10.0))
    host = cell_host(profile)
    (sample,) = host.receive(b"-18.78 lbF\r\n", 1.0)
    assert isinstance(sample, ForceSample) and sample.force_n == pytest.approx(-18.78 * 4.4482216152605)
    assert host.receive(b"-18.78 kgF\r\n", 1.0) == [Garbage(b"-18.78 kgF\r\n")], "never taken for pounds"
    assert cell_device(profile).frame(sample.force_n) == b"-18.78 lbF\r\n"


def test_a_reading_that_the_device_calls_repeated_is_no_sample() -> None:
    """It keeps a dead converter from looking alive."""
    profile = load_device("stream-st-gs")
    assert profile.stream
    repeating = replace(
        profile,
        stream=replace(profile.stream, quality={"ST": Quality.OK, "US": Quality.REPEATED, "OL": Quality.OVERLOAD}),
    )
    host = cell_host(repeating)
    assert host.receive(b"US,GS,+0010.00kg\r\n" * 2, 1.0) == [RepeatedSample()] * 2
    assert isinstance(host.receive(b"ST,GS,+0010.00kg\r\n", 1.0)[0], ForceSample)
    assert host.receive(b"US,GS,+0010.00kg\r\n", 2.0) == [RepeatedSample()], "known by heart, too"


def test_one_count_of_the_display_in_newtons(indicator: DeviceProfile) -> None:
    assert cell_host(indicator).resolution_n == pytest.approx(0.0980665)
    assert cell_host(indicator).poll() == b""


def test_a_unit_said_twice_is_refused(indicator: DeviceProfile) -> None:
    with pytest.raises(ValueError, match="one too many"):
        cell_host(indicator, 1, "N")


def test_a_polled_cell_is_asked_and_needs_the_rigs_unit(indicator: DeviceProfile) -> None:
    profile = polled(indicator)
    with pytest.raises(ValueError, match="the rig must"):
        cell_host(profile)
    host, device = cell_host(profile, 1, "kg"), cell_device(profile)
    assert host.poll() == b"!001:SYS?\r"
    assert device.receive(host.poll() + b"!002:SYS?\r" + host.poll(), 0.0) == 2
    assert host.receive(b"123.456\r", 1.0) == [
        ForceSample(123.456, pytest.approx(1210.6897, abs=1e-3), Quality.OK, 1.0)
    ]


def test_an_open_frame_says_overload_with_its_largest_number(indicator: DeviceProfile) -> None:
    device = cell_device(polled(indicator, unit="N"))
    assert device.frame(12.3456) == b"12.346\r"
    assert device.frame(1.0, Quality.OVERLOAD) == b"999999.000\r"


def test_a_load_cell_is_no_output(indicator: DeviceProfile) -> None:
    with pytest.raises(ValueError, match="role load cell, output is needed"):
        output_host(indicator)
    with pytest.raises(ValueError, match="codec hbm-aed is not one of template"):
        cell_host(replace(indicator, codec="hbm-aed"))


@pytest.mark.parametrize(
    ("reading", "hint"),
    [
        ({"frame": "{load:.2f}"}, "has no number"),
        ({"frame": "{force:s}"}, "has no number"),
        ({"frame": "{force:.2f} {unit:kg|oz}"}, "units are N, kg, g, lb; another is text, with `unit`"),
        ({"frame": "{status:ST|US} {force:.2f}", "quality": {"ST": Quality.OK}}, "'US' is not named"),
        ({"frame": "{force:.2f}", "quality": {"ST": Quality.OK}}, "'ST' is no word of it"),
        ({"frame": "{force:.2f}", "blank_is_overload": True}, "fixed width"),
    ],
)
def test_a_reading_that_means_nothing_is_told_to_its_author(reading: dict[str, object], hint: str) -> None:
    with pytest.raises(TemplateError, match=hint):
        ForceReading(**reading)  # type: ignore[arg-type]


def test_what_begins_a_stream_is_a_whole_question_and_a_stream_that_needs_none_has_none(
    indicator: DeviceProfile,
) -> None:
    assert cell_host(indicator).start == b""
    assert indicator.stream
    told = replace(indicator, stream=replace(indicator.stream, start="SIR"), question_terminator=";")
    assert (cell_host(told).start, cell_host(told).poll()) == (b"SIR;", b"")
