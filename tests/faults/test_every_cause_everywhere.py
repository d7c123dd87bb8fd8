"""Whatever control is at, each first cause stops it in the same way, and behind the reset nothing of before is left."""

import copy
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import pytest

from gateway.codes.faults import FaultCode
from gateway.control.settings import LeaseAction
from gateway.control.state_table import ENABLED_STATES
from gateway.registers.words import ControlBit, Mode, State, StatusBit
from tests.control.bench import Bench, enabled, settings
from tests.control.runs.test_ladder_run import begun
from tests.control.valve.valve_bench import ValveBench

LONGEST_S = 0.3
"""Of every bound of the settings, and what a step and three samples take."""


def _held() -> Bench:
    bench = enabled()
    bench.force(12.0)
    bench.run(1.0)
    return bench


def _ramping() -> Bench:
    bench = enabled()
    bench.force(40.0)
    bench.run(0.15)
    return bench


def _in_voltage_mode() -> Bench:
    bench = enabled()
    bench.voltage(2.0)
    bench.run(0.5)
    return bench


def _without_contact() -> Bench:
    bench = enabled(contact=False)
    bench.force(12.0)
    bench.run(0.5)
    return bench


def _lost_master(action: LeaseAction, seconds: float) -> Bench:
    bench = enabled(settings(lease_s=0.2, lease_action=action))
    bench.heartbeat_every_ms = 50
    bench.force(45.0)
    bench.run(1.0)
    bench.heartbeat_every_ms = 0
    bench.run(seconds)
    return bench


def _masters_run() -> Bench:
    bench = Bench()
    bench.run(0.5)
    bench.write(control_word=ControlBit.START_CALIBRATION)
    bench.run(3.0)
    return bench


def _local_run(leaves_after_s: float | None = None) -> Bench:
    bench = begun(Bench(settings(lease_s=0.2)))
    bench.run(4.0)
    if leaves_after_s is not None:
        bench.controller.active_run.ask_stop("calibration stopped by a person")
        bench.run(leaves_after_s)
    return bench


def _switching() -> Bench:
    bench = ValveBench().pulling()
    bench.write(control_word=ControlBit.ENABLE)
    bench.run(0.1)
    return bench


SITUATIONS: dict[str, Callable[[], Bench]] = {
    "holding": _held,
    "ramping": _ramping,
    "voltage": _in_voltage_mode,
    "without contact": _without_contact,
    "master lost, force held": lambda: _lost_master(LeaseAction.HOLD, 0.5),
    "master lost, on the way to 0": lambda: _lost_master(LeaseAction.RAMP, 0.22),
    "run of a master": _masters_run,
    "run of this machine": _local_run,
    "run of this machine, on the way to 0": lambda: _local_run(0.03),
    "pulling": lambda: ValveBench().pulling(),
    "valve switching": _switching,
}
CAUSES: dict[FaultCode, Callable[[Bench], None]] = {
    FaultCode.OUTPUT_LOST: lambda bench: line(bench, fault=FaultCode.OUTPUT_LOST),
    FaultCode.SAMPLE_STALE: lambda bench: setattr(bench, "cell_silent", True),
    FaultCode.OVER_FORCE: lambda bench: readings(bench, 70.0),
    FaultCode.LOOP_STALLED: lambda bench: line(bench, late_s=0.5),
}


def line(bench: Bench, **changes: object) -> None:
    bench.line = bench.line._replace(**changes)  # type: ignore[arg-type]


def readings(bench: Bench, force_n: float) -> None:
    bench.alter_sample = lambda sample: replace(sample, force_n=force_n)


@cache
def _in(situation: str) -> Bench:
    bench = SITUATIONS[situation]()
    assert bench.last.state in ENABLED_STATES, bench.events
    del bench.history[:-1]
    bench.events.clear()
    return bench


@pytest.mark.sampled
@pytest.mark.parametrize("fault", CAUSES, ids=lambda fault: fault.name.lower())
@pytest.mark.parametrize("situation", SITUATIONS)
def test_each_cause_stops_each_situation_and_a_reset_begins_as_ever(situation: str, fault: FaultCode) -> None:
    bench = copy.deepcopy(_in(situation))
    CAUSES[fault](bench)
    assert bench.seconds_until(lambda output: output.fault is fault, LONGEST_S) <= LONGEST_S
    output = bench.last
    assert (output.state, output.voltage_v, output.force_accepted_n) == (State.FAULT, 0.0, 0.0)
    assert any(record.output.clear_command for record in bench.history)
    if not isinstance(bench, ValveBench):
        bench.heal()
    else:  # its line knows the valve
        bench.cell_silent = False
        bench.alter_sample = lambda sample: sample
        line(bench, fault=FaultCode.NONE, late_s=0.0)
    bench.heartbeat_every_ms = 50
    bench.run(0.5)
    assert (bench.last.fault, bench.last.state) == (fault, State.FAULT)
    bench.events.clear()
    assert bench.reset().state is State.OFF, bench.refused
    assert not bench.last.warnings and not bench.controller.active_run.running
    bench.enable(12.0, mode=Mode.FORCE)
    assert bench.refused is None and bench.seconds_until(lambda output: output.state is State.HOLDING, 2.5) <= 2.5
    bench.run(0.1)
    output = bench.last
    assert (output.state, output.fault, output.warnings) == (State.HOLDING, FaultCode.NONE, 0)
    assert output.force_measured_n == pytest.approx(12.0, abs=1.0)
    assert output.status == StatusBit.ENABLED | StatusBit.READY | StatusBit.CONTACT | StatusBit.IN_BAND
    assert not [event for event in bench.events if event.startswith("A")]
