"""Bit 4: the force goes to 0, the valve is switched without pressure, its readback is awaited, and then the tool pulls."""

from dataclasses import replace
from random import Random

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.control.settings import SafeDirection
from gateway.control.valve.pull_model import scale_forces
from gateway.devices.messages import ForceSample
from gateway.devices.valve_profile import ValveDirection
from gateway.registers.words import State, StatusBit
from tests.control.bench import bsfm, has_fault
from tests.control.valve.valve_bench import BIT_4, ENABLE, MOVES_S, PULL, PUSH, SHARE, ValveBench


def test_the_tool_pulls_with_the_setpoint_and_shows_a_negative_force() -> None:
    bench = ValveBench().pulling(12.0)
    assert bench.stands is PULL and bench.last.state is State.HOLDING
    assert bench.last.force_measured_n == pytest.approx(-12.0, abs=1.0)
    assert bench.last.force_accepted_n == 12.0
    assert bench.status() & StatusBit.PULLING and not bench.status() & StatusBit.SWITCHING
    assert "the valve pulls" in bench.events


def test_under_force_it_goes_to_0_first_waits_and_switches_without_pressure() -> None:
    bench = ValveBench(dwell_s=0.3)
    bench.run(1.0)
    bench.enable(20.0)
    bench.run(2.0)
    assert bench.last.state is State.HOLDING
    began_s = bench.now_s
    bench.write(control_word=ENABLE | BIT_4)
    bench.run(0.02)
    assert bench.status() & StatusBit.SWITCHING and bench.last.voltage_v < 20.0 / 6.0
    bench.run(4.0)
    ((at_s, force_n, voltage_v),) = bench.switched
    assert voltage_v == 0.0 and force_n < 3.0, "no pressure, and no more force than friction keeps"
    vented_s = next(one.time_s for one in bench.history if one.time_s > began_s and one.output.voltage_v == 0.0)
    assert at_s - vented_s >= 0.3
    risen_s = next(one.time_s for one in bench.history if one.time_s > at_s and one.output.voltage_v > 0.0)
    assert risen_s - at_s >= 0.3 - MOVES_S
    assert bench.last.state is State.HOLDING and bench.last.force_measured_n == pytest.approx(-20.0, abs=1.0)


def test_clearing_bit_4_pushes_again_with_the_same_setpoint() -> None:
    bench = ValveBench().pulling(12.0)
    bench.write(control_word=ENABLE)
    bench.run(4.0)
    assert bench.stands is PUSH and bench.last.state is State.HOLDING
    assert bench.last.force_measured_n == pytest.approx(12.0, abs=1.0)
    assert not bench.status() & StatusBit.PULLING


@pytest.mark.parametrize(
    ("safe", "then"), [(SafeDirection.PUSH, PUSH), (SafeDirection.PULL, PULL), (SafeDirection.KEEP, PULL)]
)
def test_disabled_it_goes_where_the_rig_says(safe: SafeDirection, then: ValveDirection) -> None:
    bench = ValveBench(safe=safe).pulling()
    bench.disable()
    bench.run(2.0)
    assert bench.last.state is State.OFF and bench.stands is then


@pytest.mark.parametrize("safe", [SafeDirection.KEEP, SafeDirection.PULL])
def test_at_the_start_nothing_is_taken_for_granted(safe: SafeDirection) -> None:
    bench = ValveBench(PULL, safe=safe)
    bench.run(1.0)
    assert bench.stands is PULL and bench.status() & StatusBit.PULLING and not bench.switched


def test_a_fault_leads_to_the_safe_direction_without_pressure() -> None:
    bench = ValveBench().pulling()
    bench.cell_silent = True
    bench.run(2.0)
    assert bench.last.fault is FaultCode.SAMPLE_STALE and bench.stands is PUSH
    assert bench.switched[-1][2] == 0.0


@pytest.mark.parametrize("is_known", [False, True])
def test_a_regulator_that_hears_nothing_keeps_its_pressure_and_the_valve_waits_for_it(is_known: bool) -> None:
    bench = ValveBench().pulling()
    bench.kept_v = bench.last.voltage_v if is_known else None
    bench.silence_output()
    bench.run(2.0)
    assert bench.last.fault is FaultCode.OUTPUT_SILENT and bench.stands is PULL
    bench.heal()
    bench.run(2.0)
    assert bench.stands is PUSH and bench.switched[-1][2] == 0.0


def test_a_valve_that_does_not_follow_is_a_fault_within_its_bound() -> None:
    bench = ValveBench(timeout_s=0.5)
    bench.run(1.0)
    bench.obeys = False
    bench.write(control_word=ENABLE | BIT_4, force_setpoint_n=12.0)
    bench.run(1.5)
    assert bench.last.fault is FaultCode.VALVE_ALTERED and bench.last.voltage_v == 0.0
    assert max(volts for _, volts in bench.voltages()) == 0.0, "no pressure before the readback"
    assert any(event.startswith("A356") and "reads back push and was told pull" in event for event in bench.events)


def test_a_valve_that_turns_by_itself_or_falls_silent_is_a_fault() -> None:
    turned = ValveBench().pulling()
    turned.obeys = False
    turned.turn(PUSH)
    turned.run(1.0)
    assert turned.last.fault in (FaultCode.VALVE_ALTERED, FaultCode.SIGN_INVERTED)
    silent = ValveBench().pulling()
    silent.is_silent, silent.silent_s = True, silent.now_s
    silent.run(1.0)
    assert silent.last.fault is FaultCode.VALVE_SILENT and silent.last.voltage_v == 0.0


