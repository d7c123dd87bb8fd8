"""What to record next: every effect has an experiment that the rig can run, and it shows what a constant force could not."""

import numpy as np
import pytest

from gateway.control.runs.experiment_plan import ExperimentPlan
from gateway.control.runs.experiment_schedule import Schedule, segments_of
from gateway.control.runs.ladder_stairs import check_stairs
from gateway.diagnosis import EFFECTS, Measurement, diagnose
from gateway.diagnosis.experiments.experiments import EXPERIMENTS, plan_for, plan_next
from gateway.diagnosis.result import NotIdentifiable
from gateway.profiles import load_plant, load_rig
from gateway.profiles.kinds.plans import plan_document, plan_of
from gateway.twin import Plant
from gateway.twin.plant import with_value
from gateway.twin.replay.replay import Drive, Replay
from tests.reports.fake_diagnosis import WARMTH, diagnosis

RIG = load_rig("demo")
MODEL, LIMITS = RIG.calibration.model(), RIG.control.limits
HZ = 50.0
SLOW_LAGS = ("transport-delay", "clock-offset", "extra-lag", "viscous-friction", "pressure-lag")


def without(*paths: str) -> Plant:
    plant = load_plant("paper-slide").plant
    for path in paths:
        plant = with_value(plant, *path.split("."), 0.0)
    return plant


PLAIN = without(
    "regulator.delay_s", "regulator.second_lag_s", "regulator.dead_band_pa", "friction.load_dependent_n_per_n"
)


def put_out(plan: ExperimentPlan) -> np.ndarray:
    """command_v as the gateway would record it."""
    schedule = Schedule(segments_of(plan, LIMITS, MODEL), 0.0)
    check = [0.0, *(stair.voltage_v for stair in check_stairs(schedule.top_v, MODEL))]
    times_s = np.arange(round(schedule.duration_s * HZ)) / HZ
    return np.concatenate([np.repeat(check, round(0.6 * HZ)), [schedule.voltage_v(time_s) for time_s in times_s]])


def recorded(plant: Plant, command_v: np.ndarray) -> Measurement:
    time_s = np.arange(command_v.size) / HZ
    response = Replay(Drive(time_s=time_s, command_v=command_v)).run([plant])
    noise = np.random.default_rng(5).normal(size=(2, command_v.size))
    usable = np.ones(command_v.size, dtype=bool)
    return Measurement(
        name="a",
        time_s=time_s,
        force_n=response.reading_n[0] + 0.05 * noise[0],
        usable=usable,
        repeated=~usable,
        command_v=command_v,
        pressure_pa=response.pressure_pa[0] + 300.0 * noise[1],
    )


def test_every_effect_has_an_experiment_that_the_shipped_rig_may_run() -> None:
    assert list(EXPERIMENTS) == [effect.name for effect in EFFECTS]
    for name, experiment in EXPERIMENTS.items():
        plan = plan_for([name]).experiment
        assert plan.shows == (name,)
        assert 10.0 < Schedule(segments_of(plan, LIMITS, MODEL), 0.0).duration_s <= 620.0, name
        assert experiment.parts
        assert plan_of(plan_document(plan)) == plan


def test_what_a_gateway_cannot_do_alone_is_said_and_the_rest_is_still_run() -> None:
    helped = {name for name, experiment in EXPERIMENTS.items() if experiment.apart or experiment.meanwhile}
    assert {"sensor-cubic", "tilt-gravity", "valve-crosstalk", "supply-droop", "sign-loss", "feed-drag"} <= helped
    assert not helped & {*SLOW_LAGS, "dead-band", "presliding", "dwell-stiction", "creep", "leak"}
    for name, experiment in EXPERIMENTS.items():
        missing = set(next(effect for effect in EFFECTS if effect.name == name).needs) - {"command_v"}
        assert missing <= set(experiment.columns), name


