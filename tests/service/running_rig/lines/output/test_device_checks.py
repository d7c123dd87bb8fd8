"""What is asked of an output device before it may do more than the safe voltage: how often a watchdog may fail to arm."""

from dataclasses import replace

import pytest

from gateway.codes.faults import FaultCode
from gateway.devices import output_host
from gateway.devices.messages import DeviceAnswer, DeviceStep
from gateway.service.running_rig.lines.device_checks import DeviceChecks
from gateway.service.running_rig.lines.output_line import OutputExchange
from tests.profile_files import load_device

MOST_TRIES = 3
IDENTITY, STATUS, CLEAR, ARM, VERIFY = (
    DeviceStep.IDENTITY,
    DeviceStep.STATUS,
    DeviceStep.CLEAR,
    DeviceStep.ARM,
    DeviceStep.VERIFY,
)


def checks_of(name: str) -> DeviceChecks:
    return DeviceChecks(output_host(load_device(name)), is_waived=False)


def arm(checks: DeviceChecks, *, fails: int = 0) -> None:
    """Answer what is asked, until the watchdog is armed or nothing is asked any more; its first readings deny it."""
    for _ in range(20):
        if checks.is_done or (step := checks.next_step(0.0)) is None:
            return
        is_denied = step is DeviceStep.VERIFY and fails > 0
        fails -= is_denied
        checks.take(DeviceAnswer(step, is_right=not is_denied, text="off" if step is DeviceStep.STATUS else ""))
    raise AssertionError("it asks for ever")


@pytest.mark.parametrize("fails", range(MOST_TRIES + 1))
def test_a_watchdog_may_fail_to_arm_twice_and_not_three_times(fails: int) -> None:
    checks = checks_of("icpdas-702x")
    arm(checks, fails=fails)
    expected = FaultCode.NONE if fails < MOST_TRIES else FaultCode.WATCHDOG_NOT_ARMED
    assert (checks.fault, checks.is_armed) == (expected, fails < MOST_TRIES)


def test_a_device_s_words_are_told_with_the_fault_that_they_were_said_of_and_no_longer() -> None:
    checks = checks_of("icpdas-702x")
    output = OutputExchange(output_host(load_device("icpdas-702x")), lambda _: None, 0.06, checks)
    arm(checks, fails=MOST_TRIES)
    assert (output.fault, output.said) == (FaultCode.WATCHDOG_NOT_ARMED, checks.said) and output.said
    output.clear_faults()
    arm(checks)
    assert (output.fault, output.said) == (FaultCode.NONE, "")


def test_what_failed_before_it_was_armed_does_not_count_when_it_has_to_be_armed_again() -> None:
    """A device that tells no more than its state is armed anew where that says `off`, however often it has worked before."""
    profile = load_device("icpdas-702x")
    watchdog = profile.own_watchdog
    assert watchdog
    checks = DeviceChecks(output_host(replace(profile, watchdog=replace(watchdog, verify=None))), is_waived=False)
    states = iter(["off", *3 * ["off", "off", "armed"]])  # before it is armed at all; then as often as is allowed
    for now_s in range(20):
        if step := checks.next_step(float(now_s)):
            text = next(states, "armed") if step is DeviceStep.STATUS else ""
            checks.take(DeviceAnswer(step, is_right=True, text=text))
        assert checks.fault is FaultCode.NONE
    assert next(states, None) is None
    assert checks.is_armed


def test_a_reset_gives_a_watchdog_that_has_tripped_all_its_tries() -> None:
    checks = checks_of("icpdas-702x")
    for step in (DeviceStep.IDENTITY, DeviceStep.STATUS):
        checks.take(DeviceAnswer(step, is_right=True, text="off" if step is DeviceStep.STATUS else ""))
    for _ in range(MOST_TRIES - 1):
        checks.take(DeviceAnswer(DeviceStep.ARM, is_right=True))
        checks.take(DeviceAnswer(DeviceStep.VERIFY, is_right=False))
    checks.trip()
    checks.clear()
    arm(checks, fails=MOST_TRIES - 1)
    assert checks.is_armed


def test_a_clearing_that_is_refused_leaves_the_watchdog_tripped() -> None:
    checks = checks_of("icpdas-702x")
    arm(checks)
    checks.trip()
    checks.clear()
    assert checks.next_step(0.0) is DeviceStep.CLEAR
    checks.refuse(DeviceStep.CLEAR, "no")
    assert (checks.fault, checks.is_tripped, checks.next_step(0.0)) == (
        FaultCode.WATCHDOG_TRIPPED,
        True,
        DeviceStep.STATUS,
    )


def state(checks: DeviceChecks, text: str, now_s: float) -> FaultCode:
    assert checks.next_step(now_s) is DeviceStep.STATUS
    checks.take(DeviceAnswer(DeviceStep.STATUS, is_right=text == "armed", text=text))
    return checks.fault


