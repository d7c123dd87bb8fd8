"""Output devices that answer nothing, or cannot be asked for something: what the line does instead."""

from dataclasses import replace
from math import isnan

import pytest

from gateway.codes.faults import FaultCode
from gateway.devices import output_device, output_host
from gateway.devices.exchange import VoltageExchange, VoltageRange
from gateway.devices.messages import Accepted, AskDevice, DeviceAnswer, DeviceStep
from gateway.service.running_rig.lines.device_checks import DeviceChecks
from gateway.service.running_rig.lines.output_line import OutputExchange
from tests.profile_files import load_device
from tests.service.rigs import demo
from tests.service.running_rig.lines.output.played_output import REPLY_TIMEOUT_S, Wire
from tests.service.running_rig.lines.output.test_device_checks import MOST_TRIES, arm


def with_words(**words: object) -> Wire:
    """The regulator with other words: an acknowledgement without a number, no pressure, no reading."""
    wire = Wire()
    profile = replace(demo().output.device, **words)  # type: ignore[arg-type]
    wire.exchange = OutputExchange(output_host(profile), wire.written.append, REPLY_TIMEOUT_S)
    return wire


OBEYED = VoltageExchange(ask="SET {counts:d}", answer=">", range=demo().output.device.set_voltage.range)  # type: ignore[union-attr]
TELLS_NOTHING = replace(OBEYED, answer="")


def test_a_device_without_a_pressure_is_asked_for_its_setting() -> None:
    wire = with_words(read_pressure=None)
    wire.settle(512)
    wire.tick(0.2)
    assert wire.last == "REQ"
    wire.answer("512")
    assert wire.exchange.fault is FaultCode.NONE
    assert isnan(wire.exchange.pressure_pa)


def test_a_device_that_can_be_asked_nothing_is_told_its_setting_again() -> None:
    """So that it does not go unnoticed when it falls silent."""
    wire = with_words(read_pressure=None, read_voltage=None, set_voltage=OBEYED)
    wire.set_voltage(512)
    wire.answer(">")
    wire.tick(0.2)
    assert wire.written == [b"SET 512\r\n"] * 2
    wire.tick(0.05)
    assert wire.exchange.unanswered_since_s is not None


def test_a_setting_that_somebody_else_has_changed_is_set_anew_and_at_last_a_fault() -> None:
    wire = with_words(read_pressure=None)
    wire.settle(512)
    for _ in range(3):
        assert wire.exchange.fault is FaultCode.NONE
        while wire.last != "REQ":
            wire.tick(0.2)
        wire.answer("400")
        for _ in range(2):  # the first echo behind another voltage is asked for once more
            assert wire.last == "SET 512"
            wire.answer("512")
    assert wire.exchange.fault is FaultCode.OUTPUT_ALTERED, "its echo says one thing, its reading another"


def test_a_device_that_acknowledges_without_the_number_is_asked_for_both_in_turn() -> None:
    """One that clips a setting and says `done`, as function 16 of Modbus does, is seen though it tells its pressure."""
    wire = with_words(set_voltage=OBEYED)
    wire.set_voltage(512)
    wire.answer(">")
    asked = []
    while wire.exchange.fault is FaultCode.NONE and len(asked) < 40:
        wire.tick(0.2)
        asked.append(wire.last)
        wire.answer({"REQ": "400", "MON": "0"}.get(wire.last, ">"))
    assert wire.exchange.fault is FaultCode.OUTPUT_ALTERED
    assert {"REQ", "MON", "SET 512"} == set(asked)


def test_a_device_that_says_nothing_to_a_setting_is_read_back_in_the_same_breath() -> None:
    wire = with_words(read_pressure=None, set_voltage=TELLS_NOTHING)
    wire.set_voltage(512)
    assert wire.written == [b"SET 512\r\nREQ\r\n"]
    wire.answer("512")
    assert wire.exchange.acknowledged_v == pytest.approx(512 * 10 / 1023)
    wire.set_voltage(600)
    wire.answer("512")  # to a poll
    for _ in range(3):
        assert wire.exchange.fault is FaultCode.NONE
        wire.answer("512")
        wire.tick(REPLY_TIMEOUT_S + 0.001)  # it might have been the answer before, which came twice
    assert wire.exchange.fault is FaultCode.OUTPUT_ALTERED


def test_an_answer_that_counts_in_coarser_steps_confirms_and_is_not_asked_for_ever() -> None:
    fine = replace(
        OBEYED, ask="V {volts:.3f}", answer="{volts:.1f}", range=VoltageRange(device=(0, 10), voltage_v=(0, 10))
    )
    wire = with_words(read_pressure=None, read_voltage=None, set_voltage=fine)
    wire.exchange.set_voltage(1.234, wire.now_s)
    assert wire.last == "V 1.234"
    wire.answer("1.2")
    assert wire.exchange.fault is FaultCode.NONE
    wire.exchange.set_voltage(1.234, wire.now_s + 0.01)
    assert len(wire.written) == 1
    wire.exchange.set_voltage(1.240, wire.now_s + 0.02)
    assert wire.last == "V 1.240"


@pytest.mark.parametrize(("words", "told"), [("E 07", "it says 'E 07', no answer"), ("SET 512", ""), ("\x00\xff", "")])
def test_a_device_that_answers_in_other_words_is_quoted_until_it_answers(words: str, told: str) -> None:
    """Power and wires were blamed for a checksum that is switched on, or another format. Our own words an adapter says."""
    wire = with_words()
    wire.set_voltage(512)
    wire.answer(words)
    assert wire.exchange.said.startswith(told) and bool(wire.exchange.said) is bool(told)
    wire.tick(REPLY_TIMEOUT_S)
    assert bool(wire.exchange.said) is bool(told)
    wire.answer("512")
    assert wire.exchange.said == ""


