"""The calibration run: stairs end by the data, what a ladder alone can see stops it, and supervision goes on watching."""

import subprocess
import sys
from dataclasses import replace

import pytest

from gateway.codes.faults import FaultCode
from gateway.control import ControlSettings
from gateway.control.runs.ladder_run import MOST_DWELL_S, LadderRow, LadderRun
from gateway.control.runs.ladder_stairs import CalibrationPlan, stairs_of
from gateway.control.sample_conditioning import Reading
from gateway.registers.words import CalibrationPhase, ControlBit, State
from tests.control.bench import Bench, bsfm, settings

SHORT = CalibrationPlan(step_v=2.0, groups=2, minor_points=13, response_steps=3)
LONG_S = 120.0


def begun(bench: Bench, plan: CalibrationPlan = SHORT) -> Bench:
    bench.run(0.5)
    bench.controller.active_run.ask(plan)
    bench.run(0.05)
    return bench


def finished(bench: Bench) -> Bench:
    """Until the run has ended, one way or another, and the output is off."""
    ended = bench.seconds_until(
        lambda output: (
            output.calibration_phase > CalibrationPhase.MINOR_LOOPS and output.state in (State.OFF, State.FAULT)
        ),
        LONG_S,
    )
    assert ended < LONG_S
    return bench


def rows_of(bench: Bench, plan: CalibrationPlan) -> list[LadderRow]:
    begun(bench, plan)
    rows: list[LadderRow] = []
    while bench.controller.active_run.running:
        bench.run(0.01)
        row = bench.controller.active_run.last_row
        if row and row not in rows[-1:]:
            rows.append(row)
    bench.run(0.5)
    return rows


def roomy() -> ControlSettings:
    """Of a rig whose plant stays below its largest force all the way up."""
    control = settings()
    return replace(control, limits=replace(control.limits, force_max_n=54.0, over_force_n=55.0))


def test_a_whole_run_visits_every_stair_and_ends_off_at_the_safe_voltage() -> None:
    bench = Bench(roomy(), seed=3)
    rows = rows_of(bench, SHORT)
    assert [row.stair for row in rows] == list(stairs_of(SHORT, bench.settings.limits, bsfm()))
    assert all(row.settled for row in rows)
    assert bench.last.calibration_phase == CalibrationPhase.FITTING
    assert bench.last.calibration_progress == 1.0
    assert (bench.last.state, bench.last.voltage_v) == (State.OFF, 0.0)
    assert any(event.startswith("calibration ladder done") for event in bench.events)


def test_forces_are_those_of_the_plant_at_rest() -> None:
    rows = rows_of(Bench(seed=4, noise_n=0.05), SHORT)
    for row in rows:
        drive_n = 7.4 * row.stair.voltage_v
        friction_n = min(2.0, 0.25 * drive_n)
        assert drive_n - friction_n - 0.35 <= row.force_n <= drive_n + friction_n + 0.35


def test_a_slower_plant_gets_longer_dwells() -> None:
    quick, slow = (rows_of(Bench(seed=5, lag_s=lag_s), SHORT) for lag_s in (0.03, 0.2))
    mean_s = [sum(row.dwell_s for row in rows) / len(rows) for rows in (quick, slow)]
    assert mean_s[0] < 0.5 < 0.9 < mean_s[1] < MOST_DWELL_S


def test_a_stair_that_never_settles_is_left_after_its_time_and_counted() -> None:
    run, k = LadderRun(SHORT, settings(), bsfm()), 0
    while not run.is_done:
        k += 1
        rest = run.stairs[run.done].voltage_v * 7.0 if k > 100 else 0.0
        drifting_n = rest + (0.05 * (k % 200) if k > 100 else 0.0)
        step = run.step(0.01 * k, Reading(drifting_n, drifting_n, 0.0, 0.01, True, True, True))
        if step.row and not step.row.settled:
            assert step.row.dwell_s == pytest.approx(MOST_DWELL_S, abs=0.02)
    assert run.unsettled >= len(run.stairs) - 5


