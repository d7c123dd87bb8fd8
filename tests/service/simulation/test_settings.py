"""What `sim set` takes: names, values and bounds, and what a plant becomes by them."""

import re
from pathlib import Path

import pytest

from gateway.catalogue.all_effects import BY_NAME, EFFECTS
from gateway.profiles import load_rig
from gateway.service.simulation.demonstration import DEMONSTRATIONS
from gateway.service.simulation.kept_settings import KeptSettings
from gateway.service.simulation.requests import SimulationRequests
from gateway.service.simulation.setting_names import (
    FAULTS,
    SURROUNDINGS,
    effect_settings,
    find_unit,
    list_cleared_names,
    parse_assignment,
)
from gateway.service.simulation.settings import SimulationSettings
from gateway.service.socket_requests import SimulationRequest
from tests.service.rigs import demo

PAGE = Path(__file__).parents[3] / "gateway" / "service" / "simulation" / "README.md"


def setting(**values: object) -> SimulationSettings:
    """Settings by name, `__` for the dot and `_` for the dash of an effect."""
    named = {name.replace("__", "."): value for name, value in values.items()}
    return SimulationSettings().changed(SimulationRequest(set=named))  # type: ignore[arg-type]


def test_every_effect_of_the_catalogue_has_a_demonstration_within_its_bounds() -> None:
    assert set(DEMONSTRATIONS) == set(BY_NAME)
    for name, sizes in DEMONSTRATIONS.items():
        known = {parameter.name: parameter for parameter in BY_NAME[name].parameters}
        assert sizes and set(sizes) <= set(known), name
        assert all(known[one].low <= size <= known[one].high for one, size in sizes.items()), name


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_an_effect_that_is_on_changes_the_plant_and_off_it_is_the_rigs_own(effect) -> None:
    plant = demo().plant
    assert plant
    settings = SimulationSettings().changed(SimulationRequest(set={effect.name: "on"}))
    assert settings.plant_of(plant) != plant
    assert settings.changed(SimulationRequest(set={effect.name: "off"})).plant_of(plant) == plant


@pytest.mark.parametrize(
    ("assignment", "wanted"),
    [
        (("cell.silent", "true"), {"cell.silent": True}),
        (("cell.silent", "1"), {"cell.silent": True}),
        (("cell.silent", "0"), {"cell.silent": None}),
        (("noise", "0.5"), {"cell.noise": 0.5}),
        (("noise", 0), {"cell.noise": 0.0}),
        (("noise", "off"), {"cell.noise": None}),
        (("around.temperature_c", "off"), {"around.temperature_c": None}),
        (("unplug", "on"), {"output.unplug": True}),
        (("creep", "0.05"), {"creep.creep_share": 0.05}),
        (("creep.creep_s", 3), {"creep.creep_s": 3.0}),
        (("leak", "on"), {"leak.leak_per_s": 0.011}),
        (("leak.leak_per_s", "off"), {"leak.leak_per_s": None}),
        (("creep", "off"), {"creep.creep_share": None, "creep.creep_s": None}),
    ],
)
def test_an_assignment_means(assignment, wanted) -> None:
    assert parse_assignment(*assignment) == wanted


@pytest.mark.parametrize(
    ("assignment", "said"),
    [
        (("cell.slient", "true"), "E132 cell.slient cannot be set: did you mean cell.silent?"),
        (("crep", "on"), "did you mean creep?"),
        (("creep.speed", "1"), "E132 creep.speed: effect creep has no such parameter; it has creep.creep_share"),
        (("creep", "7"), "E133 creep=7 is out of range; allowed: -1 .. 1"),
        (("creep.creep_s", "fast"), "E133 creep.creep_s=fast is not a number; allowed: 0.3 .. 10000 s"),
        (("cell.noise", "-1"), "allowed: 0 .. 50 N"),
        (("cell.noise", "nan"), "out of range"),
        (("cell.silent", "2"), "allowed are on and off"),
        (("creep.creep_s", "on"), "is not a number"),
        (("cell.noise", "50.1"), "allowed: 0 .. 50 N"),
        (("cell.scale", "0.001"), "allowed: 0.01 .. 100"),
    ],
)
def test_what_cannot_be_set_is_refused_with_what_can(assignment, said) -> None:
    with pytest.raises(ValueError, match="E13") as refused:
        parse_assignment(*assignment)
    assert said in str(refused.value)


