"""A fault has one first cause and latches; what a reset needs."""

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.control import LeaseAction
from gateway.registers.words import ControlBit, Mode, State
from tests.control.bench import Bench, enabled, has_fault, settings
from tests.faults.test_control_reactions import SAMPLE_S, TICK_S, assert_faulted, pressing


def test_the_first_cause_stays_when_others_follow():
    bench = pressing()
    bench.line = bench.line._replace(fault=FaultCode.OUTPUT_REFUSED)
    bench.run(0.02)
    bench.cell_silent = True
    bench.line = bench.line._replace(cell_lost=True)
    bench.run(1.0)
    assert bench.last.fault is FaultCode.OUTPUT_REFUSED
    assert bench.last.enable_block is RefusalReason.FAULT_LATCHED
    assert sum(event[:2] == "A3" for event in bench.events) == 1


def test_a_reset_needs_its_rise_setpoint_zero_and_enable_zero():
    bench = pressing()
    bench.line = bench.line._replace(fault=FaultCode.OUTPUT_REFUSED)
    bench.run(0.02)
    bench.heal()
    assert bench.write(control_word=ControlBit.RESET_FAULT, force_setpoint_n=5.0).state is State.FAULT
    bench.write(control_word=ControlBit(0), force_setpoint_n=0.0)
    assert bench.write(control_word=ControlBit.RESET_FAULT, voltage_setpoint_v=0.5).state is State.FAULT
    both = ControlBit.RESET_FAULT | ControlBit.ENABLE
    assert bench.write(control_word=both, force_setpoint_n=0.0).state is State.FAULT
    bench.write(control_word=ControlBit(0))
    assert bench.write(control_word=ControlBit.RESET_FAULT).state is State.OFF
    assert bench.last.fault is FaultCode.NONE
    assert bench.enable(12.0).state is not State.FAULT


def test_a_reset_with_a_lease_needs_a_heartbeat_since_the_fault():
    bench = Bench(settings(lease_s=0.2, lease_action=LeaseAction.FAULT))
    bench.heartbeat_every_ms = 50
    bench.run(0.3)
    bench.enable(12.0)
    bench.run(0.5)
    bench.heartbeat_every_ms = 0
    bench.seconds_until(has_fault(FaultCode.MASTER_LOST), 0.5)
    bench.run(0.05)
    assert bench.write(control_word=ControlBit.RESET_FAULT).state is State.FAULT
    bench.write(control_word=ControlBit(0), heartbeat=5)
    assert bench.write(control_word=ControlBit.RESET_FAULT, heartbeat=6).state is State.OFF


def test_behind_a_defect_of_ours_the_clearing_is_no_heartbeat():
    bench = Bench(settings(lease_s=0.2, lease_action=LeaseAction.FAULT))
    bench.heartbeat_every_ms = 50
    bench.run(0.3)
    bench.enable(12.0)
    bench.run(0.5)
    bench.heartbeat_every_ms = 0
    assert bench.controller.fail_internally(bench.now_s).clear_command
    bench.run(0.01)
    bench.command = bench.command._replace(
        control_word=ControlBit(0), force_setpoint_n=0.0, number=bench.command.number + 1
    )
    bench.run(0.05)
    assert bench.write(control_word=ControlBit.RESET_FAULT).state is State.FAULT
    assert bench.refused and "heartbeat" in bench.refused.text
    bench.write(control_word=ControlBit(0), heartbeat=5)
    assert bench.write(control_word=ControlBit.RESET_FAULT, heartbeat=6).state is State.OFF


def test_direct_voltage_needs_a_fresh_cell_too():
    bench = Bench(gain_n_per_v=5.0)
    bench.run(0.3)
    bench.voltage(3.0)
    bench.run(0.5)
    assert bench.command.mode is Mode.VOLTAGE
    bench.cell_silent = True
    assert_faulted(bench, FaultCode.SAMPLE_STALE, 0.05 + SAMPLE_S + TICK_S)


def test_a_reset_may_have_the_value_of_the_beat_before_it():
    """A master that beats by a write of its own, behind the clearing of its command, has beaten since the fault."""
    bench = enabled(settings(lease_s=0.2))
    bench.heartbeat_every_ms = 50
    bench.force(12.0)
    bench.run(0.5)
    bench.line = bench.line._replace(fault=FaultCode.OUTPUT_LOST)
    bench.run(0.1)
    bench.line = bench.line._replace(fault=FaultCode.NONE)
    bench.run(0.3)
    assert bench.last.state is State.FAULT
    assert bench.write(control_word=ControlBit.RESET_FAULT).state is State.OFF, bench.refused


def test_a_reset_by_the_value_of_an_old_beat_is_refused():
    """The master has beaten behind the fault, and is silent for longer than its lease since."""
    bench = enabled(settings(lease_s=0.2))
    bench.line = bench.line._replace(fault=FaultCode.OUTPUT_LOST)
    bench.run(0.1)
    bench.line = bench.line._replace(fault=FaultCode.NONE)
    bench.write(heartbeat=7)
    bench.run(0.3)
    bench.write(control_word=ControlBit.RESET_FAULT)
    assert bench.refused and bench.refused.reason is RefusalReason.HEARTBEAT_STALE
