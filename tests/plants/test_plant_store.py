"""Numbered plants: what is stored reads back whole, is an ordinary plant file, and says where it comes from."""

from dataclasses import replace
from math import inf
from types import SimpleNamespace

import pytest

from gateway.bsfm import Bsfm
from gateway.cli.plants.store_access import save_diagnosed
from gateway.numbered_documents.store import StoreError
from gateway.plants.in_use import compensation_on, in_use_facts, with_cell_terms, with_plant_in_use
from gateway.plants.store import FoundCause, NumberedPlant, PlantStore, Provenance, SourceRecording
from gateway.processes.durable_file import add_checksum, verify_checksum
from gateway.profiles import PlantProfile, load_calibration, load_plant, load_rig
from gateway.profiles.kinds.plant_writer import with_origins
from gateway.twin.plant import with_value

BOWED = {"value": 0.06, "unit": "1", "ci95": [0.055, 0.065]}
TOLD = Provenance(
    made_utc="2026-11-22T17:30:00Z",
    version="0.1.0",
    rig="demo",
    start="paper-slide",
    verdict="confirmed",
    recordings=(SourceRecording(name="0001.fgr", sha256="ab" * 32),),
    causes=(FoundCause(name="command-nonlinearity", confidence=0.99, parameters={"command_bow": BOWED}),),
)


def bowed(**more: float) -> PlantProfile:
    """The paper's slide behind a bowed command map, as a diagnosis writes it. more: section__field = value."""
    start = load_plant("paper-slide")
    plant = with_value(start.plant, "regulator", "command_bow", 0.06)
    for path, value in more.items():
        plant = with_value(plant, *path.split("__"), value)
    return with_origins(replace(start, name="bowed"), plant, {"regulator.command_bow": "diagnosed"})


def numbered(profile: PlantProfile | None = None) -> NumberedPlant:
    return NumberedPlant(number=0, profile=profile or bowed(), provenance=TOLD)


def test_a_plant_reads_back_with_its_provenance_and_is_an_ordinary_plant_file(tmp_path):
    store = PlantStore(tmp_path)
    assert [store.add(numbered()), store.add(numbered(bowed(cell__quadratic_per_n=1e-3)))] == [1, 2]
    assert (store.load(1).provenance, store.load(1).number) == (TOLD, 1)
    assert load_plant(tmp_path / "plants" / "0001.yaml").plant == store.load(1).profile.plant == bowed().plant


def test_none_is_in_use_at_first_and_a_rollback_goes_back_to_it(tmp_path):
    store = PlantStore(tmp_path)
    assert store.find_selected().document is None
    store.add(numbered())
    store.use(1)
    assert store.find_selected().selection.number == 1
    store.use(store.previous().number)
    assert store.find_selected().document is None


def test_a_damaged_plant_is_named_and_the_rigs_own_is_used(tmp_path):
    store = PlantStore(tmp_path)
    store.use(store.add(numbered()))
    file = tmp_path / "plants" / "0001.yaml"
    file.write_bytes(file.read_bytes().replace(b"0.06", b"0.09", 1))
    selected = store.find_selected()
    assert selected.document is None
    assert "E432" in selected.notes[0] and "plant 1" in selected.notes[0]
    with pytest.raises(StoreError, match="there is no plant 7"):
        store.load(7)


def test_a_rig_compensates_what_it_can_of_the_plant_in_use_and_says_what_not():
    rig = load_rig("demo")
    used = with_plant_in_use(rig, numbered(bowed(contact__spindle_n=1.0)))
    assert used.compensation.acts == ("command-nonlinearity",)
    assert any("spindle-vibration: " in note for note in used.notes)
    assert used.plant == rig.plant, "the world of a simulated rig stays what it is"
    assert used.reference_plant == bowed(contact__spindle_n=1.0).plant
    assert with_plant_in_use(rig, None) is rig


def test_a_calibration_of_this_very_rig_has_measured_the_command_map_itself():
    rig = load_rig("demo")
    calibrated = replace(rig, calibration=replace(load_calibration("demo"), rig="demo"))
    compensation = compensation_on(calibrated, bowed())
    assert compensation.acts == ()
    used = with_plant_in_use(calibrated, numbered())
    assert type(used.calibration_in_use(used.calibration).model) is Bsfm, "its volts are sent as they are"
    ((name, why),) = compensation.limited
    assert name == "command-nonlinearity" and "has measured it" in why


