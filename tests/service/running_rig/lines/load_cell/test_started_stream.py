"""A stream that begins when it is told to: at each opening, and again where the amplifier has lost its power meanwhile."""

from dataclasses import replace

import pytest

from gateway.devices import DeviceProfile, TemplateError
from gateway.devices.force_reading import ForceReading
from gateway.devices.messages import ForceSample
from tests.profile_files import load_device
from tests.service.running_rig.lines.load_cell.test_load_cell_line import Wire

START = b"SIR\r\n"
READING = ForceReading(start="SIR", frame="S {status:S|D} {force:10.2f} g", unit="g", rate_hz=90.0,
                       quality={"S": "ok", "D": "unstable"}, overload=("S +",))  # fmt: skip
SICS: DeviceProfile = replace(load_device("stream-st-gs"), name="sics", stream=READING)


@pytest.fixture
def wire() -> Wire:
    return Wire(SICS)


def test_it_is_begun_once_and_then_left_alone_while_it_talks(wire: Wire) -> None:
    wire.tick()
    assert wire.asked == [START]
    for _ in range(300):
        wire.answer(2.0, 0.01)
        wire.tick(0.0)
    assert wire.asked == [START]
    assert wire.exchange.is_stream
    assert wire.samples[-1] == ForceSample(pytest.approx(203.94), pytest.approx(2.0, abs=1e-4), "ok", wire.now_s)


def test_a_silent_one_is_begun_again_each_second_and_no_faster(wire: Wire) -> None:
    for _ in range(450):
        wire.tick(0.01)
    assert wire.asked == [START] * 5
    wire.answer(1.0)
    wire.tick(0.9)
    assert wire.asked == [START] * 5
    wire.tick(0.2)
    assert wire.asked == [START] * 6


def test_noise_is_no_stream(wire: Wire) -> None:
    wire.tick()
    for _ in range(11):
        wire.now_s += 0.1
        wire.exchange.receive(b"?\r\n", wire.now_s)
        wire.tick(0.0)
    assert wire.asked == [START] * 2


def test_it_is_begun_at_each_opening(wire: Wire) -> None:
    wire.tick()
    wire.answer()
    wire.exchange.reset()
    wire.tick()
    assert wire.asked == [START] * 2


def test_what_is_asked_is_not_begun() -> None:
    with pytest.raises(ValueError, match="`start` begins a stream: a cell that is asked needs none"):
        replace(READING, ask="SI")


def test_a_unit_in_the_frame_is_unit_enough() -> None:
    with pytest.raises(TemplateError, match="says its unit: newton_per_count is a second one"):
        ForceReading(frame="{force:8.2f}{unit:kg|lb}", newton_per_count=1.0, rate_hz=10.0)
