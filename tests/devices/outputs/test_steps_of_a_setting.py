"""How finely a device is set and judged by its answers: where it counts from, its decimals, the rounding of both ways."""

from dataclasses import replace

import pytest

from gateway.devices import DeviceProfile, cell_host, output_device, output_host
from gateway.devices.exchange import VoltageExchange, VoltageRange
from gateway.devices.force_reading import ForceReading
from gateway.devices.messages import (
    Accepted,
    AskDevice,
    DeviceStep,
    ForceSample,
    Garbage,
    Pressure,
    Quality,
    ReadPressure,
    ReadVoltage,
    SetVoltage,
)
from gateway.devices.template_codecs.unread_line import explain_unread
from tests.profile_files import load_device


def spoken(itv: DeviceProfile, ask: str, answer: str, span: tuple[float, float], volts: tuple[float, float]):
    exchange = VoltageExchange(ask=ask, answer=answer, range=VoltageRange(device=span, voltage_v=volts))
    return replace(itv, set_voltage=exchange, read_voltage=None)


@pytest.mark.parametrize(
    ("ask", "answer", "resolution_v", "rounded_v"),
    [
        ("SET {v:.3f}", "{v:.3f}", 1e-3, 1e-3),
        ("SET {v:.3f}", "{v:.2f}", 1e-3, 1.1e-2),
        ("SET {v:.2f}", "{v:.3f}", 1e-2, 1.1e-2),
        ("SET {v:.2f}", "OK", 1e-2, 1e-2),
    ],
)
def test_a_setting_is_confirmed_within_the_rounding_of_both_ways_and_no_further(
    itv: DeviceProfile, ask: str, answer: str, resolution_v: float, rounded_v: float
) -> None:
    host = output_host(spoken(itv, ask, answer, (0.0, 10.0), (0.0, 10.0)))
    assert host.resolution_v == pytest.approx(resolution_v)
    within = [host.confirms(5.0, Accepted(5.0 + share * rounded_v), SetVoltage(5.0)) for share in (0.5, 0.95)]
    assert within == [True, False]


@pytest.mark.parametrize("kind", [".2E", ".4E", ".6E", "g", "float32", "float32-cdab"])
@pytest.mark.parametrize("full", [10.0, 150.0, 10_000.0, 1.0e6])
def test_what_rounds_large_numbers_coarsely_is_judged_by_its_step_there(
    itv: DeviceProfile, kind: str, full: float
) -> None:
    """A regulator in mbar or Pa: of 133412.3 Pa `.4E` says 1.3341E+05, a C program's %g 133412, a float32 133412.297."""
    host = output_host(spoken(itv, f"SET {{n:{kind}}}", f"{{n:{kind}}}", (0.0, full), (0.0, 10.0)))
    for voltage_v in (0.12345678, 1.33412345, 7.36123456, 9.87654321):
        number = voltage_v / 10.0 * full
        if kind == "g":
            answer = f"{number:g}".encode()
        else:
            answer = host.request(SetVoltage(voltage_v)).removeprefix(b"SET ").removesuffix(b"\r\n")
            host.forget()
        host.request(SetVoltage(voltage_v))
        (heard,) = host.receive(answer + b"\r\n", 0.0)
        assert isinstance(heard, Accepted)
        assert host.confirms(voltage_v, heard, SetVoltage(voltage_v)), (voltage_v, answer)
        far_v = 3.0 * max(host.resolution_v, 1e-3)
        assert not host.confirms(voltage_v, Accepted(heard.voltage_v + far_v), SetVoltage(voltage_v))


def test_a_small_number_with_an_exponent_is_sent_with_all_its_digits(itv: DeviceProfile) -> None:
    """A current source that is set in A: of 4 .. 20 mA `.4E` went out in steps of 0.1 mA, 0.06 V."""
    profile = spoken(itv, "CURR {n:.4E}", "{n:.4E}", (0.004, 0.02), (0.0, 10.0))
    host, device = output_host(profile), output_device(profile)
    asked = host.request(SetVoltage(3.456))
    (heard,) = device.receive(asked, 0.0)
    assert asked == b"CURR 9.5300E-03\r\n"
    assert isinstance(heard, SetVoltage) and heard.voltage_v == pytest.approx(3.456, abs=1e-3)
    assert host.resolution_v == pytest.approx(10.0 / 16_000)
    (answer,) = host.receive(device.reply(Accepted(3.456), heard), 0.0)
    assert isinstance(answer, Accepted) and host.confirms(3.456, answer, SetVoltage(3.456))
    assert not host.confirms(3.456, Accepted(3.47), SetVoltage(3.456))


