"""Which effects of an extended plant control takes back, and what a rig file may ask of it."""

from dataclasses import fields, replace
from pathlib import Path

import pytest

from gateway.control import NO_COMPENSATION, CommandMap
from gateway.diagnosis import EFFECTS
from gateway.profiles import check_report, load_plant, load_rig
from gateway.profiles.kinds.plant_writer import plant_text, with_origins
from gateway.profiles.rigs.compensated_effects import (
    ALL_INPUTS,
    TREATMENTS,
    By,
    compensation_of,
    differing_treatments,
    number_at,
)
from gateway.twin import Plant
from gateway.twin.plant import with_value

BASE = load_plant("paper-slide")
ROOT = Path(__file__).parents[3]


def rig_with(folder: Path, line: str, **numbers: float) -> Path:
    """The demo rig in a folder with an extended plant beside it. Keys of numbers are section__field."""
    plant = BASE.plant
    for path, value in numbers.items():
        section, name = path.split("__")
        plant = with_value(plant, section, name, value)
    (folder / "extended.yaml").write_text(plant_text(with_origins(BASE, plant, {})))
    text = (ROOT / "profiles" / "rigs" / "demo.yaml").read_text()
    rig = folder / "rig.yaml"
    rig.write_text(text.replace("calibration: demo ", f"{line}\ncalibration: demo "))
    return rig


def test_every_effect_of_the_catalogue_has_a_treatment_or_a_reason():
    assert {treatment.name for treatment in TREATMENTS} == {effect.name for effect in EFFECTS}
    for treatment in TREATMENTS:
        why = treatment.why_not
        assert bool(why) == (treatment.by is By.NOTHING), treatment.name
        assert not why or (why[0].islower() and not why.endswith(".")), treatment.name


def test_every_number_that_makes_an_effect_is_looked_at():
    of_twin = {f"{section.name}.{field.name}" for section in fields(Plant) for field in fields(section.default_factory)}
    made_by = {
        f"{parameter.section}.{parameter.name}"
        for effect in EFFECTS
        for form in effect.forms
        for parameter in form.parameters
    }
    looked_at = {path for treatment in TREATMENTS for path in treatment.fields}
    refitted = {"cylinder.area_m2", "cell.zero_n"}  # gain and offset: no effects, but the base model's own
    assert (made_by & of_twin) - looked_at - refitted == set()
    assert looked_at <= of_twin


def test_an_effect_counts_where_a_number_differs():
    extended = with_value(with_value(BASE.plant, "contact", "tilt_n", 2.0), "cell", "hum_n", 0.1)
    assert [treatment.name for treatment in differing_treatments(BASE.plant, extended)] == ["tilt-gravity", "mains-hum"]
    assert differing_treatments(BASE.plant, BASE.plant) == ()


def test_a_part_without_its_input_is_off_and_the_others_stay():
    warm = with_value(with_value(BASE.plant, "cell", "span_per_k", 0.01), "cell", "quadratic_per_n", 0.001)
    blind, seeing = compensation_of(BASE.plant, warm), compensation_of(BASE.plant, warm, ALL_INPUTS)
    assert blind.acts == ("sensor-quadratic",)
    assert blind.cell and (blind.cell.span_per_k, blind.cell.quadratic_per_n) == (0.0, 0.001)
    assert blind.limited == (("thermal-span-drift", "needs temperature_c, which nobody tells the controller"),)
    assert seeing.cell and seeing.cell.span_per_k == 0.01


def test_friction_is_left_to_a_calibration():
    sticky = with_value(BASE.plant, "friction", "coulomb_n", 3.0)
    ((name, why),) = compensation_of(BASE.plant, sticky).limited
    assert name == "coulomb-friction"
    assert "force-gateway calibrate" in why
    assert compensation_of(BASE.plant, sticky, new_model=True).acts == ("coulomb-friction",)