def test_nothing_is_set_when_one_of_several_is_refused() -> None:
    before = setting(cell__silent=True)
    with pytest.raises(ValueError, match="E133"):
        before.changed(SimulationRequest(set={"air.off": True, "cell.noise": 99.0}))
    assert dict(before.values) == {"cell.silent": True}


def test_a_real_rig_is_told_apart_and_a_valve_wants_a_valve() -> None:
    assert SimulationRequests(demo()).answer({"do": "sim", "set": {"cell.silent": "on"}}) == {"rig": "demo"}
    with pytest.raises(ValueError, match="E134 rig irc5-cell is a real one"):
        SimulationRequests(load_rig("irc5-cell")).answer({"do": "sim", "set": {"cell.silent": "on"}})
    with pytest.raises(ValueError, match=r"E133 valve\.stuck: rig demo has no valve"):
        SimulationRequests(demo()).answer({"do": "sim", "set": {"valve.stuck": "on"}})
    assert SimulationRequests(load_rig("paper-pull")).answer({"do": "sim", "set": {"valve.stuck": "on"}})


def test_an_effect_without_its_column_says_so() -> None:
    alone = setting(**{"feed-drag": "on"})
    assert alone.notes() == ("feed-drag acts by feed_mm_s: set around.feed_mm_s too",)
    assert setting(**{"feed-drag": "on"}, around__feed_mm_s=10).notes() == ()


@pytest.mark.parametrize(("effect", "is_told"), [(None, True), ("feed-drag", True), ("supply-droop", False)])
def test_surroundings_by_which_nothing_acts_say_so(effect: str | None, *, is_told: bool) -> None:
    alone = setting(around__supply_kpa=200, around__feed_mm_s=5, **({effect: "on"} if effect else {}))
    told = "around.supply_kpa moves no force: nothing that acts by it is on (supply-droop)"
    assert (told in alone.as_answer(demo())["notes"]) is is_told


def test_zero_is_a_temperature_and_not_one_that_nobody_has_told() -> None:
    cold = setting(**{"thermal-zero-drift": "on"}, around__temperature_c="0")
    assert cold.surroundings().temperature_c == 0.0
    assert cold.notes() == ()


def test_what_is_kept_holds_for_one_run_of_the_gateway(tmp_path) -> None:
    settings = setting(cell__silent=True, creep="0.05", around__tilt_deg=10)
    KeptSettings(tmp_path, "first").write(settings)
    assert KeptSettings(tmp_path, "first").read() == settings
    assert KeptSettings(tmp_path, "second").read() == SimulationSettings()
    (tmp_path / "simulation.json").write_text('{"run": "first", "set": {"cell.silent": [')
    assert KeptSettings(tmp_path, "first").read() == SimulationSettings()


def test_what_the_page_sets_can_be_set() -> None:
    lines = re.findall(r"^    force-gateway sim set ([^#\n]*)", PAGE.read_text(encoding="utf-8"), flags=re.M)
    assigned = dict(word.split("=") for line in lines for word in line.split() if "=" in word)
    assert len(assigned) > 8
    settings = SimulationSettings().changed(SimulationRequest(set=assigned))
    settings.check(demo())
    assert settings.notes() == ()


def test_names_are_told_apart() -> None:
    names = [one.name for one in (*FAULTS, *SURROUNDINGS)]
    assert len(names) == len(set(names))
    assert not set(names) & set(BY_NAME)