@pytest.mark.parametrize(
    ("kind", "full", "answer"),
    [("g", 689_475.7, b"689476"), (".3E", 689_475.7, b"6.895E+05"), ("float32-cdab", 16_777.3, b"129A4683")],
)
def test_the_end_of_a_range_is_heard_where_it_is_rounded_up(
    itv: DeviceProfile, kind: str, full: float, answer: bytes
) -> None:
    profile = spoken(itv, f"SET {{n:{kind}}}", f"{{n:{kind}}}", (0.0, full), (0.0, 10.0))
    host, device = output_host(profile), output_device(profile)
    (obeyed,) = device.receive(host.request(SetVoltage(10.0)), 0.0)
    (heard,) = host.receive(answer + b"\r\n", 0.0)
    assert isinstance(obeyed, SetVoltage) and isinstance(heard, Accepted)
    assert host.confirms(10.0, heard, SetVoltage(10.0))


@pytest.mark.parametrize("volts", [(0.0, 10.0), (-10.0, 10.0), (2.0, 10.0)])
@pytest.mark.parametrize("span", [(0.0, 4095.0), (819.0, 4095.0)])
def test_a_device_is_set_to_what_was_meant_wherever_it_begins_to_count(
    itv: DeviceProfile, volts: tuple[float, float], span: tuple[float, float]
) -> None:
    profile = spoken(itv, "SET {n:d}", "{n:d}", span, volts)
    host, device = output_host(profile), output_device(profile)
    for voltage_v in (volts[0], 3.3, volts[1]):
        (heard,) = device.receive(host.request(SetVoltage(voltage_v)), 0.0)
        assert isinstance(heard, SetVoltage)
        assert heard.voltage_v == pytest.approx(voltage_v, abs=0.51 * host.resolution_v)


def test_blanks_are_an_overload_where_the_device_means_one_and_noise_elsewhere() -> None:
    stream = load_device("stream-st-gs")
    for means_one in (True, False):
        reading = ForceReading(frame="{force:+08.2f}", unit="N", blank_is_overload=means_one, rate_hz=50)
        (heard,) = cell_host(replace(stream, stream=reading)).receive(b" " * 8 + b"\r\n", 0.0)
        assert isinstance(heard, ForceSample if means_one else Garbage)
        assert not isinstance(heard, ForceSample) or heard.quality is Quality.OVERLOAD


def test_raw_bytes_of_a_value_cannot_be_read_out_of_text() -> None:
    aed = load_device("hbm-aed-binary")
    assert aed.read_force
    with pytest.raises(ValueError, match=r"codec hbm-binary: frame is \{force:int32\}"):
        cell_host(replace(aed, read_force=replace(aed.read_force, frame="{force:+08.2f}")), unit="N")


def test_a_binary_line_that_happens_to_be_printable_is_not_quoted_as_text() -> None:
    assert explain_unread(load_device("hbm-aed-binary"), b"ABCDEF") == ""
    assert explain_unread(load_device("waveshare-ao8b"), b"ABCDEF") == ""


def test_a_question_that_is_sent_into_the_middle_of_an_answer_does_not_cut_it(itv: DeviceProfile) -> None:
    host, device = output_host(itv), output_device(itv)
    host.request(ReadVoltage())
    answer = device.reply(Accepted(5.0), to=ReadVoltage())
    assert host.receive(answer[:2], 0.0) == []
    host.request(ReadPressure())
    voltage, pressure = host.receive(answer[2:] + device.reply(Pressure(4.5e5)), 0.0)
    assert voltage == Accepted(pytest.approx(5.0, abs=0.01))
    assert isinstance(pressure, Pressure)


def test_a_watchdog_that_has_a_sign_of_life_is_fed_by_that_alone() -> None:
    profile = load_device("icpdas-702x")
    own = profile.own_watchdog
    assert own
    for fed in (True, False):
        host, device = output_host(profile), output_device(profile)
        for step in host.checks:
            if step is not DeviceStep.DISARM:
                device.receive(host.request(AskDevice(step)), 0.0)
        for now_s in (0.7 * own.time_s, 1.4 * own.time_s):
            device.receive(host.sign_of_life if fed else host.request(SetVoltage(1.0)), now_s)
        assert device.is_tripped is not fed


def test_before_any_safe_frame_the_safe_voltage_is_the_lowest(itv: DeviceProfile) -> None:
    assert output_host(itv).safe_reply == b"0\r\n"