@pytest.mark.parametrize("is_told", [True, False])
def test_a_trip_stays_until_a_reset_where_a_device_tells_of_its_watchdog_no_more_than_the_time(is_told: bool) -> None:
    """Which reads back as before, or not at all while it has tripped: neither is a word about the trip."""
    profile = load_device("icpdas-702x")
    watchdog = profile.own_watchdog
    assert watchdog
    terse = replace(profile, watchdog=replace(watchdog, status=None, refusal="?01"))
    checks = DeviceChecks(output_host(terse), is_waived=False)
    arm(checks)
    checks.trip()
    for now_s in range(10, 10 + 2 * MOST_TRIES):
        if step := checks.next_step(float(now_s)):
            checks.take(DeviceAnswer(step, is_right=True)) if is_told else checks.refuse(step, "TRIPPED")
        assert (checks.fault, checks.is_done) == (FaultCode.WATCHDOG_TRIPPED, False)
        assert (checks.is_armed, checks.is_tripped) == (False, True)
    checks.clear()
    arm(checks)
    assert checks.is_armed and checks.is_done


def line_to_old_firmware(unknown: tuple[bytes, ...], *, is_waived: bool = False, misses: int = 1000) -> OutputExchange:
    """The line to a DCON module after 4 s: to sentences that begin so it says nothing, as to all that it does not know, so many
    times; it answers the others."""
    profile, written = load_device("icpdas-702x"), list[bytes]()
    host, device = output_host(profile), output_device(profile)
    line = OutputExchange(host, written.append, REPLY_TIMEOUT_S, DeviceChecks(host, is_waived=is_waived))
    for step in range(400):
        now_s = 100.0 + 0.01 * step
        for said in [written.pop(0) for _ in range(len(written))]:
            if said.startswith(unknown) and misses > 0:
                misses -= 1
                continue
            for asked in device.receive(said, now_s):
                done = DeviceAnswer(asked.step, is_right=True) if isinstance(asked, AskDevice) else Accepted(0.0)
                line.on_bytes(device.reply(done, to=asked), now_s)
        line.set_voltage(0.0, now_s)
        line.tick(now_s)
    return line


@pytest.mark.parametrize(
    ("unknown", "step", "fault"),
    [
        (b"$01M", DeviceStep.IDENTITY, FaultCode.WRONG_DEVICE),
        (b"~013", DeviceStep.ARM, FaultCode.WATCHDOG_NOT_ARMED),
        (b"~012", DeviceStep.VERIFY, FaultCode.WATCHDOG_NOT_ARMED),
    ],
)
def test_a_device_that_answers_settings_and_not_this_question_is_told_as_such(
    unknown: bytes, step: DeviceStep, fault: FaultCode
) -> None:
    """It was asked for ever, and an enable refused with `not ready: wait`."""
    line = line_to_old_firmware((unknown,))
    assert (line.fault, line.confirmed_v) == (fault, None)
    assert line.said == f"nothing that the profile knows, asked for its {step}"


def test_a_rig_that_accepts_to_have_no_watchdog_runs_a_device_that_has_no_words_for_one() -> None:
    line = line_to_old_firmware((b"~01",), is_waived=True)
    assert (line.fault, line.confirmed_v) == (FaultCode.NONE, 0.0)
    assert not line.checks.is_armed


@pytest.mark.parametrize("unknown", [b"$01M", b"~013", b"~012"])
def test_an_answer_that_is_lost_a_few_times_is_asked_for_again(unknown: bytes) -> None:
    line = line_to_old_firmware((unknown,), misses=4)
    assert (line.fault, line.confirmed_v, line.checks.is_armed) == (FaultCode.NONE, 0.0, True)


@pytest.mark.parametrize("is_waived", [False, True])
def test_a_watchdog_whose_only_proof_is_refused_is_not_armed(is_waived: bool) -> None:
    """It counted as well: the output was enabled, and nobody had read the watchdog back."""
    profile = load_device("icpdas-702x")
    watchdog = profile.own_watchdog
    assert watchdog
    by_state = replace(profile, watchdog=replace(watchdog, verify=None))
    checks = DeviceChecks(output_host(by_state), is_waived=is_waived)
    for _ in range(20):
        if (step := checks.next_step(0.0)) is DeviceStep.STATUS:
            checks.refuse(step, "?01")
        elif step:
            checks.take(DeviceAnswer(step, is_right=True))
    assert (checks.is_armed, checks.is_done) == (False, is_waived)
    told = (FaultCode.NONE, "") if is_waived else (FaultCode.WATCHDOG_NOT_ARMED, "?01")
    assert (checks.fault, checks.said) == told


def test_a_watchdog_that_does_not_arm_keeps_nothing_where_the_rig_accepts_it_and_is_told() -> None:
    checks = DeviceChecks(output_host(load_device("icpdas-702x")), is_waived=True)
    arm(checks, fails=MOST_TRIES - 1)
    assert (checks.is_armed, checks.unarmed) == (True, "")
    checks.begin()
    arm(checks, fails=MOST_TRIES)
    assert checks.is_done and checks.fault is FaultCode.NONE
    assert (checks.is_armed, checks.unarmed) == (False, "it reads back otherwise")
    checks.begin()
    assert checks.unarmed == "", "another device may be behind the port"