def test_a_trip_is_believed_when_it_is_said_twice_and_asked_again_at_once() -> None:
    """`!0184` is a spoiled digit away from `!0180`: an armed one."""
    checks = checks_of("icpdas-7024")
    arm(checks)
    assert [state(checks, text, 10.0) for text in ("tripped", "armed")] == 2 * [FaultCode.NONE]
    assert checks.is_done and checks.next_step(10.5) is None
    assert state(checks, "tripped", 12.0) is FaultCode.NONE
    assert state(checks, "tripped", 12.0) is FaultCode.WATCHDOG_TRIPPED


def test_behind_a_reset_a_trip_is_asked_for_twice_again() -> None:
    checks = checks_of("icpdas-7024")
    arm(checks)
    assert [state(checks, "tripped", 10.0) for _ in range(2)][1] is FaultCode.WATCHDOG_TRIPPED
    checks.clear()
    checks.take(DeviceAnswer(CLEAR, is_right=True))
    assert [state(checks, text, 11.0) for text in ("tripped", "off")] == 2 * [FaultCode.NONE]
    arm(checks)
    assert checks.is_armed and checks.is_done


def test_before_it_is_armed_a_trip_is_asked_for_twice_too() -> None:
    checks = checks_of("icpdas-7024")
    checks.take(DeviceAnswer(DeviceStep.IDENTITY, is_right=True))
    assert state(checks, "tripped", 0.0) is FaultCode.NONE
    assert not checks.is_done
    assert state(checks, "tripped", 0.0) is FaultCode.WATCHDOG_TRIPPED


def test_a_trip_that_no_word_clears_ends_with_the_reset() -> None:
    """Such a device obeys the next setting."""
    profile = load_device("icpdas-702x")
    watchdog = profile.own_watchdog
    assert watchdog
    checks = DeviceChecks(output_host(replace(profile, watchdog=replace(watchdog, clear=None))), is_waived=False)
    arm(checks)
    checks.trip()
    checks.clear()
    assert (checks.is_tripped, checks.fault, checks.is_done) == (False, FaultCode.NONE, False)
    arm(checks)
    assert checks.is_armed and checks.is_done


def test_a_setting_of_before_the_reset_does_not_undo_it() -> None:
    """Its answer says `tripped` when the clearing waits for the wire."""
    checks = checks_of("icpdas-702x")
    arm(checks)
    checks.trip()
    checks.clear()
    checks.trip()
    assert (checks.fault, checks.next_step(0.0)) == (FaultCode.NONE, DeviceStep.CLEAR)


def test_another_device_is_asked_nothing_more_until_somebody_resets() -> None:
    checks = checks_of("icpdas-702x")
    checks.take(DeviceAnswer(DeviceStep.IDENTITY, is_right=False, text="a lamp"))
    assert checks.fault is FaultCode.WRONG_DEVICE
    assert [checks.next_step(float(now_s)) for now_s in range(10)] == [None] * 10


def test_a_trip_is_not_armed_not_done_and_ends_whatever_waited() -> None:
    """It may be said in place of any answer: of an armed one, and of one that is about to be armed."""
    checks = checks_of("icpdas-702x")
    arm(checks)
    checks.trip()
    assert (checks.is_armed, checks.is_tripped, checks.is_done) == (False, True, False)
    checks.take(DeviceAnswer(VERIFY, is_right=True))
    assert checks.fault is FaultCode.WATCHDOG_TRIPPED, "its time reads back as before"
    checks.begin()
    checks.take(DeviceAnswer(IDENTITY, is_right=True))
    checks.take(DeviceAnswer(STATUS, is_right=False, text="off"))
    assert checks.next_step(0.0) is ARM
    checks.trip()
    assert checks.next_step(10.0) is STATUS, "nothing is armed before somebody has cleared it"


def test_a_reset_clears_looks_whether_it_is_cleared_and_arms() -> None:
    checks = checks_of("icpdas-702x")
    arm(checks)
    checks.trip()
    checks.clear()
    asked = []
    while not checks.is_done:
        step = checks.next_step(0.0)
        assert step is not None
        asked.append(step)
        assert checks.is_tripped is (step is CLEAR)
        checks.take(DeviceAnswer(step, is_right=True, text="off" if step is STATUS else ""))
    assert asked == [CLEAR, STATUS, ARM, VERIFY]


def test_what_a_device_has_said_before_the_reset_is_no_half_of_a_trip_behind_it() -> None:
    """The answer to a question of before is on its way; behind the clearing one spoiled digit says it once more."""
    checks = checks_of("icpdas-702x")
    arm(checks)
    checks.trip()
    checks.clear()
    checks.take(DeviceAnswer(STATUS, is_right=False, text="tripped"))
    checks.take(DeviceAnswer(CLEAR, is_right=True))
    assert state(checks, "tripped", 0.0) is FaultCode.NONE
    assert state(checks, "off", 0.0) is FaultCode.NONE
    arm(checks)
    assert checks.is_armed