def test_a_force_that_turns_with_the_valve_is_blamed_on_the_valve_and_not_on_the_cells_wires() -> None:
    """It is seen in the force sooner than timeout_s is over."""
    bench = ValveBench(timeout_s=2.0).pulling(20.0)
    bench.obeys = False
    bench.turn(PUSH)
    bench.run(1.5)
    assert bench.last.fault is FaultCode.VALVE_ALTERED and bench.last.voltage_v == 0.0
    assert any(event.startswith("A356") and "reads back push and was told pull" in event for event in bench.events)
    right = ValveBench().pulling(20.0)
    right.plant.sign = 1.0
    right.run(1.5)
    assert right.last.fault is FaultCode.SIGN_INVERTED, "where it stands right the cell is blamed as ever"


def test_enable_is_refused_until_the_relay_has_read_back() -> None:
    bench = ValveBench()
    bench.obeys = False
    bench.stands = None  # type: ignore[assignment]
    bench.run(0.5)
    bench.write(control_word=ENABLE)
    assert bench.refused and bench.refused.reason is RefusalReason.VALVE_UNKNOWN


def test_more_than_pulling_reaches_is_refused_with_the_largest_force() -> None:
    bench = ValveBench().pulling()
    most_n = scale_forces(bsfm(), SHARE).force_range_n[1]
    bench.force(most_n + 1.0)
    assert bench.refused and bench.refused.reason is RefusalReason.PULL_RANGE
    assert f"pulling reaches {most_n:.1f} N" in bench.refused.text
    bench.force(most_n - 5.0)
    assert bench.refused is None


def test_no_run_begins_while_the_valve_pulls() -> None:
    bench = ValveBench(safe=SafeDirection.KEEP).pulling()
    bench.disable()
    bench.run(1.0)
    assert "a run is made pushing" in bench.controller.refusal_of_run(bench.now_s, CalibrationPlan())


def test_in_voltage_mode_it_is_switched_without_pressure_too() -> None:
    bench = ValveBench()
    bench.run(1.0)
    bench.voltage(3.0)
    bench.run(1.0)
    assert bench.last.voltage_v == 3.0
    bench.write(control_word=ENABLE | BIT_4)
    bench.run(3.0)
    ((_, force_n, voltage_v),) = bench.switched
    assert voltage_v == 0.0 and force_n < 3.0
    assert bench.last.voltage_v == 3.0 and bench.last.force_measured_n < -5.0


def test_a_disable_under_force_waits_until_the_force_has_left_before_it_dwells() -> None:
    """The voltage is 0 at once then, and the pressure is not: 20 N leave in 0.4 s by the rig's lag."""
    bench = ValveBench(dwell_s=0.3, safe=SafeDirection.PULL)
    bench.run(1.0)
    bench.enable(20.0)
    bench.run(3.0)
    bench.disable()
    off_s = bench.now_s
    bench.run(3.0)
    at_s, _, voltage_v = bench.switched[-1]
    assert bench.stands is PULL and voltage_v == 0.0
    assert 0.3 + 0.4 <= at_s - off_s <= 1.0


def test_under_pressure_nobody_is_told_to_move_the_valve() -> None:
    bench = ValveBench()
    bench.run(1.0)
    bench.enable(12.0)
    bench.run(2.0)
    assert bench.last.voltage_v > 0.0 and bench.last.valve is None


def turned(bench: ValveBench) -> ValveBench:
    """From a push of 12 N until the tool pulls, and no step further."""
    bench.run(1.0)
    bench.enable(12.0)
    bench.run(2.0)
    bench.write(control_word=ENABLE | BIT_4)
    while "the valve pulls" not in bench.events:
        bench.run(0.001)
        assert bench.now_s < 10.0
    return bench


def test_what_was_measured_before_the_turn_counts_the_other_way_behind_it() -> None:
    """1.5 N of zero error are -1.5 N of a pull: else 3 N seem to come or go with the turn, in a check that begins there."""
    bench = ValveBench()
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n + 1.5)
    assert turned(bench).controller._faults.measured_n == pytest.approx(-1.5, abs=0.2)


def test_a_scale_that_was_right_pushing_is_looked_at_again_pulling() -> None:
    bench = turned(ValveBench())
    bench.plant.unit = 4.0  # of 12 N no over-force
    assert bench.seconds_until(has_fault(FaultCode.GAIN_WRONG), 3.0) < 1.0


def test_behind_a_turn_the_tool_looks_for_its_contact_anew() -> None:
    """What friction keeps pressed is no contact of a pull: a tool that is free then came with 20 N, not with the approach's
    2 N, and the force of the step at the turn was told with the other sign."""
    bench, rng = ValveBench(), Random(3)
    bench.run(1.0)
    bench.write(control_word=ENABLE, force_setpoint_n=12.0)
    bench.run(2.0)

    def kept(sample: ForceSample) -> ForceSample:
        return replace(sample, force_n=max(sample.force_n, 3.0) + rng.gauss(0.0, 0.1))

    bench.alter_sample = kept
    bench.write(control_word=ENABLE | BIT_4, force_setpoint_n=30.0)
    bench.seconds_until(lambda output: bool(output.status & StatusBit.PULLING), 3.0)
    bench.plant.contact = False
    assert bench.last.force_measured_n == pytest.approx(3.0, abs=0.5) and not bench.last.status & StatusBit.CONTACT
    first = len(bench.history)
    bench.run(0.2)
    assert max(record.output.force_applied_n for record in bench.history[first:]) <= 2.0