def test_a_group_shares_its_blocks_and_begins_with_the_shortest() -> None:
    plan = plan_for(SLOW_LAGS)
    names = [part.name for part in plan.experiment.parts]
    assert len(names) == len(set(names))
    lengths = [part.duration_s for part in plan.experiment.parts]
    assert lengths == sorted(lengths)
    assert plan.total_s == pytest.approx(sum(lengths))
    assert plan.total_s < sum(EXPERIMENTS[name].duration_s for name in SLOW_LAGS)


def test_a_time_limit_takes_what_is_short_and_names_what_is_left_out() -> None:
    plan = plan_for(("dead-band",), besides=("creep", "clock-skew", "slew-limit"), longest_s=100.0)
    assert plan.experiment.shows == ("dead-band", "slew-limit")
    assert [name for name, _ in plan.left_out] == ["creep", "clock-skew"]


@pytest.mark.parametrize("longest_s", [0.0, 60.0, 150.0, 300.0, 600.0])
def test_whatever_is_asked_besides_the_whole_plan_keeps_to_its_time(longest_s: float) -> None:
    alone = [name for name, experiment in EXPERIMENTS.items() if experiment.is_alone]
    plan = plan_for(("dead-band",), besides=alone, longest_s=longest_s)
    assert plan.total_s <= max(longest_s, plan_for(("dead-band",)).total_s)
    assert {*plan.experiment.shows, *(name for name, _ in plan.left_out)} == {*alone}
    for name, _ in plan.left_out:
        more_s = plan_for((*plan.experiment.shows, name)).total_s
        assert more_s > longest_s, f"{name} would have had its time"


def test_what_is_done_by_hand_meanwhile_stands_alone() -> None:
    plan = plan_for(("tilt-gravity", "creep", "valve-crosstalk"))
    assert plan.experiment.shows == ("creep",)
    assert [name for name, _ in plan.left_out] == ["tilt-gravity", "valve-crosstalk"]
    air_off = plan_for(("valve-crosstalk", "tilt-gravity")).experiment
    assert (air_off.shows, air_off.check) == (("valve-crosstalk",), False)
    assert "shut the air off" in air_off.by_hand[0]


def test_no_effect_and_an_unknown_one_are_no_plan() -> None:
    with pytest.raises(ValueError, match="at least one effect"):
        plan_for(())
    with pytest.raises(KeyError):
        plan_for(("ghost",))


def test_after_a_diagnosis_groups_come_first_and_then_what_the_gateway_can_show_alone() -> None:
    unseen = (NotIdentifiable("tilt-gravity", "", ""), NotIdentifiable("dead-band", "", ""))
    plan = plan_next(diagnosis(causes=(WARMTH,), not_identifiable=unseen))
    assert plan is not None
    assert set(plan.experiment.shows) >= {*WARMTH.group}
    assert "tilt-gravity" in dict(plan.left_out)
    alone = plan_next(diagnosis(causes=(), not_identifiable=unseen[:1]))
    assert alone
    assert alone.experiment.shows == ("tilt-gravity",)
    assert plan_next(diagnosis(causes=(), not_identifiable=())) is None


STRONG = {
    "transport-delay": {"regulator.delay_s": 0.06},
    "load-dependent-friction": {"friction.load_dependent_n_per_n": 0.06},
    "dead-band": {"regulator.dead_band_pa": 5000.0},
}


@pytest.mark.long
@pytest.mark.parametrize("name", STRONG)
def test_the_planned_experiment_shows_what_a_constant_force_could_not(name: str) -> None:
    plant = PLAIN
    for path, value in STRONG[name].items():
        plant = with_value(plant, *path.split("."), value)
    before = diagnose([recorded(plant, np.full(1000, 4.0))], PLAIN)
    assert name not in {cause.name for cause in before.causes}
    assert name in {each.name for each in before.not_identifiable}
    after = diagnose([recorded(plant, put_out(plan_for([name]).experiment))], PLAIN)
    assert [cause.name for cause in after.causes] == [name]
    for path, value in STRONG[name].items():
        assert after.causes[0].parameters[path.partition(".")[2]].value == pytest.approx(value, rel=0.35)
