"""Pressure that control has not put out itself, or has lost sight of: the valve waits until it surely has left, and a stop for
the valve."""

import pytest

from gateway.bsfm.model import Response
from gateway.codes.faults import FaultCode
from gateway.control import CalibrationInUse, Controller
from gateway.registers.words import State
from tests.control.bench import bsfm
from tests.control.valve.valve_bench import BIT_4, ENABLE, NONE, PULL, PUSH, ValveBench

LEAVES_S = 0.4  # that 15 N need by the rig's lag until they are gone
DWELL_S = 0.3


def killed_while_pulling(force_n: float, timeout_s: float = 0.5) -> ValveBench:
    """The guardian has put out the safe voltage, the regulator has confirmed it, and a new control process begins."""
    bench = ValveBench(dwell_s=DWELL_S, timeout_s=timeout_s).pulling(force_n)
    assert bench.last.state is State.HOLDING and bench.stands is PULL
    bench.controller = Controller(bench.settings, CalibrationInUse(bsfm(), 1), unclean_restart=True)
    bench.command = bench.command._replace(control_word=NONE, force_setpoint_n=0.0)
    bench.switched.clear()
    bench.told = None
    return bench


@pytest.mark.parametrize("force_n", [15.0, 30.0])
def test_a_control_process_that_is_new_moves_no_valve_under_the_pressure_that_another_one_has_left(
    force_n: float,
) -> None:
    bench = killed_while_pulling(force_n)
    bench.run(3.0)
    ((_, left_n, voltage_v),) = bench.switched
    assert voltage_v == 0.0 and left_n < 1.0
    assert bench.stands is PUSH and bench.last.state is State.OFF


def test_a_valve_that_may_not_be_told_yet_is_not_blamed_for_where_it_stands() -> None:
    """An enable soon after the restart waits for the valve, however long the pressure takes, and presses then."""
    bench = killed_while_pulling(15.0, timeout_s=0.2)
    bench.run(0.3)
    bench.enable(12.0)
    bench.run(0.25)
    assert bench.last.fault is FaultCode.NONE and not bench.switched
    bench.run(4.0)
    assert bench.last.fault is FaultCode.NONE and bench.last.state is State.HOLDING
    assert bench.last.force_measured_n == pytest.approx(12.0, abs=1.0)


def test_where_it_stands_already_nothing_is_waited_for() -> None:
    """The force is there as soon as after any enable: only a valve that has to move waits."""
    bench = ValveBench(dwell_s=DWELL_S)
    bench.run(0.1)
    bench.enable(12.0)
    bench.run(1.0)
    assert bench.last.state is State.HOLDING


@pytest.mark.parametrize("is_known", [False, True])
def test_behind_a_silence_the_pressure_leaves_from_when_the_safe_voltage_is_confirmed(is_known: bool) -> None:
    bench = ValveBench(dwell_s=DWELL_S).pulling(15.0)
    bench.kept_v = bench.last.voltage_v if is_known else None
    bench.silence_output()
    bench.run(2.0)
    assert bench.last.fault is FaultCode.OUTPUT_SILENT and bench.stands is PULL
    bench.heal()
    healed_s = bench.now_s
    bench.run(2.0)
    assert bench.stands is PUSH and bench.switched[-1][0] - healed_s >= LEAVES_S + DWELL_S


def test_a_pull_that_is_asked_for_right_after_the_start_waits_for_what_may_be_left() -> None:
    bench = ValveBench(dwell_s=DWELL_S)
    bench.run(0.1)
    bench.write(control_word=ENABLE | BIT_4, force_setpoint_n=12.0)
    bench.run(0.5)
    assert not bench.switched
    bench.run(4.0)
    assert bench.stands is PULL and bench.last.state is State.HOLDING


def seconds_to_stop(bench: ValveBench) -> float:
    began_s = bench.now_s
    bench.controller.stop()
    while not bench.controller.has_stopped:
        bench.run(0.01)
        assert bench.now_s - began_s < 4.0, "the guardian waits no longer"
    return bench.now_s - began_s


def test_a_stop_ends_with_the_valve_where_the_rig_says_and_not_in_a_pull_that_nobody_ends_any_more() -> None:
    bench = ValveBench(dwell_s=DWELL_S).pulling(15.0)
    assert DWELL_S < seconds_to_stop(bench) < 2.0
    assert bench.stands is PUSH and bench.switched[-1][2] == 0.0


def test_a_stop_waits_for_no_valve_that_rests_already_or_does_not_come() -> None:
    pushing = ValveBench(dwell_s=DWELL_S)
    pushing.run(1.5)
    pushing.enable(12.0)
    pushing.run(2.0)
    assert seconds_to_stop(pushing) < DWELL_S
    stuck = ValveBench(dwell_s=DWELL_S, timeout_s=0.5).pulling(15.0)
    stuck.obeys = False
    assert seconds_to_stop(stuck) < 3.0 and stuck.stands is PULL


@pytest.mark.parametrize("lag_s", [0.05, 0.4])
def test_the_valve_waits_by_the_response_of_the_calibration_in_use(lag_s: float) -> None:
    bench = ValveBench(dwell_s=DWELL_S).pulling(15.0)
    response = Response(dead_time_s=0.0, lag_s=lag_s)
    bench.controller.use(CalibrationInUse(bsfm(), 2, response))
    bench.run(2.0)
    bench.write(control_word=NONE, force_setpoint_n=0.0)
    disabled_s = bench.now_s
    bench.run(4.0)
    waited_s = bench.switched[-1][0] - disabled_s - DWELL_S
    assert bench.stands is PUSH
    assert (waited_s > 1.0) is (lag_s > 0.3), f"{waited_s:.2f} s with a lag of {lag_s} s"