def test_what_is_cleared_is_as_in_the_rigs_files_and_nothing_else_is() -> None:
    settings = setting(creep__creep_share=0.05, creep__creep_s=3.0, cell__noise=0.5)
    assert settings.changed(SimulationRequest(clear=("creep",))).values == {"cell.noise": 0.5}
    assert settings.changed(SimulationRequest(clear=("creep.creep_s",))).values == {
        "creep.creep_share": 0.05,
        "cell.noise": 0.5,
    }
    assert settings.changed(SimulationRequest(clear_all=True)).values == {}


def test_what_cannot_be_kept_leaves_what_was_kept_as_it_was(tmp_path: Path) -> None:
    """Half a file would be nothing set, while the rig plays it."""
    kept = KeptSettings(tmp_path, "run 1")
    kept.write(setting(cell__noise=0.5))
    (tmp_path / "simulation.json.part").mkdir()
    with pytest.raises(OSError, match="Is a directory"):
        kept.write(setting(cell__noise=0.7))
    assert kept.read().values == {"cell.noise": 0.5}


@pytest.mark.parametrize(
    ("name", "unit", "allowed"),
    [
        ("cell.silent", "", "on, off"),
        ("cell.noise", "N", "0 .. 50 N"),
        ("cell.scale", "1", "0.01 .. 100"),
        ("around.tilt_deg", "deg", "-360 .. 360 deg"),
    ],
)
def test_what_a_setting_takes_is_told_with_its_unit_and_its_ends_are_taken(name: str, unit: str, allowed: str) -> None:
    (known,) = [one for one in (*FAULTS, *SURROUNDINGS) if one.name == name]
    assert (find_unit(name), known.allowed) == (unit, allowed)
    if unit:
        assert [parse_assignment(name, end) for end in (known.low, known.high)] == [
            {name: known.low},
            {name: known.high},
        ]


def test_units_of_effects_are_those_of_the_catalogue_and_what_is_none_has_none() -> None:
    for effect in EFFECTS:
        for parameter in effect.parameters:
            assert find_unit(f"{effect.name}.{parameter.name}") == parameter.unit
    assert find_unit("nothing") == ""
    listed = {one.name: one for one in effect_settings()}
    assert set(listed) == {f"{effect.name}.{one.name}" for effect in EFFECTS for one in effect.parameters}
    assert (listed["creep.creep_s"].unit, listed["creep.creep_s"].low) == ("s", 0.3)


@pytest.mark.parametrize(
    ("name", "cleared"),
    [
        ("noise", ("cell.noise",)),
        ("cell.silent", ("cell.silent",)),
        ("creep", ("creep.creep_share", "creep.creep_s")),
        ("creep.creep_s", ("creep.creep_s",)),
    ],
)
def test_a_name_clears_what_it_sets(name: str, cleared: tuple[str, ...]) -> None:
    assert list_cleared_names(name) == cleared


@pytest.mark.parametrize("name", ["creep.speed", "crep", "cell.slient"])
def test_what_is_no_name_clears_nothing(name: str) -> None:
    with pytest.raises(ValueError, match="E132"):
        list_cleared_names(name)


def test_the_cells_own_noise_is_another_ones_where_it_is_set_and_its_own_again_without() -> None:
    plant = demo().plant
    assert plant
    assert setting(cell__noise=0.5).plant_of(plant).cell.noise_n == 0.5
    assert setting(cell__noise=0).plant_of(plant).cell.noise_n == 0.0
    assert setting(cell__noise="off").plant_of(plant) == plant


@pytest.mark.parametrize(
    "kept",
    ['{"run": "first"}', '{"set": {}}', '{"run": "first", "set": 5}', '{"run": "first", "set": {"crep": 1}}', "[]", ""],
)
def test_what_is_kept_and_makes_no_sense_is_nothing(tmp_path: Path, kept: str) -> None:
    (tmp_path / "simulation.json").write_text(kept)
    assert KeptSettings(tmp_path, "first").read() == SimulationSettings()