def test_progress_never_falls_and_the_eta_reaches_the_end() -> None:
    bench = begun(Bench(seed=6))
    calibrating, began_s = bench.controller.active_run, bench.now_s
    progress, etas = [], []
    while calibrating.running:
        bench.run(0.1)
        progress.append(bench.last.calibration_progress)
        etas.append((bench.now_s - began_s, calibrating.eta_s))
    total_s = bench.now_s - began_s
    assert progress == sorted(progress)
    at_s, eta_s = etas[len(etas) // 2]
    assert at_s + eta_s == pytest.approx(total_s, rel=0.15)


def test_bit_5_starts_it_and_clearing_it_ends_it_along_the_ramp() -> None:
    bench = Bench(seed=7)
    bench.run(0.5)
    assert "calibration begun by 10.0.0.5" in bench.write(control_word=ControlBit.START_CALIBRATION).events
    bench.run(4.0)
    assert bench.last.state is State.CALIBRATING
    standing_v, standing_n = bench.last.voltage_v, bench.last.force_applied_n
    assert standing_v > 1.5
    output = bench.write(control_word=ControlBit(0))
    assert output.calibration_phase == CalibrationPhase.STOPPED
    assert (output.state, output.voltage_v) == (State.CALIBRATING, pytest.approx(standing_v, abs=0.35))
    took_s = bench.seconds_until(lambda output: output.state is State.OFF, 2.0)
    assert took_s == pytest.approx(standing_n / bench.settings.defaults.force_ramp_n_per_s, abs=0.02)
    assert bench.last.voltage_v == 0.0


def test_disable_ends_it_too() -> None:
    bench = Bench(seed=8)
    bench.run(0.5)
    bench.write(control_word=ControlBit.ENABLE | ControlBit.START_CALIBRATION)
    bench.run(4.0)
    assert bench.last.state is State.CALIBRATING
    output = bench.write(control_word=ControlBit.START_CALIBRATION)
    assert (output.state, output.voltage_v) == (State.OFF, 0.0)


def test_the_end_clears_the_command_so_that_the_master_sees_the_bit_fall() -> None:
    bench = Bench(seed=9)
    bench.run(0.5)
    bench.controller.active_run.ask(SHORT)
    finished(bench)
    bench.run(0.1)
    assert bench.command.control_word == ControlBit(0)


def test_while_holding_a_force_it_is_refused_and_the_force_stays() -> None:
    bench = Bench(seed=10)
    bench.run(0.5)
    bench.enable(20.0)
    bench.run(2.0)
    held_v = bench.voltage_v
    bench.write(control_word=ControlBit.ENABLE | ControlBit.START_CALIBRATION)
    assert bench.refused
    assert bench.refused.text.startswith("calibration refused: ")
    bench.run(3.0)
    assert bench.last.state is State.HOLDING
    assert not bench.controller.active_run.running
    assert bench.voltage_v == pytest.approx(held_v, abs=0.2)


def test_a_latched_fault_refuses_it() -> None:
    bench = begun(Bench(seed=11))
    bench.run(2.0)
    bench.cell_silent = True
    bench.run(0.5)
    assert bench.last.fault is FaultCode.SAMPLE_STALE
    bench.write(control_word=ControlBit(0))
    bench.write(control_word=ControlBit.START_CALIBRATION)
    assert not bench.controller.active_run.running
    assert bench.last.state is State.FAULT


@pytest.mark.parametrize(
    ("plant", "fault", "code"),
    [
        ({"sign": -1.0}, FaultCode.SIGN_INVERTED, "A302"),
        ({"unit": 5.0}, FaultCode.GAIN_WRONG, "A303"),
        ({"unit": 0.2}, FaultCode.GAIN_WRONG, "A303"),
        ({"air": False}, FaultCode.NONE, "A301"),
        ({"contact": False}, FaultCode.NONE, "A301"),
        ({"unit": 0.0, "noise_n": 0.0}, FaultCode.NONE, "A301"),
    ],
)
def test_wrong_sign_wrong_scale_and_no_answer_stop_it_in_the_check(plant, fault, code) -> None:
    bench = finished(begun(Bench(seed=12, **plant)))
    assert bench.last.fault is fault
    assert bench.last.calibration_phase == CalibrationPhase.STOPPED
    assert bench.last.voltage_v == 0.0
    (told,) = [event for event in bench.events if event.startswith(code)]
    assert ("cell or amplifier dead, else no air" in told) is (plant.get("noise_n") == 0.0), "it blamed the air alone"
    assert max(volts for _, volts in bench.voltages()) < 4.1


def test_over_force_acts_during_the_run() -> None:
    bench = begun(Bench(seed=13))
    bench.run(5.0)
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n + 60.0)
    finished(bench)
    assert bench.last.fault is FaultCode.OVER_FORCE
    assert bench.last.state is State.FAULT


