"""The hazards that supervision detects, one by one: what is detected, and within which time the safe voltage goes out."""

from dataclasses import replace
from math import inf, isfinite, nan

import pytest

from gateway.bsfm import InverseStatus
from gateway.codes.faults import FaultCode
from gateway.devices.messages import Quality
from gateway.registers.words import State, StatusBit
from tests.control.bench import Bench, has_fault, settings

TICK_S = 0.01
SAMPLE_S = 0.01


def pressing(force_n: float = 12.0, control=None, seed: int = 1, **plant) -> Bench:
    bench = Bench(control, seed, **plant)
    bench.run(0.3)
    bench.enable(force_n)
    bench.run(1.0)
    assert bench.last.state is State.HOLDING
    return bench


def assert_faulted(bench: Bench, code: FaultCode, within_s: float) -> None:
    took_s = bench.seconds_until(has_fault(code), within_s + 1.0)
    assert took_s <= within_s
    record = next(record for record in bench.history if record.output.fault is code)
    assert (record.output.voltage_v, record.output.state) == (bench.settings.limits.safe_voltage_v, State.FAULT)
    assert record.output.clear_command
    assert record.output.release_owner is (code is FaultCode.MASTER_LOST), "an explicit takeover outlives other faults"
    assert record.output.status & StatusBit.FAULT


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_stale_load_cell_stops_within_its_time(seed):
    bench = pressing(seed=seed)
    bench.cell_silent = True
    assert_faulted(bench, FaultCode.SAMPLE_STALE, 0.05 + SAMPLE_S + TICK_S)


def test_a_lost_master_stops_within_the_lease_and_20_ms():
    bench = Bench(settings(lease_s=0.2))
    bench.heartbeat_every_ms = 50
    bench.run(0.3)
    bench.enable(12.0)
    bench.run(1.0)
    assert bench.last.state is State.HOLDING
    bench.heartbeat_every_ms = 0
    assert_faulted(bench, FaultCode.MASTER_LOST, 0.22)


def test_frames_with_a_frozen_heartbeat_do_not_feed_the_lease():
    bench = Bench(settings(lease_s=0.2))
    bench.heartbeat_every_ms = 50
    bench.run(0.3)
    bench.enable(12.0)
    bench.run(1.0)
    bench.heartbeat_every_ms = 0
    for _ in range(10):
        bench.write(force_setpoint_n=12.0)
        bench.run(0.04)
    assert bench.last.fault is FaultCode.MASTER_LOST


def test_an_enable_has_one_lease_to_beat():
    bench = Bench(settings(lease_s=0.2))
    bench.run(1.0)
    assert bench.enable(12.0).state is not State.FAULT
    bench.run(0.15)
    assert bench.last.fault is FaultCode.NONE
    assert_faulted(bench, FaultCode.MASTER_LOST, 0.07)


def test_a_closed_connection_is_loss_where_a_lease_is_set():
    bench = Bench(settings(lease_s=0.2))
    bench.heartbeat_every_ms = 50
    bench.run(0.3)
    bench.enable(12.0)
    bench.run(1.0)
    bench.line = bench.line._replace(owner_connected=False)
    assert_faulted(bench, FaultCode.MASTER_LOST, TICK_S)


def test_a_frozen_cell_is_found_once_the_force_must_have_changed():
    bench = pressing(12.0)
    bench.cell_frozen = True
    bench.run(1.0)
    assert bench.last.fault is FaultCode.NONE  # nothing had to change
    bench.force(25.0)
    assert_faulted(bench, FaultCode.SAMPLE_FROZEN, 0.5 + 2 * TICK_S)


def test_a_quiet_cell_behind_a_dead_time_is_not_called_frozen():
    """It repeated itself for longer than frozen_s before each step, and the model moved 0.1 s before the machine."""
    bench = Bench(noise_n=0.0, delay_s=0.12)
    bench.run(0.3)
    for target_n in (12.0, 40.0, 10.0, 35.0, 15.0, 45.0):
        bench.enable(target_n)
        bench.run(2.5)
    assert bench.last.fault is FaultCode.NONE, bench.events


def test_a_quiet_cell_under_friction_is_not_called_frozen():
    bench = pressing(12.0, noise_n=0.0, friction_n=2.0)
    for target_n in (12.5, 11.8, 12.2, 11.9):
        bench.force(target_n)
        bench.run(1.0)
    assert bench.last.fault is FaultCode.NONE


def test_a_quiet_cell_in_free_air_is_not_called_frozen():
    bench = Bench(contact=False, noise_n=0.0)
    bench.run(0.3)
    bench.enable(12.0)
    assert bench.run(3.0).fault is FaultCode.NONE


def test_equal_samples_of_a_noisy_cell_are_enough_where_the_rig_says_so():
    bench = pressing(12.0, settings(frozen_equal_samples=25), quantum_n=0.001)
    bench.cell_frozen = True
    assert_faulted(bench, FaultCode.SAMPLE_FROZEN, 25 * SAMPLE_S + TICK_S)


def test_over_force_stops_within_three_samples():
    bench = pressing(30.0)
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n + 40.0)
    assert_faulted(bench, FaultCode.OVER_FORCE, 3 * SAMPLE_S + TICK_S)


