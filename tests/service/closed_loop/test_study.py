"""The loop closes: what an extended plant is worth in commanded force, effect by effect, on the twin.

Each effect alone on the paper's slide, large enough to be felt; the ratios are printed (`pytest -rP`). One seed each, for time;
the last tests run several.
"""

from functools import reduce

import pytest

from gateway.control import NO_COMPENSATION, CellMap
from gateway.profiles import load_plant, load_rig
from gateway.profiles.rigs.compensated_effects import ALL_INPUTS, compensation_of
from gateway.service.closed_loop import identified_model
from gateway.service.closed_loop.identified_model import identify_model, quasi_static
from gateway.service.closed_loop.study import HEADROOM, ClosedLoopGain, closed_loop_gain, format_gain
from gateway.twin import Plant, Twin
from gateway.twin.plant import with_value
from gateway.twin.surroundings import Surroundings

BASE = load_plant("paper-slide").plant
DEMO = load_rig("demo")


def plant_with(**values: float) -> Plant:
    """Keys are section__field."""
    return reduce(lambda plant, item: with_value(plant, *item[0].split("__"), item[1]), values.items(), BASE)


def gain(extended: Plant, **options: object) -> ClosedLoopGain:
    return closed_loop_gain(BASE, extended, DEMO, seeds=[0], **options)  # type: ignore[arg-type]


# effect, its numbers, largest allowed ratio of the error after to before
OF_EACH_KIND = [  # a told input, the command, the model, the timing
    ("thermal-zero-drift", {"cell__zero_n_per_k": 0.15}, 0.3),
    ("command-nonlinearity", {"regulator__command_bow": 0.06}, 0.5),
    ("coulomb-friction", {"friction__coulomb_n": 3.0}, 0.5),
    ("transport-delay", {"regulator__delay_s": 0.25}, 0.3),
]
ALL_OTHERS = [
    ("tilt-gravity", {"contact__tilt_n": 4.0}, 0.5),
    ("feed-drag", {"contact__feed_drag_n": 1.5}, 0.8),  # each turn of the feed is felt before the pressure can follow
    ("thermal-span-drift", {"cell__span_per_k": 0.005}, 0.4),
    ("sensor-quadratic", {"cell__quadratic_per_n": 0.002}, 0.4),
    ("sensor-cubic", {"cell__cubic_per_n2": 5.0e-5}, 0.45),
    ("valve-crosstalk", {"cell__crosstalk_n_per_v": 0.4}, 0.4),
    ("command-nonlinearity", {"regulator__command_s": 0.05}, 0.65),
    ("load-dependent-friction", {"friction__load_dependent_n_per_n": 0.12}, 0.5),
    ("presliding", {"friction__presliding_m": 5.0e-5}, 0.8),  # the model's stops are softer than such a seal
    ("extra-lag", {"regulator__second_lag_s": 0.25}, 0.3),
]


def assert_force_is_better(name, numbers, largest):
    found = gain(plant_with(**numbers))
    print(f"{name}: {found.before_rms_n:.3f} -> {found.after_rms_n:.3f} N RMS, ratio {found.rms_ratio:.2f}")
    assert found.compensated == (name,)
    assert found.not_compensated == ()
    assert found.after_faults == ()
    assert found.rms_ratio < largest


@pytest.mark.sampled
@pytest.mark.parametrize(("name", "numbers", "largest"), OF_EACH_KIND, ids=[name for name, _, _ in OF_EACH_KIND])
def test_a_known_effect_costs_less_force(name, numbers, largest):
    assert_force_is_better(name, numbers, largest)


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "numbers", "largest"), ALL_OTHERS, ids=[f"{name} {next(iter(numbers))}" for name, numbers, _ in ALL_OTHERS]
)
def test_every_other_known_effect_costs_less_force(name, numbers, largest):
    assert_force_is_better(name, numbers, largest)


def test_what_cannot_be_compensated_is_listed_with_its_reason_and_changes_nothing():
    found = gain(plant_with(contact__spindle_n=1.0))
    ((name, why),) = found.not_compensated
    assert name == "spindle-vibration"
    assert "faster than the regulator" in why
    assert found.before_rms_n == found.after_rms_n
    assert found.rms_ratio_ci95 == (1.0, 1.0)


def test_the_same_plant_gives_the_same_error_twice():
    found = gain(BASE)
    assert (found.compensated, found.not_compensated) == ((), ())
    assert (found.before_rms_n, found.before_max_n) == (found.after_rms_n, found.after_max_n)
    assert found.before_rms_n < 0.4


@pytest.mark.long
def test_an_input_that_nobody_gives_leaves_its_effect_and_says_so():
    extended = plant_with(cell__zero_n_per_k=0.15)
    without = gain(extended, inputs=("tilt_deg",))
    assert without.not_compensated == (
        ("thermal-zero-drift", "needs temperature_c, which nobody tells the controller"),
    )
    assert without.after_rms_n == pytest.approx(without.before_rms_n, rel=1e-9)


