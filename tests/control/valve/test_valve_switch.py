"""The switch of the valve by itself: what it takes for a fault, and what it does not."""

from itertools import pairwise

import pytest

from gateway.codes.faults import FaultCode
from gateway.control.inputs import ValveStatus
from gateway.control.settings import SafeDirection, ValveControl
from gateway.control.supervision.fault_detection import stop_cause
from gateway.control.valve.valve_switch import ValveSwitch
from gateway.devices.valve_profile import ValveDirection

PUSH, PULL = ValveDirection
SETTINGS = ValveControl(pull_area_share=0.75, timeout_s=0.5)


@pytest.mark.parametrize(("stands", "fault"), [(None, None), (PUSH, None), (PULL, FaultCode.VALVE_ALTERED)])
def test_only_what_the_relay_has_read_back_can_differ(stands: ValveDirection | None, fault: FaultCode | None) -> None:
    """Before its first words nobody knows where it stands: that keeps an enable back (W308), and is no fault of the valve."""
    switch = ValveSwitch(SETTINGS)
    for k in range(100):
        switch.step(0.01 * k, PUSH, ValveStatus(stands), is_vented=True)
    cause = switch.first_cause(1.0)
    assert (cause and cause.fault) == fault


def test_a_readback_that_is_wrong_for_less_than_the_bound_is_none_of_its_faults_however_long_ago_it_was_told() -> None:
    switch, faults = ValveSwitch(SETTINGS), []
    for k in range(900):
        differs = 300 <= k < 340 or k >= 600
        switch.step(0.01 * k, PUSH, ValveStatus(PULL if differs else PUSH), is_vented=False)
        faults.append(switch.first_cause(0.01 * k) is not None)
    assert faults.index(True) == pytest.approx(650, abs=2) and all(faults[652:])


def test_a_valve_that_is_told_to_and_fro_has_its_time_for_each_word() -> None:
    """Two masters enabled and disabled in turn, on a rig whose valve rests at pull: it follows each word 0.08 s later, and was
    blamed for standing elsewhere since 0.5 s (W308, A356). Once the last word has stood for so long, it is blamed."""
    switch, faults = ValveSwitch(ValveControl(pull_area_share=0.75, dwell_s=0.0, timeout_s=0.5)), []
    told: list[ValveDirection] = []
    for k in range(400):
        wanted = PUSH if k >= 300 or k // 8 % 2 else PULL
        told.append(switch.commanded or PUSH)
        stands = PULL if k >= 300 else told[max(0, k - 7)]
        switch.step(0.01 * k, wanted, ValveStatus(stands), is_vented=True)
        faults.append(switch.first_cause(0.01 * k) is not None)
    assert faults.index(True) == pytest.approx(296 + 50, abs=2)


