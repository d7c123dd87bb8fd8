"""The state table, and what the states mean to a master."""

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.codes.warning_bits import WarningBit
from gateway.control import CalibrationInUse
from gateway.control.controller import Controller
from gateway.control.decision import safe_output
from gateway.control.state_table import ENABLED_STATES, TRANSITIONS, StateEvent, TransitionError, next_state
from gateway.registers.command import Command
from gateway.registers.words import ControlBit, State, StatusBit
from tests.control.bench import Bench, bsfm, settings


def ready(**plant: float | bool) -> Bench:
    bench = Bench(**plant)
    bench.run(0.1)
    return bench


def test_a_pair_that_the_table_lacks_raises():
    with pytest.raises(TransitionError, match="FAULT has no event ENABLE"):
        next_state(State.FAULT, StateEvent.ENABLE)
    with pytest.raises(TransitionError):
        next_state(State.FAULT, StateEvent.FAILED)  # a second first cause
    with pytest.raises(TransitionError):
        next_state(State.OFF, StateEvent.MOVE)


def test_where_a_step_raised_the_answer_is_a_latched_fault_at_the_safe_voltage():
    output = safe_output(FaultCode.INTERNAL, 0.5)
    assert (output.voltage_v, output.state, output.fault) == (0.5, State.FAULT, FaultCode.INTERNAL)
    assert output.enable_block is RefusalReason.FAULT_LATCHED and output.status == StatusBit.FAULT
    assert output.clear_command and output.events[0].startswith(FaultCode.INTERNAL.code)


def test_every_enabled_state_can_be_left_by_disable_and_by_a_fault():
    for state in ENABLED_STATES:
        assert TRANSITIONS[state, StateEvent.DISABLE] is State.OFF
        assert TRANSITIONS[state, StateEvent.FAILED] is State.FAULT


def test_every_pair_of_state_and_event_is_meant_so():
    """A dash is a pair that must not happen: it raises."""
    events = (
        StateEvent.ENABLE,
        StateEvent.DISABLE,
        StateEvent.WAIT,
        StateEvent.MOVE,
        StateEvent.SETTLE,
        StateEvent.FAILED,
        StateEvent.RESET,
        StateEvent.CALIBRATE,
    )
    rows = {
        State.OFF: "ready - - - - fault - calibrating",
        State.READY: "- off ready ramping holding fault - calibrating",
        State.RAMPING: "- off ready ramping holding fault - -",
        State.HOLDING: "- off ready ramping holding fault - -",
        State.FAULT: "- - - - - - off -",
        State.CALIBRATING: "- off - calibrating - fault - -",
    }
    assert set(events) == set(StateEvent)
    assert set(rows) == set(State)
    for state, row in rows.items():
        for event, name in zip(events, row.split(), strict=True):
            if name == "-":
                with pytest.raises(TransitionError):
                    next_state(state, event)
            else:
                assert next_state(state, event) is State[name.upper()]


def test_an_edge_that_was_not_asked_about_is_a_defect_and_no_silence():
    """What control would refuse never reaches its step: the bank asks. If it comes all the same, the fault is ours."""
    bench = ready()
    bench.enable(12.0)
    bench.command = Command(control_word=ControlBit.ENABLE | ControlBit.RESET_FAULT, number=99)
    with pytest.raises(TransitionError):
        bench.step()
    assert bench.controller.state is State.FAULT


def test_only_reset_leaves_fault():
    assert [event for state, event in TRANSITIONS if state is State.FAULT] == [StateEvent.RESET]


def test_start_is_off_at_the_safe_voltage_and_says_what_is_missing():
    bench = Bench()
    output = bench.step()
    assert (output.state, output.voltage_v) == (State.OFF, 0.0)
    assert output.enable_block is RefusalReason.CELL_SILENT
    assert not output.status & StatusBit.READY


def test_ready_bit_comes_with_a_fresh_cell_and_an_acknowledged_output():
    bench = ready()
    assert bench.last.status & StatusBit.READY
    assert bench.last.enable_block is RefusalReason.NONE


def test_enable_with_setpoint_zero_is_ready_and_keeps_zero_volts():
    bench = ready()
    bench.enable(0.0)
    output = bench.run(0.2)
    assert (output.state, output.voltage_v) == (State.READY, 0.0)
    assert output.status & StatusBit.ENABLED


def test_a_setpoint_acts_in_the_step_of_its_arrival():
    bench = ready()
    bench.enable(0.0)
    bench.run(0.05)
    before = bench.step().voltage_v
    after = bench.force(12.0).voltage_v  # same virtual time
    assert after > before
    bench.run(1.0)
    before = bench.step().voltage_v
    assert bench.force(5.0).voltage_v < before


def test_an_enable_after_a_ramp_cut_short_acts_on_arrival_too():
    bench = ready()
    bench.enable(40.0)
    bench.run(0.3)
    bench.disable()
    bench.run(0.5)
    bench.step()
    assert bench.enable(12.0).voltage_v > 0.0


def test_enable_and_force_in_one_write_ramp_and_then_hold():
    bench = ready()
    assert bench.enable(12.0).state is State.READY  # at the pre-contact force
    bench.seconds_until(lambda output: output.state is State.RAMPING, 0.5)
    output = bench.run(1.0)
    assert output.state is State.HOLDING
    assert output.status & StatusBit.IN_BAND
    assert abs(output.force_measured_n - 12.0) < 1.0