def test_a_response_that_was_measured_on_this_very_rig_leaves_its_timing_to_the_calibration():
    rig, slow = load_rig("demo"), bowed(regulator__command_bow=0.0, regulator__delay_s=0.3)
    own = replace(rig, calibration=replace(load_calibration("demo"), rig="demo"))
    foreign = replace(rig, calibration=replace(load_calibration("demo"), rig="another"))
    assert own.calibration.response
    compensated = compensation_on(foreign, slow).acts
    assert compensated
    assert [name for name, why in compensation_on(own, slow).limited if "has measured it" in why] == list(compensated)
    unmeasured = replace(own, calibration=replace(own.calibration, response=None))
    assert compensation_on(unmeasured, slow).acts == compensated, "its ladder has measured no response"


def test_what_the_rigs_own_plant_has_as_well_is_taken_back_too():
    """Control knows nothing of these effects, whichever plant has them."""
    rig = replace(load_rig("demo"), plant_profile=bowed())
    assert compensation_on(rig, bowed()).acts == ("command-nonlinearity",)


def test_a_plant_that_was_found_elsewhere_is_doubted_on_a_real_rig_alone():
    rig, elsewhere = load_rig("demo"), replace(numbered(), provenance=replace(TOLD, rig="press-left"))
    told = [with_plant_in_use(each, elsewhere).plant_in_use for each in (rig, replace(rig, simulated=False))]
    assert [each is not None and 'was found on "press-left", not on demo' in each.doubts for each in told] == [
        False,
        True,
    ]


def test_a_simulated_rig_is_not_told_how_its_tool_is_held():
    rig, leaning = load_rig("demo"), bowed(regulator__command_bow=0.0, contact__tilt_n=3.0)
    assert compensation_on(replace(rig, simulated=False), leaning).outside
    assert compensation_on(rig, leaning).outside is None


def test_another_plant_says_nothing_of_what_the_one_before_compensated():
    first = with_plant_in_use(load_rig("demo"), numbered(bowed(contact__spindle_n=1.0)))
    second = with_plant_in_use(first, numbered(bowed(regulator__command_bow=0.0)))
    assert not any("spindle-vibration" in note or "command-nonlinearity" in note for note in second.notes)


@pytest.mark.parametrize("lost", ['"number": 1, ', '"rig": "demo", ', '"sha256": "', "# provenance"])
def test_a_sealed_plant_of_which_nobody_knows_where_it_comes_from_is_none(tmp_path, lost):
    store = PlantStore(tmp_path)
    store.add(numbered())
    file = tmp_path / "plants" / "0001.yaml"
    text = verify_checksum(file.read_bytes()).decode()
    assert lost in text
    file.write_bytes(add_checksum(text.replace(lost, "")))
    with pytest.raises(StoreError, match="E432"):
        store.load(1)


def test_a_plant_with_a_number_that_no_file_can_hold_is_not_stored(tmp_path):
    store, endless = PlantStore(tmp_path), {"command_bow": BOWED | {"value": inf}}
    cause = FoundCause(name="command-nonlinearity", confidence=0.99, parameters=endless)
    with pytest.raises(StoreError, match="E432 plant bowed"):
        store.add(replace(numbered(), provenance=replace(TOLD, causes=(cause,))))
    assert store.numbers() == []


def test_what_was_diagnosed_from_straightened_readings_comes_on_top_of_what_straightened_them():
    rig = with_plant_in_use(load_rig("demo"), numbered(bowed(cell__quadratic_per_n=0.002)))
    facts = in_use_facts(rig)
    assert set(facts["compensated"]) == {"sensor-quadratic", "command-nonlinearity"}
    assert rig.reference_plant is not None and rig.reference_plant.cell.quadratic_per_n == 0.0
    again = with_cell_terms(bowed(cell__quadratic_per_n=0.0005), facts["cell"])
    assert again.plant.cell.quadratic_per_n == pytest.approx(0.0025)
    assert with_cell_terms(bowed(), None) == bowed()


def test_a_plant_that_is_kept_of_straightened_readings_has_what_straightened_them(tmp_path):
    """In use without it, control would straighten no more, and the force would be off by all of it again."""
    sources = SimpleNamespace(
        paths=(), rig="demo", is_rehearsal=False, plant=SimpleNamespace(name="paper-slide"),
        straightened={"quadratic_per_n": 0.002},
    )  # fmt: skip
    diagnosis = SimpleNamespace(verdict=SimpleNamespace(value="confirmed"), causes=())
    number = save_diagnosed(tmp_path, diagnosis, sources, bowed(cell__quadratic_per_n=0.0005))
    assert PlantStore(tmp_path).load(number).profile.plant.cell.quadratic_per_n == pytest.approx(0.0025)