def test_a_bit_that_flickers_moves_a_valve_at_rest_no_oftener_than_its_dwell() -> None:
    """The dwell was kept to the venting alone: a valve that was vented long ago was turned at each write of the bit."""
    switch, told_at = ValveSwitch(ValveControl(pull_area_share=0.75, dwell_s=0.25, timeout_s=0.5)), []
    for k in range(200):
        before = switch.commanded
        stands = switch.commanded or PUSH
        switch.step(0.01 * k, PULL if k // 2 % 2 else PUSH, ValveStatus(stands), is_vented=True)
        if switch.commanded is not before:
            told_at.append(0.01 * k)
    apart_s = [after_s - before_s for before_s, after_s in pairwise(told_at)]
    assert len(told_at) > 3 and min(apart_s) >= 0.25


@pytest.mark.parametrize(
    ("safe", "waits"), [(SafeDirection.PUSH, True), (SafeDirection.PULL, False), (SafeDirection.KEEP, False)]
)
def test_a_pulling_valve_is_waited_for_only_where_the_rig_has_it_rest_elsewhere(
    safe: SafeDirection, waits: bool
) -> None:
    switch = ValveSwitch(ValveControl(pull_area_share=0.75, dwell_s=0.0, safe=safe))
    for k in range(5):
        switch.step(0.01 * k, PULL, ValveStatus(PULL), is_vented=True)
    assert switch.is_pulling and switch.is_going_to_rest is waits


@pytest.mark.parametrize("reads_back_s", [0.0625, 0.1875, 0.375])
def test_each_time_of_a_switch_is_kept_to_the_step(reads_back_s: float) -> None:
    """Without pressure for the dwell, then told; read back for the dwell, in effect. The second dwell was counted from the
    order: a valve that took as long to come had its pressure with its readback."""
    switch = ValveSwitch(ValveControl(pull_area_share=0.75, dwell_s=0.25, timeout_s=0.5))
    told_at, turned_at = [], []
    for k in range(20):
        now_s = 0.0625 * k
        stands = PULL if told_at and now_s - told_at[0] >= reads_back_s else PUSH
        if switch.step(now_s, PULL, ValveStatus(stands), is_vented=True):
            turned_at.append(now_s)
        if switch.commanded is PULL:
            told_at.append(now_s)
    assert (told_at[0], turned_at) == (0.25, [0.25 + reads_back_s + 0.25])


@pytest.mark.parametrize("status", [ValveStatus(PULL), ValveStatus(PUSH, unanswered_since_s=0.0)])
def test_a_fault_of_the_valve_is_one_behind_its_bound_and_not_at_it(status: ValveStatus) -> None:
    switch = ValveSwitch(SETTINGS)
    for k in range(9):
        switch.step(0.0625 * k, PUSH, status, is_vented=True)
    assert switch.first_cause(0.5) is None and switch.first_cause(0.5625) is not None


@pytest.mark.parametrize(
    ("status", "words"),
    [
        (ValveStatus(PULL), "told push, for 562 ms, allowed 500 ms"),
        (
            ValveStatus(PULL, said="exception 2"),
            "told push, for 562 ms, allowed 500 ms: it says exception 2; address, channel or profile",
        ),
        (ValveStatus(PUSH, 0.0), "allowed 500 ms: power or wires"),
        (
            ValveStatus(PUSH, 0.0, said='"ERR 7"'),
            'allowed 500 ms: it says "ERR 7"; address, channel or profile of the relay?',
        ),
    ],
)
def test_what_the_relay_says_instead_is_quoted_and_no_wire_blamed_for_it(status: ValveStatus, words: str) -> None:
    switch = ValveSwitch(SETTINGS)
    for k in range(9):
        switch.step(0.0625 * k, PUSH, status, is_vented=True)
    cause = switch.first_cause(0.5625)
    assert cause and words in cause.sentence and ("wires" in words) == ("wires" in cause.sentence)


def test_what_others_have_found_goes_before_a_fault_of_the_valve() -> None:
    switch = ValveSwitch(SETTINGS)
    switch.step(0.0, PUSH, ValveStatus(PUSH, lost=True), is_vented=True)
    alone, lost = switch.blame(0.0, None), stop_cause(FaultCode.CELL_LOST, "its plug")
    assert alone and alone.fault is FaultCode.VALVE_SILENT
    assert switch.blame(0.0, lost) == lost


@pytest.mark.parametrize("stands", [PUSH, PULL])
def test_a_force_that_goes_the_wrong_way_may_be_a_valve_whose_relay_alone_has_moved(stands: ValveDirection) -> None:
    """Who exchanged the cell's wires for a coil without power had two faults, and a push that was wrong, too."""
    switch = ValveSwitch(SETTINGS)
    for k in range(9):
        switch.step(0.0625 * k, stands, ValveStatus(stands), is_vented=True)
    cause = switch.blame(0.5, stop_cause(FaultCode.SIGN_INVERTED, "swap the wires"))
    assert cause and cause.fault is FaultCode.SIGN_INVERTED
    assert f"swap the wires; or the valve stands elsewhere than its relay reads back ({stands})" in cause.sentence


def test_how_long_it_stands_elsewhere_is_told_as_it_is() -> None:
    """An hour later it was still told to have been told half a second ago."""
    switch = ValveSwitch(SETTINGS)
    for k in range(9):
        switch.step(0.0625 * k, PUSH, ValveStatus(PULL), is_vented=True)
    cause = switch.first_cause(3600.0)
    assert cause and "told push, for 3600000 ms, allowed 500 ms" in cause.sentence
