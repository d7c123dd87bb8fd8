"""The catalogue is a contract: 45 names, each with parameters that the plant has, and null means off."""

from collections.abc import Iterator

import numpy as np
import pytest

from gateway.catalogue.effect import By
from gateway.diagnosis import BY_NAME, EFFECTS, Effect, Parameter
from gateway.twin.plant import Plant, values
from tests.diagnosis.hidden import BY_NAME as EXAMPLES
from tests.diagnosis.machine import LOGGED, MACHINE, command_v, plant, readings_n, times_s

NAMES = """
transport-delay extra-lag dead-band regulator-hysteresis command-quantisation command-nonlinearity supply-saturation
supply-droop leak regulator-hunting slew-limit
coulomb-friction stribeck-friction viscous-friction presliding load-dependent-friction asymmetric-friction dwell-stiction
creep contact-nonlinearity end-stop side-load tilt-gravity feed-drag spindle-vibration pad-wear position-dependence
position-ripple backlash
thermal-zero-drift thermal-span-drift warm-up linear-drift sensor-quadratic sensor-cubic mains-hum clock-offset clock-skew
repeated-samples outliers sensor-quantisation valve-crosstalk sign-loss
position-dependent-friction pressure-lag
""".split()
FAMILIES = {"regulator": 11, "cylinder": 9, "contact and tool": 11, "sensing and logging": 14}
INDISTINGUISHABLE = (
    ("regulator-hysteresis", "coulomb-friction"),
    ("transport-delay", "clock-offset", "extra-lag", "viscous-friction", "pressure-lag"),
    ("linear-drift", "pad-wear", "warm-up", "creep", "thermal-zero-drift"),
    ("sensor-quadratic", "sensor-cubic", "supply-saturation", "contact-nonlinearity"),
    ("coulomb-friction", "viscous-friction", "presliding"),
    ("end-stop", "supply-saturation"),
    ("stribeck-friction", "presliding"),
    ("leak", "warm-up"),
    ("backlash", "sign-loss"),
)
COMPENSATED = {
    By.TIMING: "transport-delay extra-lag",
    By.COMMAND: "command-nonlinearity",
    By.MODEL: "regulator-hysteresis coulomb-friction presliding load-dependent-friction asymmetric-friction "
    "contact-nonlinearity backlash",
    By.CELL: "thermal-zero-drift thermal-span-drift sensor-quadratic sensor-cubic valve-crosstalk",
    By.OUTSIDE: "tilt-gravity feed-drag",
}
SIZES = """
delay_s second_lag_s dead_band_pa hysteresis_pa command_step_v supply_pa ceiling_pa leak_per_s leak_flow_pa hunting_pa
slew_pa_per_s coulomb_n stribeck_n dwell_stiction_n viscous_n_s_per_m presliding_m load_dependent_n_per_n stroke_m
stop_stiffness_n_per_mm side_load_n_s_per_mm side_load_n_per_n side_load_tilt_n side_load_n_per_mm tilt_n spindle_n
spindle_n_per_krpm2 ripple_n lost_n hum_n sign_lost chamber_lag_s
""".split()
"""Widths, times, amplitudes and bounds, of which there is none below 0; all else may be one way or the other."""
WORDS = ("family", "what", "signature", "excitation", "experiment")
UNITS = {
    "_pa": "Pa", "_s": "s", "_v": "V", "_hz": "Hz", "_rad": "rad", "_deg": "deg", "_m": "m", "_m2": "m2", "_n": "N",
    "_mm": "mm", "_per_s": "1/s", "_per_m": "1/m", "_per_k": "1/K", "_per_n": "1/N", "_n_per_n": "N/N", "_n_per_k": "N/K",
    "_per_n2": "1/N2", "_m_per_s": "m/s", "_pa_per_s": "Pa/s", "_n_per_s": "N/s", "_n_s_per_m": "N s/m", "_per_pa": "1/Pa",
    "_pa_per_pa": "Pa/Pa", "_n_per_mm": "N/mm", "_n_per_mm2": "N/mm2", "_n_s_per_mm": "N s/mm", "_n_per_m": "N/m",
    "_n_per_krpm2": "N/krpm2", "_n_per_v": "N/V",
}  # fmt: skip


def parameters() -> Iterator[tuple[Effect, Parameter]]:
    for effect in EFFECTS:
        for parameter in effect.parameters:
            yield effect, parameter


def test_the_names_are_those_of_the_contract() -> None:
    assert sorted(effect.name for effect in EFFECTS) == sorted(NAMES)
    assert len(EFFECTS) == 45
    assert [BY_NAME[name].name for name in NAMES] == NAMES


def test_each_effect_is_compensated_by_the_part_of_control_that_can() -> None:
    """A bent contact that is counted with the cell bends the readings of a good one."""
    found = {by: {one.name for one in EFFECTS for each in one.treatments if each.by is by} for by in COMPENSATED}
    assert found == {by: set(names.split()) for by, names in COMPENSATED.items()}


