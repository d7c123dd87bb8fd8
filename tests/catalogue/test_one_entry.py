"""An effect is one entry: whoever adds one to the catalogue finds it in every place that is derived from it.

A process of its own adds a made-up effect to one family before anything else is imported, and tells where it shows up.
"""

import json
import subprocess
import sys
from typing import Any

import pytest

from gateway.catalogue.all_effects import EFFECTS
from gateway.catalogue.effect import By
from gateway.registers.residual_cause import ResidualCause

ADDED = """
import json
from click.testing import CliRunner
from gateway.catalogue import sensing
from gateway.catalogue.effect import By, Effect, EffectForm, Parameter, PartName, Recipe, Treatment, fixed_starts
made_up = Effect(
    name="magnet-pull", number=77, family="sensing and logging", what="a magnet pulls at the tool",
    signature="the residual follows the tilt", excitation="tilts", experiment="take the magnet away",
    recipe=Recipe(parts=(PartName.LEVEL,), meanwhile="turn the tool"),
    treatments=(Treatment(why_not="nobody knows where the magnet is"),),
    forms=(EffectForm(parameters=(Parameter("contact", "mass_kg", "kg", 0.0, 0.0, 1.0, 0.01),), probes=fixed_starts((0.1,)),
                needs=("tilt_deg",)),),
)
sensing.SENSING = (*sensing.SENSING, made_up)

from gateway.cli.verbs.diagnosis import effects
from gateway.cli.verbs.setup import registers
from gateway.diagnosis.experiments.experiments import plan_for
from gateway.profiles import load_plant, load_register_map
from gateway.profiles.rigs.compensated_effects import compensation_of, compensation_words
from gateway.registers.residual_cause import ResidualCause
from gateway.service.closed_loop.schedule import COLUMNS
from gateway.twin.plant import with_value
plant, register_map = load_plant("paper-slide").plant, load_register_map("force-v1")
plan = plan_for(["magnet-pull"]).experiment
print(json.dumps({
    "register": ResidualCause.of_effect("magnet-pull").value,
    "map": register_map.find("residual_cause").values[77],
    "register table": CliRunner().invoke(registers.command, ["--format", "markdown"]).output,
    "effects": CliRunner().invoke(effects.command, []).output,
    "effects --json": [each["name"] for each in json.loads(CliRunner().invoke(effects.command, ["--json"]).output)["effects"]],
    "plan": [plan.shows, plan.columns, plan.by_hand, [part.name for part in plan.parts]],
    "compensation": compensation_words(compensation_of(plant, with_value(plant, "contact", "mass_kg", 0.2))),
    "closed loop": COLUMNS["magnet-pull"],
}))
"""


@pytest.fixture(scope="module")
def places() -> dict[str, Any]:
    done = subprocess.run([sys.executable, "-c", ADDED], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_an_added_effect_has_its_number_in_register_and_map(places: dict[str, Any]) -> None:
    assert (places["register"], places["map"]) == (77, "magnet_pull")
    assert "77 magnet_pull" in places["register table"]


def test_an_added_effect_stands_in_the_tables(places: dict[str, Any]) -> None:
    assert "magnet-pull" in places["effects"]
    assert "needs the column tilt_deg" in " ".join(places["effects"].split())
    assert places["effects --json"] == [*(effect.name for effect in EFFECTS), "magnet-pull"]


def test_an_added_effect_can_be_planned(places: dict[str, Any]) -> None:
    assert places["plan"] == [["magnet-pull"], ["tilt_deg"], ["turn the tool"], ["one level"]]


def test_an_added_effect_says_why_control_does_not_compensate_it(places: dict[str, Any]) -> None:
    assert "not compensated: magnet-pull: nobody knows where the magnet is" in places["compensation"]
    assert places["closed loop"] == "tilt_deg"


def test_numbers_are_those_of_the_map_since_version_1() -> None:
    """45 effects in the catalogue's order from 1 on; a number that a master knows never means anything else."""
    assert [effect.number for effect in EFFECTS] == list(range(1, 46))
    assert {ResidualCause.of_effect(effect.name).value: effect.name for effect in EFFECTS} == {
        number: ResidualCause(number).effect for number in range(1, 46)
    }
    assert (ResidualCause.NONE, ResidualCause.UNKNOWN) == (0, 99)
    assert ResidualCause.of_effect("gremlins") is ResidualCause.UNKNOWN


def test_every_entry_says_what_control_does_about_it_or_why_nothing() -> None:
    for effect in EFFECTS:
        assert effect.treatments, effect.name
        for treatment in effect.treatments:
            assert bool(treatment.why_not) == (treatment.by is By.NOTHING), effect.name
