"""The zero of the load cell, as a master takes it: when it is taken, and when it is refused."""

from dataclasses import replace
from random import Random

import pytest

from gateway.codes.faults import FaultCode
from gateway.control import CalibrationInUse, Controller, LineStatus
from gateway.control.settings import Supervision
from gateway.control.supervision.plausibility import ExpectedForce, LeftForce
from gateway.control.tare import Zero
from gateway.registers.words import ControlBit, LimitedBy, State
from tests.control.bench import Bench, bsfm, enabled, settings


def test_a_tare_makes_the_resting_force_zero():
    bench = Bench()
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n + 1.7)
    bench.run(0.3)
    assert bench.last.force_measured_n == pytest.approx(1.7, abs=0.2)
    bench.write(control_word=ControlBit.TARE)
    bench.run(0.1)
    assert bench.last.force_measured_n == pytest.approx(0.0, abs=0.2)
    assert any(event.startswith("tare") for event in bench.events)


def test_a_tare_with_payload_makes_the_contact_force_zero_at_any_tilt():
    bench = Bench()
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n - 5.88)  # 0.6 kg hang on the cell
    bench.write(payload_kg=0.6, control_word=ControlBit.TARE)
    assert bench.refused and bench.refused.text.startswith("tare refused: no fresh")
    assert bench.command.payload_kg == 0.0, "nothing of that write is taken"
    bench.run(0.3)
    bench.write(payload_kg=0.6, control_word=ControlBit.TARE)
    bench.run(0.1)
    assert bench.last.force_measured_n == pytest.approx(0.0, abs=0.2)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_tare_that_would_leave_no_range_to_measure_is_refused_pressed_or_pulled(way):
    bench = Bench()
    rest_n = 0.5 * bench.settings.supervision.saturation_n
    answers = []
    for share in (0.9, 1.1):
        bench.alter_sample = lambda sample, at_n=way * share * rest_n: replace(sample, force_n=sample.force_n + at_n)
        bench.run(0.3)
        bench.write(control_word=ControlBit.TARE)
        answers.append(bench.refused.text if bench.refused else "")
    assert answers[0] == ""
    assert "stuck in contact or wrong cell" in answers[1]


def test_a_tare_under_force_is_refused():
    bench = enabled()
    bench.force(12.0)
    bench.run(1.0)
    output = bench.write(control_word=ControlBit.ENABLE | ControlBit.TARE)
    assert bench.refused and "V are out: disable the output or set the force to 0 first" in bench.refused.text
    assert output.events == ()
    assert bench.run(0.1).force_measured_n == pytest.approx(12.0, abs=1.0)


@pytest.mark.parametrize("has_died", [True, False])
def test_what_a_process_that_died_has_pressed_is_no_zero_though_it_stands_for_its_dead_time(has_died):
    """A tare 0.1 s behind a restart took 39.9 N as zero; up to 15 N nothing told later, and each force was so much more."""
    bench = Bench()
    bench.controller = Controller(bench.settings, CalibrationInUse(bsfm(), 1), unclean_restart=has_died)
    taken = []
    for rest_n, wait_s in ((6.0, 0.1), (1.0, 1.0)):
        bench.alter_sample = lambda sample, rest_n=rest_n: replace(sample, force_n=sample.force_n + rest_n)
        bench.run(wait_s)
        bench.write(control_word=ControlBit.TARE)
        taken.append(round(bench.controller.zero_n))
    assert taken == ([0, 1] if has_died else [6, 1])


@pytest.mark.parametrize(
    ("reads_n", "payload_kg", "is_refused"), [(-6.0, 0.0, True), (-5.88, 0.6, False), (0.0, 0.6, True)]
)
def test_behind_a_death_a_pull_is_no_zero_and_a_payload_that_hangs_is_none_of_it(reads_n, payload_kg, is_refused):
    bench = Bench()
    bench.controller = Controller(bench.settings, CalibrationInUse(bsfm(), 1), unclean_restart=True)
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n + reads_n)
    bench.run(0.1)
    bench.write(payload_kg=payload_kg, control_word=ControlBit.TARE)
    assert ("may be left of what was pressed" in (bench.refused.text if bench.refused else "")) is is_refused


