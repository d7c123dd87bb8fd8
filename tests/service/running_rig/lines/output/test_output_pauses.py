"""What lies between two questions to an output: a time-out that ends the first, and the silence of a bus."""

import pytest

from gateway.devices import output_device, output_host
from gateway.devices.messages import Accepted, SetVoltage
from gateway.service.running_rig.lines.output_line import OutputExchange
from tests.profile_files import load_device
from tests.service.running_rig.lines.output.played_output import REPLY_TIMEOUT_S, Wire, wire

__all__ = ["wire"]


def test_a_bus_has_its_silence_before_the_next_question() -> None:
    """Without it the device does not see where a frame ends."""
    wire, profile = Wire(), load_device("waveshare-ao8b")
    host, device = output_host(profile), output_device(profile)
    wire.exchange = OutputExchange(host, wire.written.append, REPLY_TIMEOUT_S)
    wire.set_voltage(0)
    (question,) = device.receive(wire.written[-1], wire.now_s)
    assert isinstance(question, SetVoltage) and host.gap_s > 0.001
    wire.set_voltage(512, after_s=0.01)
    wire.exchange.on_bytes(device.reply(Accepted(question.voltage_v), question), wire.now_s)
    wire.tick(0.9 * host.gap_s)
    assert len(wire.written) == 1
    wire.tick(0.2 * host.gap_s)
    assert len(wire.written) == 2


def test_half_an_answer_from_before_a_time_out_is_no_part_of_the_next(wire: Wire) -> None:
    wire.set_voltage(512)
    wire.exchange.on_bytes(b"5", wire.now_s)
    wire.tick(REPLY_TIMEOUT_S + 0.001)
    assert wire.written == [b"SET 512\r\n"] * 2
    wire.answer("512")
    assert wire.exchange.confirmed_v == pytest.approx(512 * 10 / 1023)
