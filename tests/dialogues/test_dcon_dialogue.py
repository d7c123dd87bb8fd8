"""DCON bytes from the ICP DAS 7000 series manuals: settings, readings, checksum, and the host watchdog."""

from dataclasses import replace

import pytest

from gateway.devices import ValueRefused, output_device, output_host
from gateway.devices.checksum import add_checksum, strip_checksum
from gateway.devices.messages import (
    Accepted,
    AskDevice,
    DeviceAnswer,
    DeviceStep,
    Garbage,
    ReadVoltage,
    Refused,
    SetVoltage,
    WatchdogTripped,
)
from tests.profile_files import load_device

I7021 = load_device("icpdas-702x")
I7021_SUM = replace(I7021, checksum="dcon-sum")
_WATCHDOG = I7021.own_watchdog
assert _WATCHDOG
I7021_TEN = replace(I7021, watchdog=replace(_WATCHDOG, time_s=10.0))


def test_a_setting_is_acknowledged_without_an_echo() -> None:
    host = output_host(I7021)
    assert host.request(SetVoltage(5.0)) == b"#0105.000\r"
    assert host.receive(b">\r", 0.0) == [Accepted(5.0)]
    assert (host.safe_frame(0.0), host.safe_reply) == (b"#0100.000\r", b">\r")


def test_the_last_that_a_module_hears_is_that_nobody_will_feed_its_watchdog() -> None:
    assert output_host(I7021_TEN).last_frame == b"~013064\r"
    assert output_host(load_device("smc-itv-rc")).last_frame == b""


def test_the_checksum_is_the_sum_of_the_codes() -> None:
    host = output_host(I7021_SUM)
    assert host.request(SetVoltage(5.0)) == b"#0105.000A7\r"
    assert output_device(I7021_SUM).receive(b"#0105.000A7\r", 0.0) == [SetVoltage(5.0)]
    assert output_device(I7021_SUM).receive(b"#0105.000A8\r", 0.0) == [Garbage(b"#0105.000A8\r")]
    assert host.receive(b">\r", 0.0) == [Garbage(b">\r")]


def test_the_configuration_question_of_the_manual_has_this_checksum() -> None:
    assert add_checksum(b"$012", "dcon-sum") == b"$012B7"
    assert strip_checksum(b"$012B7", "dcon-sum") == b"$012"
    assert strip_checksum(b"$012B8", "dcon-sum") is None


def test_another_address_is_not_ours() -> None:
    host, device = output_host(I7021), output_device(I7021)
    assert device.receive(b"#0205.000\r", 0.0) == [Garbage(b"#0205.000\r")]
    assert host.request(ReadVoltage()) == b"$016\r"
    assert host.receive(b"!0205.000\r", 0.0) == [Garbage(b"!0205.000\r")]
    assert host.receive(b"!0105.000\r", 0.0) == [Accepted(5.0)]


def test_bad_syntax_gets_no_answer_at_all() -> None:
    device = output_device(I7021)
    (garbage,) = device.receive(b"#01 5.0\r", 0.0)
    assert isinstance(garbage, Garbage)
    assert device.refusal(garbage) == Refused("")
    assert device.reply(Refused("")) == b""


def test_answers_differ_by_question() -> None:
    device = output_device(I7021)
    assert device.reply(Accepted(5.0)) == b">\r"
    assert device.reply(Accepted(5.0), to=ReadVoltage()) == b"!0105.000\r"


@pytest.mark.parametrize("voltage_v", [float("nan"), float("inf"), -float("inf"), -0.01, 10.01])
def test_what_the_range_does_not_carry_is_refused(voltage_v: float) -> None:
    with pytest.raises(ValueRefused, match=r"icpdas-702x takes 0 .. 10 V"):
        output_host(I7021).request(SetVoltage(voltage_v))


@pytest.mark.parametrize(
    ("step", "asked", "answered", "is_right", "text"),
    [
        (DeviceStep.IDENTITY, b"$01M\r", b"!017021\r", True, "7021"),
        (DeviceStep.IDENTITY, b"$01M\r", b"!017060\r", False, "7060"),
        (DeviceStep.IDENTITY, b"$01M\r", b"!0170211\r", False, "70211"),  # a longer number is another module
        (DeviceStep.IDENTITY, b"$01M\r", b"!01702\r", False, "702"),
        (DeviceStep.ARM, b"~013164\r", b"!01\r", True, ""),
        (DeviceStep.VERIFY, b"~012\r", b"!01164\r", True, "100"),
        (DeviceStep.VERIFY, b"~012\r", b"!0164\r", True, "100"),  # firmware that does not say whether it is enabled
        (DeviceStep.VERIFY, b"~012\r", b"!011FF\r", False, "255"),
        (DeviceStep.STATUS, b"~010\r", b"!0180\r", True, "armed"),
        (DeviceStep.STATUS, b"~010\r", b"!0104\r", False, "tripped"),
        (DeviceStep.STATUS, b"~010\r", b"!0100\r", False, "off"),
        (DeviceStep.CLEAR, b"~011\r", b"!01\r", True, ""),
        (DeviceStep.DISARM, b"~013064\r", b"!01\r", True, ""),
    ],
)
def test_identity_and_watchdog_as_the_manuals_print_them(
    step: DeviceStep, asked: bytes, answered: bytes, is_right: bool, text: str
) -> None:
    host = output_host(I7021_TEN)
    assert host.request(AskDevice(step)) == asked
    assert host.receive(answered, 0.0) == [DeviceAnswer(step, is_right, text)]


