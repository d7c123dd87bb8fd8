"""What the valve refuses: to move under a latched fault, and to have a run begin while it moves."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from gateway.bsfm import Bsfm
from gateway.codes.refusals import RefusalReason
from gateway.control.inputs import CalibrationInUse, ValveStatus
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.control.settings import SafeDirection
from gateway.registers.words import ControlBit, State, StatusBit
from gateway.registers.writes.proposed_write import ProposedWrite
from tests.control.bench import bsfm
from tests.control.valve.valve_bench import BIT_4, ENABLE, PULL, PUSH, SHARE, ValveBench


def test_a_latched_fault_keeps_the_valve_unless_the_same_write_resets_it() -> None:
    bench = ValveBench().pulling()
    bench.cell_silent = True
    bench.run(1.0)
    bench.heal()
    bench.run(1.0)
    bench.write(control_word=BIT_4)
    assert bench.refused and bench.refused.reason is RefusalReason.VALVE_REFUSED
    assert bench.write(control_word=BIT_4 | ControlBit.RESET_FAULT).state is State.OFF
    assert bench.refused is None


def test_no_run_begins_before_the_valve_has_read_back() -> None:
    """Its ladder would press while the valve moves."""
    bench = ValveBench()
    bench.obeys = False
    bench.turn(PULL)
    bench.run(0.2)
    assert "is switching" in bench.controller.refusal_of_run(bench.now_s, CalibrationPlan())
    bench.obeys = True
    bench.run(1.0)
    assert bench.controller.refusal_of_run(bench.now_s, CalibrationPlan()) == ""


@pytest.mark.parametrize("reason", [RefusalReason.CALIBRATION_REFUSED, RefusalReason.SELF_TEST_REFUSED])
def test_where_the_valve_rests_pulling_the_cure_is_no_state_that_it_is_in_already(reason: RefusalReason) -> None:
    """`Write control_word 0, wait for state off, then ask again` was never taken, however often."""
    bench = ValveBench(safe=SafeDirection.PULL)
    bench.run(2.0)
    assert bench.last.state is State.OFF and bench.stands is PULL
    refused = bench.controller.refusal_of_run(bench.now_s, CalibrationPlan())
    assert "`force-gateway hold 0`" in refused and "hold 0" in reason.explanation.do
    bench.write(control_word=ENABLE)
    bench.run(2.0)
    assert bench.controller.refusal_of_run(bench.now_s, CalibrationPlan()) == ""


@pytest.mark.parametrize("run", [ControlBit.START_CALIBRATION, ControlBit.START_SELF_TEST])
@pytest.mark.parametrize("beside", [ControlBit(0), ControlBit.ENABLE])
def test_no_run_begins_in_the_write_that_turns_the_valve(run: ControlBit, beside: ControlBit) -> None:
    """The valve would turn under it, and what was measured pulling would be fitted as a model of pushing."""
    bench = ValveBench()
    bench.run(1.0)
    bench.write(control_word=run | BIT_4 | beside)
    assert bench.refused and "a run is made pushing" in bench.refused.text
    assert bench.run(2.0).state is State.OFF
    assert bench.stands is PUSH


def test_where_the_valves_port_is_lost_nothing_is_enabled_however_it_stood() -> None:
    bench = ValveBench()
    bench.run(1.0)
    line = bench.line._replace(valve=ValveStatus(bench.stands, None, lost=True))
    enable = bench.command._replace(control_word=ControlBit.ENABLE, number=bench.command.number + 1)
    refused = bench.controller.refusal_of(bench.now_s, ProposedWrite(enable, lambda: ()), line)
    assert refused and refused.reason is RefusalReason.VALVE_UNKNOWN


def silent(bench: ValveBench) -> None:
    bench.is_silent, bench.silent_s = True, bench.now_s


def stuck_elsewhere(bench: ValveBench) -> None:
    bench.obeys = False
    bench.turn(PULL)


@pytest.mark.parametrize(
    ("fails", "words"), [(silent, "A355 no answer"), (stuck_elsewhere, "A356 the valve reads back pull")]
)
def test_ready_is_not_said_and_no_enable_taken_where_the_valve_would_be_a_fault_at_once(
    fails: Callable[[ValveBench], None], words: str
) -> None:
    """While off as well: an enable that is taken and ends in a fault in the same moment was none."""
    bench = ValveBench(timeout_s=0.5)
    bench.run(2.0)
    assert bench.status() & StatusBit.READY
    fails(bench)
    bench.run(0.4)
    assert bench.status() & StatusBit.READY, "its time is not over yet"
    bench.run(0.3)
    assert not bench.status() & StatusBit.READY
    bench.enable(12.0)
    assert bench.refused and bench.refused.reason is RefusalReason.VALVE_UNKNOWN
    assert words in bench.refused.text
    bench.write(control_word=ControlBit.START_SELF_TEST)
    assert bench.refused and words in bench.refused.text
    bench.run(1.0)
    assert bench.last.state is State.OFF
    bench.is_silent, bench.obeys = False, True
    bench.run(1.0)
    bench.enable(12.0)
    bench.run(2.0)
    assert bench.refused is None and bench.last.state is State.HOLDING


@pytest.mark.parametrize("less", [replace(bsfm(), limits_n=(0.0, 32.0)), bsfm(0.56)], ids=["limits", "reach"])
def test_a_calibration_that_pulls_less_takes_no_heartbeat_from_the_master(less: Bsfm) -> None:
    """The setpoint that stands was good when it was written: refused with each beat, the lease would end for it."""
    bench = ValveBench().pulling(30.0)
    bench.controller.use(CalibrationInUse(less, 2))
    for beat in range(1, 20):
        bench.write(heartbeat=beat)
        bench.write(control_word=ENABLE | BIT_4, force_setpoint_n=30.0, heartbeat=100 + beat)
        assert bench.refused is None
    bench.write(force_setpoint_n=29.0)
    assert bench.refused and bench.refused.reason is RefusalReason.PULL_RANGE, "what is asked for anew is looked at"
    bench.write(control_word=ENABLE, force_setpoint_n=30.0)
    bench.write(control_word=ENABLE | BIT_4)
    assert bench.refused.reason is RefusalReason.PULL_RANGE


def test_a_pull_beyond_the_limits_of_a_calibration_is_refused_and_not_silently_a_smaller_one() -> None:
    bench = ValveBench()
    bench.controller.use(CalibrationInUse(replace(bsfm(), limits_n=(0.0, 32.0)), 2))
    bench.pulling(SHARE * 32.0 + 1.0)
    assert bench.refused and "pulling reaches 24.0 N" in bench.refused.text
    bench.pulling(SHARE * 32.0)
    assert bench.refused is None and bench.last.force_measured_n == pytest.approx(-SHARE * 32.0, abs=1.0)
