"""The switch of the valve by itself: what it takes for a fault, and what it does not."""

import pytest

from gateway.codes.faults import FaultCode
from gateway.control.inputs import ValveStatus
from gateway.control.settings import ValveControl
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
