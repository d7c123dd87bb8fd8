"""Bit 6 as a robot uses it: write it, poll the registers, read a verdict per item; and every answer that is no."""

from dataclasses import replace

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.control.settings import SelfTestSettings
from gateway.processes.event_log import EventLog
from gateway.registers.words import SelfTestResult, SelfTestVerdict, State
from tests.control.bench import settings
from tests.service.running_rig.simulated_rig import CALIBRATE, ENABLE, MAP, OTHER, SELF_TEST, SmallRig

ITEMS = ("noise", "resolution", "zero", "sign", "scale", "response", "leak", "output_line", "cell_line")
R, PASSED, NOT_TESTED = RefusalReason, SelfTestVerdict.PASSED, SelfTestVerdict.NOT_TESTED


def rig(force_n: float = 25.0, **plant: float) -> SmallRig:
    return SmallRig(replace(settings(), self_test=SelfTestSettings(force_n=force_n)), **plant)


def verdicts(one: SmallRig) -> dict[str, int]:
    return {item: one.word(f"self_test_{item}") for item in ITEMS}


def test_a_robot_writes_bit_6_and_polls_one_block() -> None:
    one = rig()
    assert one.word("self_test_result") == SelfTestResult.NONE and one.word("self_test_count") == 0
    one.write(0, SELF_TEST)
    one.run(0.1)
    assert one.state is State.CALIBRATING and one.word("self_test_result") == SelfTestResult.RUNNING
    assert one.word("self_test_count") == 1 and one.word("calibration_time_left") > 5
    one.until(State.OFF, 20.0)
    assert one.word("self_test_result") == SelfTestResult.PASSED, one.log
    # this rig has no counts of its own on the output's line
    assert verdicts(one) == dict.fromkeys(ITEMS, PASSED) | {"output_line": NOT_TESTED}
    assert one.word("control_word") == 0 and one.wire.voltage_v == 0.0
    assert max(force_n for _, _, force_n in one.trace) < 25.0
    assert [line for line in one.log if line.startswith("self-test noise passed: ")]


def test_the_log_has_room_for_all_that_a_self_test_says_and_what_comes_right_behind_it() -> None:
    """Its result and its end were left out of each, and so was the fault of an enable in the same second."""
    told: list[str] = []

    class LoggedRig(SmallRig):
        def note(self, cause: str, sentence: str) -> None:
            super().note(cause, sentence)
            log(cause, sentence)

    with EventLog(told.append, clock=lambda: one.now()) as log:
        one = LoggedRig(replace(settings(), self_test=SelfTestSettings(force_n=25.0)))
        one.write(0, SELF_TEST)
        one.until(State.OFF, 20.0)
        one.write(0, ENABLE, 1000)
        one.run(0.2)
        one.is_cell_silent = True
        one.until(State.FAULT, 1.0)
    lost = [line for line in one.log if not any(line in shown for shown in told)]
    assert lost == [] and any("self-test 1 passed: " in line for line in told)


def test_a_failed_item_is_a_number_in_its_register_and_a_line_with_a_code() -> None:
    one = rig(sign=-1.0)
    one.write(0, SELF_TEST)
    one.until(State.OFF, 20.0)
    assert one.word("self_test_result") == SelfTestResult.FAILED
    assert verdicts(one)["sign"] == SelfTestVerdict.FAILED
    assert any(line.startswith("A354 self-test sign failed: ") for line in one.log)


def test_the_registers_of_a_self_test_are_read_only() -> None:
    one = rig()
    refusal = one.answer(MAP.find("self_test_result").address, 0)
    assert refusal and (refusal.reason, refusal.code) == (R.READ_ONLY, 2)


@pytest.mark.parametrize(
    ("frame", "reason", "code"),
    [
        ((0, ENABLE | SELF_TEST), R.SELF_TEST_REFUSED, 4),
        ((0, SELF_TEST), R.SELF_TEST_REFUSED, 4),
    ],
)
def test_it_is_refused_while_a_force_is_held_and_the_force_stays(frame: tuple[int, ...], reason: R, code: int) -> None:
    one = rig().holding()
    refusal = one.answer(*frame)
    assert refusal and (refusal.reason, refusal.code) == (reason, code)
    assert "self-test refused: state HOLDING, it begins from OFF" in refusal.sentence
    one.run(1.0)
    assert one.state is State.HOLDING


def test_it_is_refused_with_a_setpoint_and_beside_a_calibration() -> None:
    one = rig()
    refused = one.answer(0, SELF_TEST, 1000)
    assert refused and refused.reason is R.SELF_TEST_REFUSED and "setpoint is 10.00 N" in refused.sentence
    both = one.answer(0, SELF_TEST | CALIBRATE)
    assert both and both.reason is R.SELF_TEST_REFUSED and "one at a time" in both.sentence
    assert one.state is State.OFF


def test_a_rig_without_one_refuses_the_bit() -> None:
    refusal = SmallRig(settings()).answer(0, SELF_TEST)
    assert refusal and (refusal.reason, refusal.code) == (R.UNSUPPORTED_BIT, 3)


def test_other_commands_are_busy_meanwhile_and_anybody_may_end_it() -> None:
    one = rig()
    one.write(0, SELF_TEST)
    one.run(4.5)
    busy = one.answer(1, 1200)
    assert busy and (busy.reason, busy.code) == (R.CALIBRATING, 6) and "a self-test (" in busy.sentence
    one.write(0, 0, peer=OTHER)
    one.until(State.OFF)
    assert one.word("self_test_result") == SelfTestResult.STOPPED
    assert verdicts(one)["leak"] == NOT_TESTED and verdicts(one)["noise"] == PASSED


def test_a_master_that_holds_bit_6_in_its_cycle_tests_once() -> None:
    one = rig(force_n=0.0)
    one.write(*(0, *one.block(SELF_TEST)))
    for _ in range(50):
        one.run(0.1)
        one.answer(0, *one.block(SELF_TEST))
    assert one.word("self_test_count") == 1 and one.state is State.OFF
    held = one.answer(0, *one.block(SELF_TEST))
    assert held and held.reason is R.CALIBRATION_HELD and "start_self_test was kept at 1" in held.sentence
    one.write(*(0, *one.block(0)))
    one.write(*(0, *one.block(SELF_TEST)))
    assert one.run(0.1).word("self_test_count") == 2