def test_behind_a_death_a_reading_of_nothing_is_a_zero_at_once_and_any_once_all_has_left():
    bench = Bench()
    bench.controller = Controller(bench.settings, CalibrationInUse(bsfm(), 1), unclean_restart=True)
    bench.run(0.1)
    bench.write(control_word=ControlBit.TARE)
    assert bench.refused is None
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n + 6.0)
    lag_s = bench.settings.supervision.response_lag_s
    bench.run(5.0 * lag_s - 0.15)
    bench.write(control_word=ControlBit.TARE)
    assert (
        bench.refused
        and "may be left of what was pressed before the output was heard: wait 0.1 s" in bench.refused.text
    )
    bench.run(0.1)
    bench.write(control_word=ControlBit.TARE)
    assert bench.refused is None and bench.controller.zero_n == pytest.approx(6.0, abs=0.2)


def test_a_tare_of_a_decaying_force_is_refused():
    bench = enabled()
    bench.force(40.0)
    bench.run(1.0)
    bench.disable()
    bench.run(0.15)
    bench.write(control_word=ControlBit.TARE)
    assert bench.refused and "still on their way to 0" in bench.refused.text


@pytest.mark.parametrize(
    ("where", "name", "leaves"),
    [(LeftForce, "rise_n", property(lambda _: 3.0)), (ExpectedForce, "leaving_n", lambda *_: 3.0)],
)
def test_a_tare_waits_for_what_is_expected_and_for_what_may_stand_on_the_output(where, name, leaves, monkeypatch):
    bench = Bench()
    bench.run(1.0)
    monkeypatch.setattr(where, name, leaves)
    bench.write(control_word=ControlBit.TARE)
    assert bench.refused and "about 3.0 N are still on their way to 0" in bench.refused.text


@pytest.mark.parametrize("every_ms", [1, 10, 40])
def test_a_tare_of_a_force_that_decays_more_slowly_than_the_model_is_refused_at_any_rate_of_the_cell(every_ms):
    bench = enabled(lag_s=0.5)
    bench.sample_every_ms = every_ms
    bench.force(40.0)
    bench.run(2.0)
    bench.disable()
    bench.run(0.8)
    assert bench.last.force_measured_n > 6.0
    bench.write(control_word=ControlBit.TARE)
    assert bench.refused and "force not steady" in bench.refused.text
    bench.run(5.0)
    assert bench.write(control_word=ControlBit.TARE) and not bench.refused


def test_a_tare_of_a_frozen_cell_is_refused():
    """Its reading is no zero: once the cell lives again, every force would be wrong by it."""
    bench = Bench(seed=3, noise_n=0.12)
    bench.run(1.0)
    bench.enable(12.0)
    bench.run(6.0)
    bench.cell_frozen = True
    bench.disable()
    bench.run(1.5)
    bench.write(control_word=ControlBit.TARE)
    assert bench.refused and "samples bit for bit" in bench.refused.text and "is no zero" in bench.refused.text
    bench.cell_frozen = False
    bench.run(1.0)
    assert bench.write(control_word=ControlBit.TARE) and not bench.refused


@pytest.mark.parametrize(
    "line", [LineStatus(acknowledged_v=None), LineStatus(acknowledged_v=0.0, fault=FaultCode.OUTPUT_LOST)]
)
def test_a_tare_while_the_output_does_not_answer_is_refused(line):
    """A regulator whose cable is out keeps its voltage: what it presses with would become the zero."""
    bench = Bench(seed=3)
    bench.run(1.0)
    bench.line = line
    bench.output_silent = True
    bench.write(control_word=ControlBit.TARE)
    assert bench.refused and "whether air still presses is not known" in bench.refused.text
    bench.heal()
    bench.run(0.5)
    assert bench.write(control_word=ControlBit.TARE) and not bench.refused


TARE, ENABLE = ControlBit.TARE, ControlBit.ENABLE


@pytest.mark.parametrize(
    ("stuck_shares", "words"),
    [((-2.0, -0.9, 0.9, 1.7), (TARE, ENABLE)), ((-0.9, 0.9), (TARE | ENABLE,)), ((-0.9, 0.9), (ENABLE, TARE | ENABLE))],
    ids=["tare first", "in one write", "while enabled"],
)
def test_behind_a_tare_a_force_goes_as_if_the_cell_had_never_been_off(stuck_shares, words):
    """What was measured before counts by the new zero, too, in whichever order both are asked for."""
    courses = []
    for off_n in (0.0, *(share * settings().supervision.stuck_n for share in stuck_shares)):
        bench = Bench()
        bench.alter_sample = lambda sample, at_n=off_n: replace(sample, force_n=sample.force_n + at_n)
        bench.run(0.5)
        for word in words:
            bench.write(control_word=word)
            assert bench.refused is None
            bench.run(0.01)
        bench.history.clear()
        bench.force(20.0)
        bench.run(0.6)
        assert bench.last.fault is FaultCode.NONE
        courses.append(
            [one.output.voltage_v for one in bench.history] + [one.output.force_measured_n for one in bench.history]
        )
    for course in courses[1:]:
        assert course == pytest.approx(courses[0], abs=1e-6)