def test_what_is_no_size_is_tried_either_way() -> None:
    """A cable that couples the command in with its wires exchanged takes from the reading."""
    fitted = {one.name: one for effect in EFFECTS for form in effect.forms for one in form.parameters if not one.shape}
    assert {name for name, one in fitted.items() if one.low != -one.high} == set(SIZES)


def test_families_have_the_size_of_the_contract() -> None:
    counts = {name: sum(effect.family == name for effect in EFFECTS) for name in FAMILIES}
    assert counts == FAMILIES


@pytest.mark.parametrize("word", WORDS)
def test_every_effect_has_its_words(word: str) -> None:
    for effect in EFFECTS:
        text = getattr(effect, word)
        assert text.strip() == text and len(text) >= (3 if word in ("what", "excitation") else 8), (effect.name, word)
        assert not text.endswith(".") and "\n" not in text, (effect.name, word)


def test_no_two_effects_are_described_alike() -> None:
    assert len({effect.what for effect in EFFECTS}) == len(EFFECTS)
    assert len({effect.signature for effect in EFFECTS}) == len(EFFECTS)


def test_groups_name_other_effects() -> None:
    for effect in EFFECTS:
        assert set(effect.group) <= set(NAMES), effect.name
        assert len(set(effect.group)) == len(effect.group), effect.name


@pytest.mark.parametrize("group", INDISTINGUISHABLE, ids=lambda group: group[0])
def test_what_a_recording_cannot_tell_apart_is_known_both_ways(group: tuple[str, ...]) -> None:
    for name in group:
        assert set(group) - {name} <= set(BY_NAME[name].group), name


def test_every_effect_has_a_parameter_and_a_way_to_be_told() -> None:
    for effect in EFFECTS:
        assert effect.parameters, effect.name
        assert effect.direct == (not effect.forms) == bool(effect.marks), effect.name
        assert not all(parameter.shape for parameter in effect.parameters), effect.name


def test_every_parameter_is_a_field_of_the_plant_with_that_null() -> None:
    """A shape has no effect of its own: its null is where a plant begins."""
    nulls = {f"{section}.{name}": value for section, name, value in values(Plant())}
    for effect, parameter in parameters():
        assert parameter.path in nulls, (effect.name, parameter.path)
        assert parameter.null == nulls[parameter.path], (effect.name, parameter.path)


def test_every_parameter_says_its_unit_as_its_name_does() -> None:
    for effect, parameter in parameters():
        ends = [end for end in UNITS if parameter.name.endswith(end)]
        expected = UNITS[max(ends, key=len)] if ends and parameter.name != "command_s" else "1"  # an S, no second
        assert parameter.unit == expected, (effect.name, parameter.path)


def test_bounds_hold_the_null_and_a_step_moves_within_them() -> None:
    for effect, parameter in parameters():
        holds = parameter.low <= parameter.null <= parameter.high
        assert holds or parameter.shape, (effect.name, parameter.path)  # a shape begins where a start puts it
        assert 0.0 < parameter.step < parameter.high - parameter.low, (effect.name, parameter.path)


def test_needs_are_columns_that_a_recording_may_have() -> None:
    for effect in EFFECTS:
        for form in effect.forms:
            assert set(form.needs) <= {*LOGGED, "command_v", "pressure_kpa"}, effect.name


def test_the_examples_are_of_all_effects_and_use_their_parameters() -> None:
    assert sorted(EXAMPLES) == sorted(NAMES)
    for name, example in EXAMPLES.items():
        own = {parameter.path for parameter in BY_NAME[name].parameters}
        assert set(example.changes) <= own, name
        assert set(example.expected) <= {path.split(".")[1] for path in own}, name


TIME_S = times_s(15.0, 100.0)
COLUMNS = {name: make(TIME_S) for name, make in LOGGED.items()}
VOLTS = command_v(TIME_S)


def test_off_equals_absent() -> None:
    """All sizes at null, whatever the shapes: bit by bit the readings of a machine that has none of it."""
    absent = readings_n(MACHINE, TIME_S, VOLTS, {})
    for effect in EFFECTS:
        taken = {"cell.zero_n", *(["friction.coulomb_n"] if effect.name == "coulomb-friction" else [])}  # the machine's
        off = {
            each.path: each.low + 0.3 * (min(each.high, 10.0) - each.low) if each.shape else each.null
            for each in effect.parameters
            if each.path not in taken
        }
        found = readings_n(plant(off), TIME_S, VOLTS, COLUMNS)
        np.testing.assert_array_equal(found, absent, err_msg=effect.name)


def test_on_is_seen() -> None:
    """Each example changes the readings; the three that only chance makes are in the readings themselves."""
    for name, example in EXAMPLES.items():
        if not BY_NAME[name].direct:
            around = plant(example.around)
            before = readings_n(around, TIME_S, VOLTS, COLUMNS)
            after = readings_n(plant(example.changes, around), TIME_S, VOLTS, COLUMNS)
            assert float(np.sqrt(np.mean((after - before) ** 2))) > 0.02, name
