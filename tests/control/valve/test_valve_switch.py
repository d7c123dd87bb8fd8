"""The switch of the valve by itself: what it takes for a fault, and what it does not."""

import pytest

from gateway.codes.faults import FaultCode
from gateway.control.inputs import ValveStatus
from gateway.control.settings import SafeDirection, ValveControl
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