def test_a_rig_names_an_extended_plant_and_says_what_it_takes_back(tmp_path: Path):
    file = rig_with(tmp_path, "compensation: extended.yaml", cell__span_per_k=0.01, cell__cubic_per_n2=1e-5)
    rig = load_rig(file)
    assert rig.compensation.acts == ("sensor-cubic",)
    assert rig.notes == (
        "compensated: sensor-cubic",
        "not compensated: thermal-span-drift: needs temperature_c, which nobody tells the controller",
    )
    assert rig.fingerprint != load_rig(rig_with(tmp_path, "", contact__tilt_n=3.0)).fingerprint


def test_tilt_is_compensated_on_a_real_rig_and_not_on_a_simulated_one(tmp_path: Path):
    """A simulated rig's plant does not feel the tilt that the master writes: compensating it would make an error."""
    rig_with(tmp_path, "", contact__tilt_n=3.0)
    real = (ROOT / "profiles" / "rigs" / "irc5-cell.yaml").read_text()
    file = tmp_path / "real.yaml"
    file.write_text(real.replace("calibration: demo ", "compensation: extended.yaml\ncalibration: demo "))
    rig = load_rig(file)
    assert rig.compensation.acts == ("tilt-gravity",)
    assert rig.compensation.outside_n(0.0, float("nan")) == pytest.approx(3.0)
    simulated = rig.as_simulated()
    assert simulated.compensation.acts == ()
    assert simulated.compensation.outside is None
    assert any("no force from outside is simulated" in note for note in simulated.notes)


def test_a_rig_without_one_has_the_null_compensation():
    rig = load_rig("demo")
    assert rig.compensation is NO_COMPENSATION
    model = rig.calibration.model()
    assert rig.model_of(rig.calibration, model) is model


def test_a_simulated_rig_may_have_the_same_plant_as_truth_and_to_compensate(tmp_path: Path):
    file = rig_with(tmp_path, "compensation: extended.yaml", contact__tilt_n=3.0, cell__quadratic_per_n=0.001)
    file.write_text(file.read_text().replace("plant: paper-slide", "plant: extended.yaml"))
    rig = load_rig(file)
    assert rig.compensation.acts == ("sensor-quadratic",)
    assert rig.compensation.limited == (("tilt-gravity", "a simulated rig is not told how the tool is held"),)


@pytest.mark.parametrize(
    ("numbers", "told"),
    [({}, "no effect that control could take back"), ({"cell__hum_n": 0.2}, "mains-hum: it is in single readings")],
)
def test_a_plant_with_nothing_to_compensate_is_a_fault_of_its_line(tmp_path: Path, numbers, told):
    file = rig_with(tmp_path, "compensation: extended.yaml", **numbers)
    (fault,) = check_report(file).faults
    assert fault.path == "compensation"
    assert told in fault.message
    assert file.read_text().splitlines()[fault.line - 1] == "compensation: extended.yaml"


def test_a_plant_that_is_not_there_is_told(tmp_path: Path):
    (fault,) = check_report(rig_with(tmp_path, "compensation: nowhere.yaml")).faults
    assert "nowhere.yaml" in fault.message


def test_a_calibration_of_this_very_rig_knows_the_command_map_already(tmp_path: Path):
    rig = load_rig(rig_with(tmp_path, "compensation: extended.yaml", regulator__command_bow=0.06))
    model = rig.calibration.model()
    assert rig.compensation.command == CommandMap(bow=0.06, s=0.0)
    assert rig.model_of(rig.calibration, model).voltage_v(20.0, 1.0) != model.voltage_v(20.0, 1.0)
    own = replace(rig.calibration, rig=rig.name)
    assert rig.model_of(own, model) is model


def test_no_treatment_names_a_number_twice():
    paths = [path for treatment in TREATMENTS for path in treatment.fields]
    assert len(paths) == len(set(paths))
    assert all(isinstance(number_at(BASE.plant, path), float) for path in paths)
