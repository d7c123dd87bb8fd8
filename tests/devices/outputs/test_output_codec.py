"""Both ends of the regulator's wire against each other, and what a bad wire must not do."""

from dataclasses import replace
from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.devices import DeviceProfile, ValueRefused, output_device, output_host
from gateway.devices.exchange import Refusals, VoltageExchange, VoltageRange
from gateway.devices.messages import (
    Accepted,
    Garbage,
    OutputRequest,
    Pressure,
    ReadPressure,
    ReadVoltage,
    Refused,
    SetVoltage,
)

COUNTS = st.integers(0, 1023)


def volts(count: int) -> float:
    return count * (10.0 / 1023)


@given(COUNTS)
def test_the_device_understands_what_the_host_says(itv: DeviceProfile, count: int) -> None:
    host, device = output_host(itv), output_device(itv)
    messages: list[OutputRequest] = [SetVoltage(volts(count)), ReadVoltage(), ReadPressure()]
    for message in messages:
        assert device.receive(host.request(message), 0.0) == [message]


@given(COUNTS, COUNTS)
def test_the_host_understands_what_the_device_answers(itv: DeviceProfile, set_count: int, pressure: int) -> None:
    host, device = output_host(itv), output_device(itv)
    host.request(SetVoltage(volts(set_count)))
    host.request(ReadPressure())
    answers = device.reply(Accepted(volts(set_count))) + device.reply(Pressure(pressure * 0.9e6 / 1023))
    accepted, measured = host.receive(answers, 0.0)
    assert accepted == Accepted(pytest.approx(volts(set_count)))
    assert measured == Pressure(pytest.approx(pressure * 0.9e6 / 1023))


@given(st.floats(0.0, 10.0))
def test_an_off_grid_voltage_is_echoed_within_half_a_step(itv: DeviceProfile, voltage_v: float) -> None:
    host, device = output_host(itv), output_device(itv)
    (request,) = device.receive(host.request(SetVoltage(voltage_v)), 0.0)
    assert isinstance(request, SetVoltage)
    (reply,) = host.receive(device.reply(Accepted(request.voltage_v)), 0.0)
    assert isinstance(reply, Accepted)
    assert abs(reply.voltage_v - voltage_v) <= 0.5001 * host.resolution_v


@pytest.mark.parametrize("question", [SetVoltage(5.0), ReadVoltage()])
def test_half_a_step_is_the_device_s_rounding_and_a_whole_one_is_another_voltage(
    itv: DeviceProfile, question: OutputRequest
) -> None:
    host = output_host(itv)
    off = {
        share: host.confirms(5.0, Accepted(5.0 + share * host.resolution_v), question) for share in (-1, -0.5, 0.5, 1)
    }
    assert off == {-1: False, -0.5: True, 0.5: True, 1: False}


@pytest.mark.parametrize("voltage_v", [nan, inf, -inf, -0.01, 10.01])
def test_a_voltage_that_is_none_never_reaches_the_wire(itv: DeviceProfile, voltage_v: float) -> None:
    host = output_host(itv)
    with pytest.raises(ValueRefused):
        host.request(SetVoltage(voltage_v))
    with pytest.raises(ValueRefused):
        host.safe_frame(voltage_v)
    assert host.receive(b"512\r\n", 0.0) == [Garbage(b"512\r\n")], "no answer is expected"


def test_a_bare_number_means_what_was_asked(itv: DeviceProfile) -> None:
    host = output_host(itv)
    for message in (SetVoltage(volts(512)), ReadPressure(), ReadVoltage()):
        host.request(message)
    replies = host.receive(b"512\r\n512\r\n512\r\n", 0.0)
    assert [type(reply) for reply in replies] == [Accepted, Pressure, Accepted]
    assert host.receive(b"512\r\n", 0.0) == [Garbage(b"512\r\n")], "no answer is expected"


def test_an_altered_echo_is_visible(itv: DeviceProfile) -> None:
    host = output_host(itv)
    host.request(SetVoltage(volts(512)))
    (reply,) = host.receive(b"12\r\n", 0.0)
    assert reply == Accepted(pytest.approx(volts(12)))


@pytest.mark.parametrize("line", [b"512\r\n", b"OUT OF RANGE\r\n", b"UNKNOWN COMMAND\r\n"])
def test_an_answer_to_nothing_is_garbage(itv: DeviceProfile, line: bytes) -> None:
    assert output_host(itv).receive(line, 0.0) == [Garbage(line)]


@pytest.mark.parametrize(
    "line", [b"5!2\r\n", b"1024\r\n", b"-1\r\n", b"5.0\r\n", b"\r\n", b"\xff\xfe\r\n", b"OUT OF\r\n"]
)
def test_noise_is_no_answer_and_the_real_one_still_counts(itv: DeviceProfile, line: bytes) -> None:
    host = output_host(itv)
    host.request(SetVoltage(volts(512)))
    assert host.receive(line, 0.0) == [Garbage(line)]
    assert host.receive(b"512\r\n", 0.0) == [Accepted(pytest.approx(volts(512)))]


