"""What is asked of an output device before it may do more than the safe voltage: how often a watchdog may fail to arm."""

from dataclasses import replace

import pytest

from gateway.codes.faults import FaultCode
from gateway.devices import output_host
from gateway.devices.messages import DeviceAnswer, DeviceStep
from gateway.service.running_rig.lines.device_checks import DeviceChecks
from tests.profile_files import load_device

MOST_TRIES = 3


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
