"""A cell whose sign or size is wrong stops the force within its time, and a plant that is merely off does not."""

from dataclasses import replace

import pytest

from gateway.codes.faults import FaultCode
from gateway.registers.words import ControlBit, State, StatusBit
from tests.control.bench import Bench
from tests.faults.test_control_reactions import assert_faulted, pressing


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("force_n", [5.0, 40.0])
def test_swapped_wires_are_found_within_a_second_of_the_first_rise(seed, force_n):
    bench = Bench(seed=seed, sign=-1.0, noise_n=0.2)
    bench.run(0.3)
    bench.enable(force_n)
    assert_faulted(bench, FaultCode.SIGN_INVERTED, 1.0)
    assert max(record.force_n for record in bench.history) < 6.0  # it never left the pre-contact force
    assert any(event.startswith("A302") and "sign: -1" in event for event in bench.events)


def test_swapped_wires_are_found_within_a_second_of_contact():
    bench = Bench(sign=-1.0, contact=False)
    bench.run(0.3)
    bench.enable(12.0)
    bench.run(2.0)
    assert bench.last.fault is FaultCode.NONE
    bench.plant.contact = True
    assert_faulted(bench, FaultCode.SIGN_INVERTED, 1.0)


def test_wires_that_swap_while_running_are_found_within_a_second():
    bench = pressing(12.0)
    bench.plant.sign = -1.0
    assert_faulted(bench, FaultCode.SIGN_INVERTED, 1.0)


def test_a_zero_that_is_off_is_not_taken_for_swapped_wires():
    bench = Bench()
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n - 3.0)
    bench.run(0.3)
    bench.enable(12.0)
    assert bench.run(3.0).fault is FaultCode.NONE


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("unit", [9.81, 4.5])
def test_a_gain_far_too_high_stops_within_a_second_and_before_the_force_is_there(seed, unit):
    bench = Bench(seed=seed, unit=unit)
    bench.run(0.3)
    bench.enable(12.0)
    bench.run(1.0)
    assert bench.last.state is State.FAULT
    assert bench.last.fault in (FaultCode.GAIN_WRONG, FaultCode.OVER_FORCE)
    assert max(record.force_n for record in bench.history) < 12.0


def test_while_the_first_rise_looks_too_high_nothing_more_is_pressed():
    bench = Bench(unit=4.6, friction_n=1.0)
    bench.run(0.3)
    bench.write(control_word=ControlBit.ENABLE, force_setpoint_n=12.0, contact_ramp_s=0.3)
    assert_faulted(bench, FaultCode.GAIN_WRONG, 1.0)
    assert max(record.force_n for record in bench.history) < 8.0


@pytest.mark.parametrize("seed", range(4))
def test_a_gain_far_too_low_stops_within_a_second_of_contact(seed):
    bench = Bench(seed=seed, unit=1.0 / 9.81)
    bench.run(0.3)
    bench.write(control_word=ControlBit.ENABLE, force_setpoint_n=20.0, precontact_force_n=8.0)
    assert_faulted(bench, FaultCode.GAIN_WRONG, 1.0)
    assert any(event.startswith("A303") and "kgf" in event for event in bench.events)


def test_a_gain_so_low_that_contact_is_not_felt_waits_and_warns():
    bench = Bench(unit=1.0 / 9.81)
    bench.run(0.3)
    bench.enable(12.0)
    output = bench.run(3.0)
    assert (output.state, output.force_applied_n) == (State.READY, 2.0)
    assert output.status & StatusBit.TARGET_UNREACHABLE


@pytest.mark.parametrize("gain", [4.0, 13.0])
@pytest.mark.parametrize("friction_n", [0.0, 3.0])
def test_a_plant_that_is_merely_off_is_not_called_a_wrong_gain(gain, friction_n):
    bench = Bench(gain_n_per_v=gain, friction_n=friction_n)
    bench.run(0.3)
    for force_n in (12.0, 20.0, 4.0, 0.0, 12.0):
        bench.enable(force_n)
        bench.run(1.0)
    assert bench.last.fault is FaultCode.NONE


def test_a_quick_second_enable_is_no_wrong_sign_while_the_old_force_decays():
    bench = pressing(40.0)
    for _ in range(3):
        bench.disable()
        bench.run(0.03)
        bench.enable(5.0)
        bench.run(0.5)
    assert bench.last.fault is FaultCode.NONE