def test_a_pressure_is_never_taken_for_an_echo_after_a_garbled_line(itv: DeviceProfile) -> None:
    host = output_host(itv)
    host.request(SetVoltage(volts(512)))
    host.request(ReadPressure())
    assert host.receive(b"5\xb12\r\n300\r\n", 0.0) == [Garbage(b"5\xb12\r\n"), Garbage(b"300\r\n")]
    assert host.receive(b"512\r\n", 0.0) == [Garbage(b"512\r\n")], "no answer is expected"


def test_half_a_late_answer_does_not_spoil_the_next(itv: DeviceProfile) -> None:
    host = output_host(itv)
    host.request(SetVoltage(volts(100)))
    assert host.receive(b"10", 0.0) == []
    host.forget()
    host.request(SetVoltage(volts(512)))
    assert host.receive(b"512\r\n", 0.1) == [Accepted(pytest.approx(volts(512)))]


def test_bytes_from_before_the_question_are_no_part_of_its_answer(itv: DeviceProfile) -> None:
    host = output_host(itv)
    assert host.receive(b"99", 0.0) == []
    host.request(SetVoltage(volts(512)))
    assert host.receive(b"512\r\n", 0.1) == [Accepted(pytest.approx(volts(512)))]


@given(st.binary(max_size=400))
def test_no_bytes_make_an_end_raise(itv: DeviceProfile, data: bytes) -> None:
    host, device = output_host(itv), output_device(itv)
    host.request(SetVoltage(1.0))
    host.request(ReadPressure())
    host.receive(data, 0.0)
    for request in device.receive(data, 0.0):
        if isinstance(request, Garbage):
            assert device.refusal(request) in (Refused("UNKNOWN COMMAND"), Refused("OUT OF RANGE"))


@given(
    st.lists(st.sampled_from([b"SET 512\r\n", b"MON\r\n", b"REQ\r\n", b"INC\r\n", b"SET 20", b"\r\n", b"\xff"])),
    st.data(),
)
def test_cutting_the_stream_elsewhere_changes_nothing(
    itv: DeviceProfile, sentences: list[bytes], data: st.DataObject
) -> None:
    stream = b"".join(sentences)
    cut = data.draw(st.integers(0, len(stream)))
    whole, parted = output_device(itv), output_device(itv)
    assert parted.receive(stream[:cut], 0.0) + parted.receive(stream[cut:], 0.0) == whole.receive(stream, 0.0)


def test_a_pressure_beyond_the_sensor_reads_as_its_end(itv: DeviceProfile) -> None:
    device = output_device(itv)
    assert device.reply(Pressure(2.0e6)) == b"1023\r\n"
    assert device.reply(Pressure(-1.0)) == b"0\r\n"


def test_a_setting_in_hexadecimal_counts_is_spelled_and_read_back(itv: DeviceProfile) -> None:
    """Bytes of Bronkhorst's ProPar ASCII protocol (manual 9.17.027): half of the setpoint's range, set and read."""
    scale = VoltageRange(device=(0.0, 32000.0), voltage_v=(0.0, 10.0))
    profile = replace(
        itv,
        constants={"address": 128},
        set_voltage=VoltageExchange(
            ask=":06{address:02X}010121{counts:04X}", answer=":04{address:02X}000005", range=scale
        ),
        read_voltage=VoltageExchange(
            ask=":06{address:02X}0401210121", answer=":06{address:02X}020121{counts:04X}", range=scale
        ),
        read_pressure=None,
        refusals=Refusals(),
        steps=(),
    )
    host, device = output_host(profile), output_device(profile)
    assert host.request(SetVoltage(5.0)) == b":06800101213E80\r\n"
    assert device.receive(b":06800101213E80\r\n", 0.0) == [SetVoltage(5.0)]
    assert host.receive(b":0480000005\r\n", 0.0) == [Accepted(5.0)]
    assert host.request(ReadVoltage()) == b":06800401210121\r\n"
    assert host.receive(b":06800201213E80\r\n", 0.0) == [Accepted(5.0)]
    assert host.resolution_v == pytest.approx(10.0 / 32000.0)


def test_each_further_sentence_for_no_is_a_refusal_in_its_own_words(itv: DeviceProfile) -> None:
    """Of two kinds a third one was noise, and a device that was busy or set to local one that is silent."""
    profile = replace(itv, refusals=Refusals(unknown="?", others=("SYSTEM BUSY", "LOCAL MODE {lock:d}")))
    for said in ("?", "SYSTEM BUSY", "LOCAL MODE 2"):
        host = output_host(profile)
        host.request(SetVoltage(5.0))
        assert host.receive(f"{said}\r\n".encode(), 0.0) == [Refused(said)]