def test_the_weight_of_a_command_counts_in_the_step_of_its_arrival():
    bench = Bench()
    bench.run(0.3)
    before_n = bench.last.force_measured_n
    output = bench.write(payload_kg=1.0)
    assert output.force_measured_n - before_n == pytest.approx(9.80665)


def test_a_rig_whose_regulator_rests_above_0_v_is_tared_at_force_0_and_nothing_limits_it():
    """1 to 5 V: enabled, with setpoint 0, a tare was refused for the 1 V that cannot be less, and status_word said limited."""
    rig = settings()
    bench = enabled(replace(rig, limits=replace(rig.limits, voltage_min_v=1.0, safe_voltage_v=1.0)))
    bench.run(1.0)
    assert (bench.last.state, bench.last.voltage_v, bench.last.limited_by) == (State.READY, 1.0, LimitedBy.NONE)
    bench.write(control_word=ControlBit.ENABLE | ControlBit.TARE)
    assert bench.refused is None
    bench.voltage(3.0)
    bench.run(1.0)
    bench.write(control_word=ControlBit.ENABLE | ControlBit.TARE)
    assert bench.refused and "disable the output or set the force to 0 first" in bench.refused.text


def test_a_force_that_the_least_voltage_holds_by_friction_is_no_zero():
    """1 V presses 7 N, and 9 N on the way down take no more: a tare then took those 9 N for zero, and the state was READY."""
    rig = settings()
    bench = enabled(replace(rig, limits=replace(rig.limits, voltage_min_v=1.0, safe_voltage_v=1.0)))
    bench.force(0.1)
    bench.run(1.0)
    assert (bench.last.voltage_v, bench.last.force_applied_n) == (1.0, 0.1)
    bench.write(control_word=ControlBit.ENABLE | ControlBit.TARE)
    assert bench.refused and bench.refused.text == (
        "tare refused: 0.1 N are applied, 1.00 V are out: disable the output or set the force to 0 first"
    )


def test_what_a_tare_under_force_makes_of_a_force_that_leaves_is_no_wrong_sign():
    """The wires, a tilt or something that pulls were blamed: what pressed at the safe voltage was taken for the zero."""
    rig = settings()
    bench = Bench(replace(rig, limits=replace(rig.limits, voltage_min_v=2.0, safe_voltage_v=2.0)))
    bench.run(3.0)
    bench.write(control_word=ControlBit.TARE)
    bench.run(0.5)
    bench.enable(20.0, precontact_force_n=18.0)
    bench.run(2.0)
    bench.plant.contact = False
    bench.run(2.0)
    (told,) = (event for event in bench.events if event.startswith("A302"))
    assert "without its tare the cell reads" in told and "free the tool and tare again" in told
    assert "tilt" not in told


NOISE_N = 0.2


def taken(readings_n) -> list[bool]:
    """Of each trial, whether its last readings are a zero."""
    zero, answers = Zero(Supervision()), []
    for trial in readings_n:
        zero.forget()
        for force_n in trial:
            zero.observe(force_n, 0.01)
        answers.append(not zero.unsteady(0.0))
    return answers


def noisy(shape, noise_n=NOISE_N) -> list[list[float]]:
    """200 trials of 0.2 s each around a force that goes as `shape` from 0 to 1."""
    rng = Random(5)
    return [[2.0 + shape(k / 19.0) + rng.gauss(0.0, noise_n) for k in range(20)] for _ in range(200)]


def test_noise_that_leaves_no_mean_to_rely_on_gives_no_zero():
    assert sum(taken(noisy(lambda share: 0.0, 1.2))) <= 10


def test_a_tare_is_not_refused_for_the_noise_of_the_cell():
    """One in seven was with the 0.12 N of the demo rig's cell, nearly all with 0.2 N: their range goes with the noise."""
    assert sum(taken(noisy(lambda share: 0.0))) >= 190


@pytest.mark.parametrize(
    "shape",
    [lambda share: -1.2 * share, lambda share: 3.0 if 0.4 < share < 0.6 else 0.0, lambda share: 2.0 * (share > 0.9)],
    ids=["falls", "knock", "steps"],
)
def test_what_changes_within_that_noise_is_no_zero_all_the_same(shape):
    assert sum(taken(noisy(shape))) <= 10