@pytest.mark.long
def test_several_at_once_with_an_interval_over_seeds():
    """The friction is that of the test above: its model has been identified."""
    extended = plant_with(contact__tilt_n=3.0, cell__quadratic_per_n=0.0015, friction__coulomb_n=3.0)
    found = closed_loop_gain(BASE, extended, DEMO, seeds=[7, 8])
    assert set(found.compensated) == {"tilt-gravity", "sensor-quadratic", "coulomb-friction"}
    assert found.seeds == (7, 8)
    low, high = found.rms_ratio_ci95
    assert low <= found.rms_ratio <= high < 0.7
    told = format_gain(found)
    assert told[0].endswith(f" makes it better: {found.before_rms_n:.2f} N before, {found.after_rms_n:.2f} N after")
    assert told[1].endswith(", 2 seeds")
    assert "tilt-gravity" in "\n".join(told)


@pytest.mark.parametrize("turn_stairs", [0, pytest.param(identified_model.TURN_STAIRS, marks=pytest.mark.long)])
def test_a_plant_without_a_model_keeps_the_one_before_and_says_so(turn_stairs, monkeypatch):
    """No air: nothing a ladder could identify, however many stairs it leaves out after a turn: each more is seconds of fits."""
    monkeypatch.setattr(identified_model, "TURN_STAIRS", turn_stairs)
    found = gain(plant_with(regulator__supply_pa=5.0e4, friction__coulomb_n=1.5))
    told = dict(found.not_compensated)
    assert "the extended plant gives no model" in told["coulomb-friction"]
    assert "no more pressure" in told["supply-saturation"]


def test_plants_that_rest_alike_share_one_model():
    top_v = HEADROOM * DEMO.control.limits.voltage_max_v  # as every study asks, so that the model is there
    other = plant_with(contact__tilt_n=3.0, cell__noise_n=0.5, regulator__delay_s=0.2)
    assert identify_model(other, top_v) is identify_model(BASE, top_v)
    assert quasi_static(BASE) == quasi_static(quasi_static(BASE))


@pytest.mark.parametrize(
    "numbers",
    [
        {"cell__quadratic_per_n": 0.003, "cell__cubic_per_n2": 2.0e-5},
        {"cell__span_per_k": 0.01, "cell__zero_n_per_k": 0.2},
        {"cell__crosstalk_n_per_v": 0.4},
    ],
)
def test_the_inverse_of_the_cell_undoes_what_the_twins_cell_does(numbers):
    """Forward by the twin, backward by control: the two know nothing of each other."""
    extended = plant_with(cell__noise_n=0.0, cell__filter_s=0.0, cell__quantum_n=0.0, **numbers)
    twin, cell = Twin(extended, 0), compensation_of(BASE, extended, ALL_INPUTS).cell
    assert isinstance(cell, CellMap)
    for voltage_v, temperature_c in ((2.0, 20.0), (5.0, 31.0), (3.5, 12.0)):
        twin.set_surroundings(Surroundings(temperature_c=temperature_c))
        twin.command(voltage_v)
        twin.advance(1.0)
        assert cell.force_n(twin.read(), temperature_c, voltage_v) == pytest.approx(twin.force_n, abs=1e-6)


def test_a_straightened_command_reaches_the_pressure_of_a_straight_regulator():
    bent, straight = (
        Twin(
            plant_with(
                regulator__command_step_v=0.0, regulator__dead_band_pa=0.0, regulator__hysteresis_pa=0.0, **numbers
            ),
            0,
        )
        for numbers in ({"regulator__command_bow": 0.07, "regulator__command_s": -0.03}, {})
    )
    command = compensation_of(BASE, bent.plant).command
    assert command
    for voltage_v in (1.0, 4.0, 7.5, 2.0):
        straight.command(voltage_v)
        bent.command(command.sent_v(voltage_v))
        straight.advance(2.0)
        bent.advance(2.0)
        assert bent.pressure_pa == pytest.approx(straight.pressure_pa, abs=1.0)


def test_equal_plants_give_the_null_compensation():
    assert compensation_of(BASE, BASE, ALL_INPUTS, new_model=True) == NO_COMPENSATION


@pytest.mark.parametrize(
    ("interval", "said"),
    [((0.5, 0.8), "makes it better"), ((0.97, 1.02), "gains nothing certain"), ((1.1, 1.3), "makes it worse")],
)
def test_the_answer_says_no_more_than_its_interval(interval, said):
    found = ClosedLoopGain(
        before_rms_n=0.58, after_rms_n=0.59, before_max_n=1.5, after_max_n=1.5, before_settled_s=0.4, after_settled_s=0.4,
        rms_ratio=1.0, rms_ratio_ci95=interval, seeds=(0, 1), compensated=(), not_compensated=(),
    )  # fmt: skip
    answer = f"to compensate what was found {said}: 0.58 N before, 0.59 N after"
    assert format_gain(found)[0] == f"Error of the commanded force, on the twin: {answer}"