def test_a_failed_arming_is_tried_from_its_beginning() -> None:
    checks = checks_of("icpdas-702x")
    checks.take(DeviceAnswer(IDENTITY, is_right=True))
    checks.take(DeviceAnswer(STATUS, is_right=False, text="off"))
    for _ in range(MOST_TRIES - 1):
        assert checks.next_step(0.0) is ARM
        checks.take(DeviceAnswer(ARM, is_right=True))
        assert checks.next_step(0.0) is VERIFY
        checks.take(DeviceAnswer(VERIFY, is_right=False))
    assert checks.next_step(0.0) is ARM


@pytest.mark.parametrize("refused", [ARM, VERIFY])
def test_a_watchdog_that_refuses_does_not_arm_in_its_own_words_until_a_reset(refused: DeviceStep) -> None:
    checks = checks_of("icpdas-702x")
    for _ in range(20):
        step = checks.next_step(0.0)
        if step is None:
            break
        if step is refused:
            checks.refuse(step, "NOT NOW")
        else:
            checks.take(DeviceAnswer(step, is_right=step is not STATUS, text="off" if step is STATUS else ""))
    assert (checks.fault, checks.said, checks.is_armed) == (FaultCode.WATCHDOG_NOT_ARMED, "NOT NOW", False)
    checks.clear()
    arm(checks)
    assert checks.is_armed and checks.is_done


def test_who_refuses_to_say_what_it_is_is_another_device() -> None:
    checks = checks_of("icpdas-702x")
    checks.refuse(IDENTITY, "WHAT?")
    assert (checks.fault, checks.said) == (FaultCode.WRONG_DEVICE, "WHAT?")
    assert checks.next_step(10.0) is None


def test_a_refusal_on_the_wire_answers_the_question_that_was_refused() -> None:
    """Else it would be asked for ever, and nobody told why the output does not come."""
    written: list[bytes] = []
    exchange = OutputExchange(output_host(load_device("icpdas-702x")), written.append, 0.1)
    for now_s in (1.0, 1.01, 1.02, 1.03):
        exchange.set_voltage(0.0, now_s)
        answer = {b"#": b">\r", b"$": b"?01\r"}.get(written[-1][:1])
        if answer:
            exchange.on_bytes(answer, now_s + 0.005)
    assert b"$01M\r" in written
    assert exchange.fault is FaultCode.WRONG_DEVICE


def known_by_its_state() -> DeviceChecks:
    """A device whose arming is read back as its state alone; armed."""
    profile = load_device("icpdas-702x")
    watchdog = profile.own_watchdog
    assert watchdog
    checks = DeviceChecks(output_host(replace(profile, watchdog=replace(watchdog, verify=None))), is_waived=False)
    for step, text in ((IDENTITY, ""), (STATUS, "off"), (ARM, ""), (STATUS, "armed")):
        assert checks.next_step(0.0) is step
        checks.take(DeviceAnswer(step, is_right=True, text=text))
    assert checks.is_armed and checks.is_done
    return checks


def test_a_watchdog_that_says_that_it_is_off_is_not_armed_any_more_and_is_armed_anew() -> None:
    """Somebody has pulled its plug: it stands at its safe value, and would watch nobody."""
    checks = known_by_its_state()
    assert state(checks, "off", 10.0) is FaultCode.NONE
    assert (checks.is_armed, checks.is_done, checks.next_step(10.0)) == (False, False, ARM)


def test_a_trip_does_not_end_by_one_reading_that_says_armed() -> None:
    """Only a reset ends it: the reading may be spoiled, and the device obeys nothing."""
    checks = known_by_its_state()
    checks.trip()
    assert state(checks, "armed", 10.0) is FaultCode.WATCHDOG_TRIPPED
    assert (checks.is_armed, checks.is_tripped) == (False, True)


def test_of_a_device_before_the_port_was_opened_again_nothing_counts_against_the_next() -> None:
    """Not its failures to arm, not the first half of its trip, not when it was looked at."""
    checks = checks_of("icpdas-7024")
    fresh = {name: repr(value) for name, value in vars(checks).items()}
    arm(checks)
    state(checks, "tripped", 10.0)
    for _ in range(MOST_TRIES - 1):
        checks.refuse(ARM, "NOT NOW")
    checks.begin()
    assert {name: repr(value) for name, value in vars(checks).items()} == fresh
    checks.take(DeviceAnswer(IDENTITY, is_right=True))
    assert state(checks, "tripped", 20.0) is FaultCode.NONE