def test_one_spike_is_not_over_force():
    bench = pressing(30.0)
    spikes = iter([80.0, 80.0, 0.0, 80.0])
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n + next(spikes, 0.0))
    bench.run(0.5)
    assert bench.last.fault is FaultCode.NONE


@pytest.mark.parametrize("force_n", [98.1, -98.1, nan, inf, -inf])
def test_saturation_counts_as_over_force(force_n):
    bench = pressing(12.0)
    quality = Quality.OK if isfinite(force_n) else Quality.OVERLOAD
    bench.alter_sample = lambda sample: replace(sample, force_n=force_n, quality=quality)
    assert_faulted(bench, FaultCode.OVER_FORCE, 3 * SAMPLE_S + TICK_S)


def test_a_cell_saturates_before_the_over_force_limit_is_reached():
    control = settings(saturation_n=40.0)
    bench = pressing(12.0, control)
    bench.alter_sample = lambda sample: replace(sample, force_n=45.0)
    assert bench.settings.limits.over_force_n > 45.0
    assert_faulted(bench, FaultCode.OVER_FORCE, 3 * SAMPLE_S + TICK_S)


def test_one_sample_seen_by_many_steps_is_one_sample():
    bench = pressing(12.0)
    bench.alter_sample = lambda sample: replace(sample, force_n=80.0)
    bench.run(0.01)
    bench.cell_silent = True
    bench.run(0.2)
    assert bench.last.fault is FaultCode.SAMPLE_STALE


def test_a_silent_output_stops_within_its_time():
    bench = pressing()
    bench.silence_output()
    assert_faulted(bench, FaultCode.OUTPUT_SILENT, 0.1 + TICK_S)


@pytest.mark.parametrize("code", [FaultCode.OUTPUT_REFUSED, FaultCode.OUTPUT_ALTERED, FaultCode.OUTPUT_LOST])
def test_what_the_output_line_reports_is_the_fault_of_the_next_step(code):
    bench = pressing()
    bench.line = bench.line._replace(fault=code)
    assert_faulted(bench, code, TICK_S)


def test_a_lost_cell_port_is_the_fault_of_the_next_step():
    bench = pressing()
    bench.line = bench.line._replace(cell_lost=True)
    assert_faulted(bench, FaultCode.CELL_LOST, TICK_S)


def test_a_reading_that_is_no_number_stops_at_once():
    bench = pressing()
    bench.alter_sample = lambda sample: replace(sample, force_n=nan)
    assert_faulted(bench, FaultCode.NOT_FINITE, SAMPLE_S + TICK_S)


@pytest.mark.parametrize("field", ["force_setpoint_n", "force_ramp_n_per_s", "tilt_angle_rad", "voltage_setpoint_v"])
def test_a_command_that_is_no_number_stops_at_once(field):
    bench = pressing()
    assert bench.write(**{field: nan}).fault is FaultCode.NOT_FINITE
    assert bench.last.voltage_v == 0.0


def test_a_stalled_loop_drops_what_arrived_in_it():
    bench = pressing()
    bench.block_loop(0.12)
    output = bench.force(40.0)
    assert (output.fault, output.voltage_v) == (FaultCode.LOOP_STALLED, 0.0)


@pytest.mark.parametrize(
    ("waited_s", "fault"),
    [(0.1, FaultCode.MACHINE_BUSY), (0.02, FaultCode.LOOP_STALLED), (None, FaultCode.LOOP_STALLED)],
)
def test_a_busy_machine_is_told_from_a_defect_of_ours(waited_s, fault):
    bench = pressing()
    bench.line = bench.line._replace(late_s=0.12, waited_s=waited_s)
    output = bench.run(TICK_S)
    assert (output.fault, output.voltage_v) == (fault, 0.0)
    assert any("120 ms late, allowed 100 ms" in event for event in bench.events)


@pytest.mark.parametrize("is_heard_first", [True, False], ids=["before the tick", "behind a tick and a sample"])
def test_an_enable_that_waited_for_a_stalled_loop_is_not_obeyed(is_heard_first: bool) -> None:
    """What comes first out of a stall, a request, a tick or a sample, is chance; a master that has given up sends no stop."""
    bench = Bench()
    bench.run(0.3)
    bench.block_loop(0.12)
    if not is_heard_first:
        bench.step()
        bench.run(0.02)
    bench.enable(12.0)
    assert bench.refused and (is_heard_first or "stood still for 120 ms" in bench.refused.text)
    assert bench.last.state is State.OFF
    bench.run(0.2)
    bench.enable(12.0)
    assert bench.refused is None and bench.last.state is not State.OFF, "asked for again, it is taken"


def test_a_model_that_answers_nonsense_is_named():
    class Nonsense:
        reversal = Bench().controller._loop.feedforward.model.reversal

        def voltage_v(self, force_n: float, state: float) -> tuple[float, InverseStatus]:
            return nan, InverseStatus.OK

        def force_n(self, voltage_v: float, state: float) -> float:
            return 0.0

    bench = pressing()
    bench.controller._loop.feedforward.model = Nonsense()  # type: ignore[assignment]
    assert_faulted(bench, FaultCode.MODEL_INVALID, TICK_S)