def test_disable_is_the_safe_voltage_at_once_and_asks_to_clear_the_command():
    bench = ready()
    bench.enable(12.0)
    bench.run(1.0)
    output = bench.disable()
    assert (output.state, output.voltage_v) == (State.OFF, 0.0)
    assert output.clear_command
    assert not output.release_owner, "the bank has done that: it knows who disabled"
    assert bench.command.force_setpoint_n == 0.0


def test_enable_acts_on_its_rise_only():
    bench = ready()
    bench.enable(12.0)
    bench.run(0.5)
    bench.line = bench.line.__class__(acknowledged_v=0.0, fault=FaultCode.OUTPUT_ALTERED)
    bench.step()
    bench.heal()
    output = bench.write(control_word=ControlBit.RESET_FAULT)
    assert output.state is State.OFF
    stale_enable = Command(control_word=ControlBit.ENABLE, force_setpoint_n=12.0, number=99)
    bench.command = stale_enable
    assert bench.step().state is not State.OFF  # this one is a rise
    bench.disable()
    bench.command = Command(control_word=ControlBit(0), number=100)
    bench.step()
    assert bench.run(0.1).state is State.OFF


def test_an_enable_that_is_blocked_changes_nothing_and_says_why():
    bench = ready()
    bench.cell_silent = True
    bench.run(0.2)
    output = bench.enable(12.0)
    assert bench.refused is not None
    assert (bench.refused.reason, bench.refused.bit) == (RefusalReason.CELL_SILENT, ControlBit.ENABLE)
    assert bench.refused.text.startswith("enable refused: the load cell is silent: check its power")
    assert (output.state, output.voltage_v, output.clear_command) == (State.OFF, 0.0, False)


def test_a_refused_enable_does_not_come_true_later_by_itself():
    bench = ready()
    bench.ignores_clearing = True  # a bank that left the bit standing
    bench.cell_silent = True
    bench.run(0.2)
    bench.enable(12.0)
    bench.heal()
    bench.run(0.1)
    assert bench.force(13.0).state is State.OFF
    bench.disable()
    assert bench.enable(13.0).state is State.READY


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"fault": FaultCode.OUTPUT_REFUSED}, RefusalReason.OUTPUT_FAULT),
        ({"unanswered_since_s": 0.0}, RefusalReason.OUTPUT_FAULT),
        ({"cell_lost": True}, RefusalReason.CELL_SILENT),
        ({"acknowledged_v": None}, RefusalReason.NOT_READY),
    ],
)
def test_while_off_a_broken_line_is_no_fault_but_blocks_enable(change, reason):
    bench = ready()
    bench.run(0.2)
    bench.line = bench.line.__class__(**{"acknowledged_v": 0.0, **change})
    output = bench.step()
    assert (output.state, output.fault, output.enable_block) == (State.OFF, FaultCode.NONE, reason)


def test_an_unclean_restart_warns_until_somebody_enables():
    bench = ready()
    bench.controller = Controller(
        settings(), CalibrationInUse(bench.controller._loop.feedforward.model, 1), unclean_restart=True
    )
    output = bench.run(0.1)
    assert output.warnings & WarningBit.RESTARTED
    assert output.status & StatusBit.WARNING
    bench.enable(0.0)
    assert not bench.step().warnings & WarningBit.RESTARTED


def test_echoes_follow_the_command():
    bench = ready()
    output = bench.write(heartbeat=17, command_sequence=4, force_setpoint_n=9.0)
    assert (output.heartbeat_echo, output.sequence_echo, output.force_requested_n) == (17, 4, 9.0)
    assert output.force_accepted_n == 0.0  # not enabled


def test_a_reset_is_for_the_output_s_own_faults_too_whether_one_is_latched_here_or_not():
    bench = ready()
    assert bench.write(control_word=ControlBit.RESET_FAULT).resets_device
    bench.enable(12.0)
    bench.line = bench.line._replace(fault=FaultCode.OUTPUT_REFUSED)
    assert bench.step().state is State.FAULT
    bench.line = bench.line._replace(fault=FaultCode.NONE)
    assert bench.reset().resets_device and bench.last.state is State.OFF


def test_a_reset_acknowledges_a_restart_too():
    bench = ready()
    bench.controller = Controller(settings(), CalibrationInUse(bsfm(), 1), unclean_restart=True)
    bench.controller.fail_internally(bench.now_s)
    assert bench.step().warnings & WarningBit.RESTARTED
    assert bench.reset().state is State.OFF
    assert not bench.last.warnings & WarningBit.RESTARTED


def test_a_defect_of_ours_latches_and_the_caller_gets_the_safe_voltage():
    bench = ready()
    bench.enable(12.0)
    bench.run(0.5)
    with pytest.raises(AttributeError):
        bench.controller.step(bench.now_s, bench.command, bench.sample, None)  # type: ignore[arg-type]
    answer = bench.controller.fail_internally(bench.now_s)
    assert (answer.voltage_v, answer.state, answer.fault) == (0.0, State.FAULT, FaultCode.INTERNAL)
    output = bench.step()
    assert (output.voltage_v, output.state, output.fault) == (0.0, State.FAULT, FaultCode.INTERNAL)
