"""Runs on a rig whose safe voltage presses: it is the integrator's choice, and everything begins and ends there."""

from dataclasses import replace

import pytest

from gateway.bsfm import Bsfm
from gateway.control import CalibrationInUse, Controller
from gateway.control.messages import tare_sentence
from gateway.control.runs.active_run import RecordedPlan
from gateway.control.runs.experiment_plan import Move, MoveKind
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.registers.words import CalibrationPhase, ControlBit, State
from tests.control.bench import Bench, bsfm, settings
from tests.control.runs.test_experiment import begun, plan
from tests.control.test_slip import slip

SAFE_V = 0.55
LOW = plan(Move(do=MoveKind.STEP, to_v=4.0, hold_s=0.3), check=True)
LADDER = CalibrationPlan(step_v=2.0, groups=1, minor_points=0)


@pytest.mark.parametrize(
    ("asked", "end"), [(LOW, CalibrationPhase.RECORDED), (LADDER, CalibrationPhase.FITTING)], ids=["low", "ladder"]
)
def test_a_run_makes_its_whole_check_and_comes_to_its_end(asked: RecordedPlan, end: CalibrationPhase) -> None:
    """It was told that a volt more would pass the rig's largest force (A350), and stopped, or went on unchecked."""
    rig = settings()
    bench = Bench(
        replace(rig, limits=replace(rig.limits, safe_voltage_v=SAFE_V, voltage_min_v=SAFE_V)), seed=5, gain_n_per_v=6.8
    )
    bench.voltage_v = SAFE_V
    bench.run(1.0)
    begun(bench, asked)  # type: ignore[arg-type]
    assert bench.seconds_until(lambda output: output.state is State.OFF, 40.0) < 40.0
    assert bench.last.calibration_phase == end and not [event for event in bench.events if "A350" in event]
    assert bench.last.voltage_v == SAFE_V == min(volts for _, volts in bench.voltages())


@pytest.mark.parametrize("payload_kg", [0.0, 0.6])
def test_the_highest_level_of_a_plan_leaves_room_for_the_payload(payload_kg: float) -> None:
    """Its weight presses, too: each plan that goes near the top was stopped in its check (A350)."""
    rig = settings()
    rig = replace(rig, defaults=replace(rig.defaults, payload_kg=payload_kg))
    bench = begun(
        Bench(rig, seed=5, gain_n_per_v=6.8), plan(Move(do=MoveKind.STEP, to_share=1.0, hold_s=0.3), check=True)
    )
    assert bench.seconds_until(lambda output: output.state is State.OFF, 40.0) < 40.0
    assert bench.last.calibration_phase == CalibrationPhase.RECORDED
    assert max(record.force_n for record in bench.history) + 9.81 * payload_kg < rig.limits.force_max_n
    beyond = plan(Move(do=MoveKind.STEP, to_v=6.9, hold_s=0.3))
    refused = bench.controller.refusal_of_run(bench.now_s, beyond)
    assert ("of which the payload presses 5.9 N" in refused) is bool(payload_kg)


@pytest.mark.parametrize("model", [bsfm(), slip()], ids=["blend", "slip"])
@pytest.mark.parametrize(("safe_v", "is_told"), [(0.0, False), (2.0, True)])
def test_a_zero_that_may_be_what_presses_at_the_safe_voltage_is_told_as_such(
    safe_v: float, is_told: bool, model: Bsfm
) -> None:
    """Each force behind it would be so much more, with a word from nobody; by a model with slip stops it was refused for ever,
    because what friction keeps was on its way to 0."""
    rig = settings(stuck_n=30.0)
    bench = Bench(replace(rig, limits=replace(rig.limits, safe_voltage_v=safe_v)), seed=6)
    bench.controller = Controller(bench.settings, CalibrationInUse(model, 1))
    bench.voltage_v = safe_v
    bench.run(1.5)
    bench.write(control_word=ControlBit.TARE)
    (told,) = [event for event in bench.events if event.startswith("tare: zero at")]
    assert ("press at the safe voltage: if the tool touches, lift it" in told) is is_told


@pytest.mark.parametrize(("zero_n", "is_told"), [(1.9, False), (2.1, True), (5.9, True), (6.1, False)])
def test_a_zero_that_is_no_such_force_is_not_told_as_one(zero_n: float, is_told: bool) -> None:
    assert ("4.0 N press at the safe voltage" in tare_sentence(zero_n, 4.0)) is is_told