def test_a_disabled_watchdog_reads_back_as_nothing_to_rely_on() -> None:
    host = output_host(I7021_TEN)
    host.request(AskDevice(DeviceStep.VERIFY))
    assert host.receive(b"!01064\r", 0.0) == [Garbage(b"!01064\r")]
    host.request(AskDevice(DeviceStep.ARM))
    assert host.receive(b"?01\r", 0.0) == [Refused("?01")]


def test_firmware_with_another_tick_gets_other_counts() -> None:
    slow = replace(_WATCHDOG, time_s=0.96, tick_s=0.0533)
    assert output_host(replace(I7021, watchdog=slow)).request(AskDevice(DeviceStep.ARM)) == b"~013112\r"


def test_the_host_is_alive_for_all_and_nobody_answers() -> None:
    assert output_host(I7021).sign_of_life == b"~**\r"
    assert output_host(I7021_SUM).sign_of_life == add_checksum(b"~**", "dcon-sum") + b"\r"
    assert output_host(I7021_TEN).feed_period_s == 2.5
    assert output_device(I7021).receive(b"~**\r", 0.0) == []


def test_a_tripped_module_answers_a_setting_with_a_bang() -> None:
    host = output_host(I7021)
    host.request(SetVoltage(5.0))
    assert host.receive(b"!\r", 0.0) == [WatchdogTripped()]


def test_half_an_answer_to_a_reading_is_no_trip() -> None:
    """`!01+06.708` that is cut behind its first sign, as seed 30130 drew it."""
    host = output_host(I7021)
    host.request(ReadVoltage())
    assert host.receive(b"!\r", 0.0) == [Garbage(b"!\r")]


def test_a_number_out_of_range_is_refused_with_the_address() -> None:
    host, device = output_host(I7021), output_device(I7021)
    host.request(SetVoltage(5.0))
    assert host.receive(b"?01\r", 0.0) == [Refused("?01")]
    (garbage,) = device.receive(b"#0112.000\r", 0.0)
    assert isinstance(garbage, Garbage)
    assert device.reply(device.refusal(garbage)) == b"?01\r"


def test_the_simulated_module_trips_latches_and_is_cleared() -> None:
    device = output_device(I7021)

    def says(data: bytes, now_s: float) -> bytes:
        answer = b""
        for request in device.receive(data, now_s):
            match request:
                case Garbage():
                    answer += device.reply(device.refusal(request))
                case AskDevice(step):
                    answer += device.reply(DeviceAnswer(step, is_right=True), to=request)
                case SetVoltage(voltage_v):
                    answer += device.reply(Accepted(voltage_v), to=request)
        return answer

    assert says(b"~010\r", 0.0) == b"!0100\r"
    assert says(b"~01310A\r", 0.0) == b"!01\r"  # 1 s
    assert says(b"~010\r~012\r", 0.5) == b"!0180\r!0110A\r"
    assert says(b"#0105.000\r", 0.9) == b">\r"
    assert says(b"~**\r", 0.9) == b""
    assert not device.elapse(1.8)
    assert device.elapse(2.0), "only ~** feeds it"
    assert says(b"#0105.000\r", 2.1) == b"!\r"
    assert says(b"~010\r", 2.1) == b"!0104\r"
    assert says(b"~013114\r#0105.000\r", 2.2) == b"!01\r!\r", "arming does not clear it"
    assert says(b"~011\r#0105.000\r", 2.3) == b"!01\r>\r"


def test_a_module_with_several_outputs_names_one() -> None:
    module = load_device("icpdas-7024")
    host = output_host(replace(module, constants={"address": 1, "channel": 2}))
    assert output_host(module).request(SetVoltage(5.0)) == b"#010+05.000\r"
    assert host.request(SetVoltage(5.0)) == b"#012+05.000\r"
    assert host.request(ReadVoltage()) == b"$0162\r"
    assert host.receive(b">\r!01+05.000\r", 0.0) == [Accepted(5.0), Accepted(5.0)]


def test_a_simulated_watchdog_that_has_tripped_says_so_in_the_words_of_the_module() -> None:
    host = output_host(I7021)
    host.request(SetVoltage(5.0))
    said = output_device(I7021).reply(WatchdogTripped())
    assert (said, host.receive(said, 0.0)) == (b"!\r", [WatchdogTripped()])


@pytest.mark.parametrize("name", ["icpdas-702x", "icpdas-7024"])
@pytest.mark.parametrize(("state", "word"), [("00", "off"), ("80", "armed"), ("04", "tripped"), ("84", "tripped")])
def test_a_module_that_has_tripped_says_so_whether_it_is_armed_again_or_not(name: str, state: str, word: str) -> None:
    """Taken for armed it ignores each setting, and nobody knows why."""
    host = output_host(load_device(name))
    assert host.request(AskDevice(DeviceStep.STATUS)) == b"~010\r"
    (answer,) = host.receive(f"!01{state}\r".encode(), 0.0)
    assert isinstance(answer, DeviceAnswer) and answer.step is DeviceStep.STATUS
    assert answer.text == word