def test_the_rise_of_the_voltage_keeps_the_slew_limit() -> None:
    control = settings()
    bench = Bench(replace(control, limits=replace(control.limits, voltage_slew_v_per_s=20.0)), seed=14)
    finished(begun(bench))
    for (earlier_s, earlier_v), (later_s, later_v) in zip(history := list(bench.voltages()), history[1:], strict=False):
        assert later_v - earlier_v <= 20.0 * (later_s - earlier_s + 0.01) + 1e-9


def test_a_local_run_needs_no_heartbeat_but_the_masters_own_does() -> None:
    leased = settings(lease_s=0.2)
    local = finished(begun(Bench(leased, seed=15)))
    assert local.last.fault is FaultCode.NONE
    masters = Bench(leased, seed=15)
    masters.run(0.5)
    masters.write(control_word=ControlBit.START_CALIBRATION, heartbeat=1)
    masters.run(1.0)
    assert masters.last.fault is FaultCode.MASTER_LOST


def test_behind_a_local_run_a_lost_master_is_a_loss_again() -> None:
    """What needed no master is over: the next force is a master's, and its lease counts; so does nothing that a run saw."""
    bench = begun(Bench(settings(lease_s=0.2), seed=15))
    run = bench.controller.active_run
    ceiling = run._ceiling
    for _ in range(2):
        bench.run(2.0)
        run.ask_stop("calibration stopped by a person")
        bench.run(1.0)
        assert bench.last.state is State.OFF and not run.is_local
        begun(bench)
        assert run.is_local and run._ceiling is not ceiling
    run.ask_stop("calibration stopped by a person")
    bench.run(1.0)
    bench.heartbeat_every_ms = 50
    bench.run(0.3)
    bench.enable(12.0)
    bench.run(1.0)
    assert bench.last.state is State.HOLDING
    bench.heartbeat_every_ms = 0
    bench.run(0.3)
    assert bench.last.fault is FaultCode.MASTER_LOST


def test_a_stop_of_the_service_ends_it() -> None:
    bench = begun(Bench(seed=16))
    bench.run(3.0)
    bench.controller.stop()
    bench.run(0.4)
    assert bench.controller.has_stopped
    assert bench.last.voltage_v == 0.0


@pytest.mark.parametrize("tare", [True, False])
def test_a_tare_is_taken_before_the_ladder_where_it_is_asked_for(tare: bool) -> None:
    bench = Bench(seed=3)
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n + 1.7)
    begun(bench, replace(SHORT, tare=tare))
    assert (bench.last.calibration_phase, bench.last.voltage_v) == (CalibrationPhase.ZERO, 0.0)
    assert bench.controller.active_run.cell_n == pytest.approx(0.0 if tare else 1.7, abs=0.2)
    assert any(event.startswith("tare") for event in bench.events) == tare


def test_an_asked_stop_keeps_what_was_learned_and_says_so() -> None:
    bench = begun(Bench(seed=17))
    bench.run(3.0)
    bench.controller.active_run.ask_stop("calibration stopped by a person")
    bench.run(0.4)
    assert bench.last.calibration_phase == CalibrationPhase.STOPPED
    assert bench.last.state is State.OFF
    assert "calibration stopped by a person" in bench.events


def test_control_still_imports_no_numpy() -> None:
    code = "import sys, gateway.control; assert 'numpy' not in sys.modules"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_beyond_the_calibrations_own_range_the_force_is_expected_to_go_on_rising() -> None:
    limits = replace(settings().limits, over_force_n=60.0)
    assert bsfm().voltage_range_v[1] == 8.0
    with pytest.raises(ValueError, match="makes 63 N"):
        stairs_of(CalibrationPlan(v_max_v=8.9), limits, bsfm())


@pytest.mark.parametrize(("noise_n", "is_told"), [(0.005, True), (0.12, False)])
def test_a_run_tells_when_the_cell_has_too_little_noise_to_be_found_frozen(noise_n: float, is_told: bool) -> None:
    bench = finished(begun(Bench(seed=9, noise_n=noise_n), SHORT))
    told = [event for event in bench.events if event.startswith("W234 ")]
    assert bool(told) == is_told
    assert all("a frozen load cell would be found never" in event for event in told)
