"""Behind a force that was let go: what counts as the safe voltage standing, from when on it is asked for, and until when."""

from dataclasses import replace

import pytest

from gateway.codes.faults import FaultCode
from gateway.control import LineStatus
from gateway.control.supervision.fault_detection import FaultDetector
from gateway.control.supervision.safe_voltage import SafeVoltageCheck
from gateway.registers.words import State
from tests.control.bench import settings

BOUND_S = settings().supervision.output_timeout_s
SAFE_V = 0.5


def at_rest() -> SafeVoltageCheck:
    rig = settings()
    return SafeVoltageCheck(FaultDetector(replace(rig, limits=replace(rig.limits, safe_voltage_v=SAFE_V))))


def let_go() -> SafeVoltageCheck:
    """At 0 s, from a held force."""
    check = at_rest()
    assert check.cause(-1.0, State.HOLDING, LineStatus()) is None
    assert check.cause(0.0, State.OFF, LineStatus(sent_v=1.0)) is None
    return check


def fault_at(check: SafeVoltageCheck, later_s: float, line: LineStatus) -> FaultCode | None:
    cause = check.cause(later_s, State.OFF, line)
    return cause.fault if cause else None


def refusing(**line: float | None) -> LineStatus:
    return LineStatus(fault=FaultCode.OUTPUT_REFUSED, **line)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("stands_v", "is_safe"), [(0.5, True), (0.54, True), (0.46, True), (0.56, False), (0.44, False), (0.0, False)]
)
def test_only_what_stands_at_the_safe_voltage_is_no_longer_asked_for(stands_v: float, is_safe: bool) -> None:
    check = let_go()
    assert fault_at(check, 0.01, LineStatus(acknowledged_v=stands_v)) is None
    later = fault_at(check, 2.0 * BOUND_S, refusing(acknowledged_v=3.0))
    assert later is (None if is_safe else FaultCode.OUTPUT_REFUSED), "what is refused then keeps an enable back only"


def test_what_was_confirmed_before_the_setting_on_its_way_confirms_nothing() -> None:
    check = let_go()
    assert fault_at(check, 0.01, LineStatus(acknowledged_v=SAFE_V, sent_v=1.0)) is None
    assert fault_at(check, 2.0 * BOUND_S, refusing(acknowledged_v=SAFE_V, sent_v=1.0)) is FaultCode.OUTPUT_REFUSED
    check = let_go()
    assert fault_at(check, 0.01, LineStatus(acknowledged_v=1.0, sent_v=SAFE_V, standing_v=SAFE_V)) is None
    assert fault_at(check, 2.0 * BOUND_S, refusing(acknowledged_v=3.0)) is None


def test_a_start_has_let_nothing_go() -> None:
    check = at_rest()
    assert fault_at(check, 0.0, refusing()) is None
    assert fault_at(check, 2.0 * BOUND_S, refusing()) is None


def test_the_time_counts_from_each_way_to_off_and_only_there() -> None:
    check = let_go()
    assert fault_at(check, BOUND_S, refusing()) is None
    assert check.cause(5.0, State.HOLDING, refusing()) is None
    assert check.cause(6.0, State.OFF, refusing()) is None
    assert fault_at(check, 6.0 + 0.99 * BOUND_S, refusing()) is None
    assert fault_at(check, 6.0 + 1.01 * BOUND_S, refusing()) is FaultCode.OUTPUT_REFUSED


@pytest.mark.parametrize("fault", [FaultCode.OUTPUT_REFUSED, FaultCode.OUTPUT_ALTERED])
def test_a_device_that_puts_out_something_else_has_not_obeyed(fault: FaultCode) -> None:
    assert fault_at(let_go(), 2.0 * BOUND_S, LineStatus(fault=fault)) is fault


def test_a_port_that_went_away_needs_no_time_and_a_silence_its_own() -> None:
    assert fault_at(let_go(), 0.01, LineStatus(fault=FaultCode.OUTPUT_LOST)) is FaultCode.OUTPUT_LOST
    silent = LineStatus(sent_v=SAFE_V, unanswered_since_s=0.0)
    assert fault_at(let_go(), 0.99 * BOUND_S, silent) is None
    assert fault_at(let_go(), 1.01 * BOUND_S, silent) is FaultCode.OUTPUT_SILENT
    tripped = silent._replace(fault=FaultCode.WATCHDOG_TRIPPED)
    assert fault_at(let_go(), 1.01 * BOUND_S, tripped) is None, "its own watchdog has taken the voltage away"
