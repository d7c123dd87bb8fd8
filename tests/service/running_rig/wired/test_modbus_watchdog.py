"""The watchdog of a Modbus RTU output, said in PDUs: one that its time alone arms, one that is timed and switched on apart."""

import struct
from dataclasses import replace
from pathlib import Path

import pytest

from gateway.codes.faults import FaultCode
from gateway.devices import output_host
from gateway.devices.device_checks.watchdog import WatchdogState
from gateway.devices.messages import AskDevice, DeviceAnswer, DeviceStep
from gateway.devices.profile import DeviceProfile
from gateway.devices.rehearsal import rehearse
from gateway.profiles import OutputLine, ProfileError, load_device
from gateway.registers.words import State
from gateway.service.running_rig.lines.device_checks import DeviceChecks
from tests.service.rigs import demo
from tests.service.wired import ENABLE, RESET, Wired

HEAD = """\
name: {name}
description: an analogue output, 0-10 V in millivolts
role: output
source: composed
certainty: composed
hardware: never run on hardware
codec: modbus-rtu
serial: {{baud: 115200, data_bits: 8, parity: none, stop_bits: 1}}
reply_timeout_s: 0.06
identity: none
set_voltage: {{modbus: {{function: 6, register: 0}}, range: {{device: [0, 10000], voltage_v: [0.0, 10.0]}}}}
read_voltage: {{modbus: {{function: 3, register: 0}}, range: {{device: [0, 10000], voltage_v: [0.0, 10.0]}}}}
"""
# Holding register 8: milliseconds of silence, 0 switches it off, as in iSMA's SfAR modules (DMP270en, section 4).
ONE_REGISTER = """\
watchdog:
  time_s: 1.0
  tick_s: 0.001
  arm: {ask: "060008{time:04X}", answer: "060008{time:04X}"}
  disarm: {ask: "0600080000", answer: "0600080000"}
  verify: {ask: "0300080001", answer: "0302{time:04X}"}
"""
# Register 40489 in tenths of a second, coil 00261 switches it on, coil 00270 tells a trip and clears it: the map of ICP DAS
# M-7000 (M-7084 Rev. A1.3, section 3.1). That a range of coils is answered is composed.
TIMED_APART = """\
watchdog:
  time_s: 1.0
  tick_s: 0.1
  set_time: {ask: "0601E8{time:04X}", answer: "0601E8{time:04X}"}
  arm: {ask: "050104FF00", answer: "050104FF00"}
  disarm: {ask: "0501040000", answer: "0501040000"}
  verify: {ask: "0301E80001", answer: "0302{time:04X}"}
  status:
    ask: "010104000A"
    answer: "0102{state:0000|0100|0102|0002}"
    words: {"0000": "off", "0100": armed, "0102": tripped, "0002": tripped}
  clear: {ask: "05010DFF00", answer: "05010DFF00"}
"""
BOTH = {"one-register": ONE_REGISTER, "timed-apart": TIMED_APART}


def load(folder: Path, name: str, watchdog: str) -> DeviceProfile:
    path = folder / f"{name}.yaml"
    path.write_text(HEAD.format(name=name) + watchdog)
    return load_device(path)


@pytest.fixture(params=BOTH)
def device(request: pytest.FixtureRequest, tmp_path: Path) -> DeviceProfile:
    return load(tmp_path, request.param, BOTH[request.param])


def wired_to(device: DeviceProfile) -> Wired:
    return Wired(replace(demo(), output=OutputLine(device=device, port=None, baud=115200)))


def pdus_heard(wired: Wired) -> list[bytes]:
    """What went out, by length: each request here is of eight bytes with its unit and checksum."""
    data = b"\r\n".join(wired.observer.others) + wired.observer._line
    assert not len(data) % 8
    return [data[start + 1 : start + 6] for start in range(0, len(data), 8)]


def test_both_ends_of_such_a_profile_understand_each_other(device: DeviceProfile) -> None:
    assert list(rehearse(device)) == []


def test_it_is_armed_and_read_back_before_any_voltage_but_the_safe_one(device: DeviceProfile) -> None:
    wired = wired_to(device).ready()
    wired.write(0, ENABLE, 1200)
    wired.until(lambda: wired.state is State.HOLDING, 3.0)
    heard = pdus_heard(wired)
    first = next(n for n, pdu in enumerate(heard) if pdu[:3] == b"\x06\x00\x00" and struct.unpack(">H", pdu[3:]) > (0,))
    asked = [pdu.hex().upper() for pdu in heard[:first] if pdu[1:3] != b"\x00\x00"]
    whole = {
        "one-register": ["06000803E8", "0300080001"],
        "timed-apart": ["010104000A", "0601E8000A", "050104FF00", "0301E80001", "010104000A"],
    }
    assert asked[: len(whole[device.name])] == whole[device.name]
    assert wired.exchange.checks.is_armed
    wired.run(3.0)
    assert wired.state is State.HOLDING, "any question feeds it"


def test_silence_trips_it_and_a_reset_brings_the_force_back(device: DeviceProfile) -> None:
    wired = wired_to(device).pressing(12.0)
    wired.stall(0.05)
    wired.is_plugged = False
    wired.run(1.5)
    assert wired.world._output.is_tripped  # type: ignore[attr-defined]
    assert wired.twin.pressure_pa < 1e5, "the device itself has let go"
    wired.is_plugged = True
    wired.run(1.5)  # within a second it is looked at, although it refuses each voltage with an exception
    told = FaultCode.WATCHDOG_TRIPPED if device.name == "timed-apart" else FaultCode.NONE
    assert wired.exchange.fault is told
    wired.write(0, RESET)
    wired.until(lambda: wired.exchange.checks.is_armed, 1.5)
    wired.pressing(8.0)
    assert wired.world._output.watchdog.state is WatchdogState.ARMED  # type: ignore[attr-defined]


def test_it_is_switched_off_at_an_orderly_end(device: DeviceProfile) -> None:
    wired = wired_to(device).pressing(12.0)
    off = {"one-register": "0600080000", "timed-apart": "0501040000"}[device.name]
    assert wired.exchange._host.last_frame[1:6].hex().upper() == off


def test_one_whose_coil_alone_is_read_back_is_armed_as_well(tmp_path: Path) -> None:
    """As the page of profiles says it."""
    apart = TIMED_APART[: TIMED_APART.index("  verify:")]
    apart += '  status: {ask: "0101040001", answer: "0101{state:00|01}", words: {"00": "off", "01": armed}}\n'
    wired = wired_to(load(tmp_path, "coil-alone", apart)).pressing(12.0)
    wired.run(1.5)
    assert wired.exchange.checks.is_armed and wired.state is State.HOLDING


def test_a_time_that_is_read_back_does_not_say_that_the_watchdog_is_on(tmp_path: Path) -> None:
    """A module that takes the time, answers the switch and stays off: its coil says so."""
    device = load(tmp_path, "timed-apart", TIMED_APART)
    wired = wired_to(device)
    watchdog = wired.world._output.watchdog  # type: ignore[attr-defined]
    obey = watchdog.do
    watchdog.do = lambda step, ticks, now_s: None if step is DeviceStep.ARM else obey(step, ticks, now_s)
    wired.run(2.0)
    assert not wired.exchange.checks.is_armed
    assert "A334" in str(wired.exchange.checks.fault.code)


@pytest.mark.parametrize(
    ("watchdog", "reason"),
    [
        (TIMED_APART[: TIMED_APART.index("  status:")], "needs status: the time alone does not say that it watches"),
        (ONE_REGISTER.replace("06000803E8", "").replace("{time:04X}", "{time:s}"), "such as {time:04X}"),
        (ONE_REGISTER.replace("time_s: 1.0", "time_s: 60.0").replace("0.001", "0.0005"), "has room for 65535"),
    ],
)
def test_what_does_not_make_a_watchdog_is_told(watchdog: str, reason: str, tmp_path: Path) -> None:
    with pytest.raises(ProfileError) as refused:
        load(tmp_path, "device", watchdog)
    assert reason in str(refused.value)


def test_an_armed_one_is_looked_at_again(device: DeviceProfile) -> None:
    """Its power was off for a moment: it has forgotten, and nothing else would tell."""
    wired = wired_to(device).pressing(12.0)
    watchdog = wired.world._output.watchdog  # type: ignore[attr-defined]
    watchdog.state, watchdog.ticks = WatchdogState.OFF, 0
    wired.until(lambda: watchdog.state is WatchdogState.ARMED, 1.5)
    wired.run(0.5)
    assert wired.state is State.HOLDING and wired.exchange.checks.is_armed
    assert AskDevice(DeviceStep.ARM) != wired.exchange._in_flight


@pytest.mark.parametrize("step", [DeviceStep.SET_TIME, DeviceStep.ARM])
def test_what_the_device_refuses_three_times_is_told_in_its_words(step: DeviceStep, tmp_path: Path) -> None:
    checks = DeviceChecks(output_host(load(tmp_path, "timed-apart", TIMED_APART)), is_waived=False)
    for _ in range(20):
        if (asked := checks.next_step(0.0)) is step:
            checks.refuse(step, "exception 3 (illegal data value)")
        elif asked:
            checks.take(DeviceAnswer(asked, is_right=True, text="off" if asked is DeviceStep.STATUS else ""))
    assert (checks.fault, checks.said) == (FaultCode.WATCHDOG_NOT_ARMED, "exception 3 (illegal data value)")


def test_a_trip_of_before_the_start_is_told_and_cleared_although_each_voltage_is_refused(tmp_path: Path) -> None:
    wired = wired_to(load(tmp_path, "timed-apart", TIMED_APART))
    wired.world._output.watchdog.state = WatchdogState.TRIPPED  # type: ignore[attr-defined]
    wired.run(1.0)
    assert wired.exchange.fault is FaultCode.WATCHDOG_TRIPPED
    wired.write(0, RESET)
    wired.until(lambda: wired.exchange.checks.is_armed, 1.0)
    wired.pressing(12.0)
