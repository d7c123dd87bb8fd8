"""A real rig that is rehearsed with simulated devices, in its own state directory, as everybody begins: what a ladder has
measured there is no machine, and the real run must not take it for its own."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.bsfm import CoefficientLimits
from gateway.bsfm.model import Response
from gateway.calibrations.activation import Activation
from gateway.calibrations.store import CalibrationStore
from gateway.calibrations.upload import UploadRules, UploadService
from gateway.cli.diagnosis.inputs import read_sources
from gateway.cli.plants.store_access import save_diagnosed
from gateway.plants.in_use import with_plant_in_use
from gateway.plants.store import PlantStore
from gateway.profiles import Rig, load_plant, load_rig
from gateway.service.fitting.fit_process import fit_and_store
from gateway.service.running_rig.rig_calibrations import RigCalibrations
from gateway.service.running_rig.rig_plants import PlantEdges, RigPlants
from tests.calibrations.coefficients import calibration
from tests.service.fitting.test_fit_process import recorded

GUESS = 'was made on "irc5-cell (simulated)", not on irc5-cell: its forces are a guess'


@pytest.fixture(scope="module")
def real() -> Rig:
    return load_rig("irc5-cell")


@pytest.mark.parametrize(
    ("name", "simulated", "made_on"),
    [
        ("irc5-cell", True, "irc5-cell (simulated)"),
        pytest.param("irc5-cell", False, "irc5-cell", marks=pytest.mark.long),
        pytest.param("demo", True, "demo", marks=pytest.mark.long),  # which is never anything else
    ],
)
def test_a_calibration_says_whether_its_devices_were_simulated(
    name: str, simulated: bool, made_on: str, tmp_path: Path
) -> None:
    facts = {"simulated": simulated, "rig_texts": dict(load_rig(name).texts)}
    result = fit_and_store(recorded(tmp_path, name, facts=facts), name, tmp_path)
    assert CalibrationStore(tmp_path).load(result["stored"]).rig == made_on


def test_it_counts_as_measured_in_the_simulation_alone(real: Rig) -> None:
    made = replace(
        real.calibration, rig="irc5-cell (simulated)", response=Response(dead_time_s=0.1, lag_s=0.2), noise_n=0.1
    )
    rehearsal = real.as_simulated()
    assert rehearsal.calibration_in_use(made).response == made.response and rehearsal.has_measured(made)
    assert rehearsal.doubts_on(made) == ""
    in_use = real.calibration_in_use(made)
    assert (in_use.response, in_use.noise_n, real.has_measured(made)) == (None, 0.0, False)
    assert GUESS in real.doubts_on(made)
    assert real.doubts_on(replace(made, rig="irc5-cell")) == ""


def test_a_real_run_that_begins_with_it_says_so_and_who_takes_it_into_use_is_told(real: Rig, tmp_path: Path) -> None:
    store = CalibrationStore(tmp_path, real.calibration)
    number = store.add(calibration(8, rig="irc5-cell (simulated)"))
    activation = Activation(store, CoefficientLimits(cell_range_n=100.0))
    rules = UploadRules.of(real.name, real.register_map, lambda: "", real.doubts_on)
    said = list[str]()
    staging = SimpleNamespace()
    selected = store.find_selected()
    upload = UploadService(staging, activation, selected, rules, lambda _, sentence: said.append(sentence))  # type: ignore[arg-type]
    upload.run_in_background = lambda work, done: done(work())
    upload.use(number)
    upload.close()
    assert GUESS in said[-1] and GUESS in upload.status()["said"]
    assert any(GUESS in note for note in RigCalibrations(real, tmp_path).notes)
    assert not any(GUESS in note for note in RigCalibrations(real.as_simulated(), tmp_path).notes)


def test_a_plant_that_was_found_in_a_rehearsal_is_told_as_one_by_the_real_rig(real: Rig, tmp_path: Path) -> None:
    """What control would take back of it may be in no machine."""
    path = recorded(tmp_path, "irc5-cell", facts={"simulated": True, "rig_texts": dict(real.texts)})
    sources = read_sources([str(path)], rig=None, columns=None, state=tmp_path)
    assert sources.is_rehearsal and not replace(sources, is_rehearsal=False).is_rehearsal
    diagnosis: Any = SimpleNamespace(verdict=SimpleNamespace(value="confirmed"), causes=())
    number = save_diagnosed(tmp_path, diagnosis, sources, load_plant("paper-slide"))
    stored = PlantStore(tmp_path).load(number)
    assert stored.provenance.rig == "irc5-cell (simulated)"
    doubt = 'plant 1 was found on "irc5-cell (simulated)": what it takes back may be in no machine'
    assert doubt in with_plant_in_use(real, stored).notes
    assert doubt not in with_plant_in_use(real.as_simulated(), stored).notes
    plants = RigPlants(real, tmp_path)
    plants.serve(PlantEdges(lambda: True, lambda rig: None, lambda: 0.0, lambda cause, sentence: None))
    plants.run_in_background = lambda work, done: done(work())
    assert doubt in plants.answer({"use": number})["said"]
    plants.close()


@pytest.mark.parametrize(("rig_name", "origin"), [("cell-9", 'on "cell-9"'), ("", "in recordings that name no rig")])
def test_a_plant_of_another_machine_is_told_as_one(rig_name: str, origin: str, real: Rig, tmp_path: Path) -> None:
    """A store that was copied by hand, or a selection, was believed: control took back what is in another machine."""
    path = recorded(tmp_path, "irc5-cell", facts={"rig_texts": dict(real.texts)})
    sources = replace(read_sources([str(path)], rig=None, columns=None, state=tmp_path), rig=rig_name)
    diagnosis: Any = SimpleNamespace(verdict=SimpleNamespace(value="confirmed"), causes=())
    stored = PlantStore(tmp_path).load(save_diagnosed(tmp_path, diagnosis, sources, load_plant("paper-slide")))
    doubt = f"plant 1 was found {origin}, not on irc5-cell: what it takes back may not be in this machine"
    assert [note for note in with_plant_in_use(real, stored).notes if note.startswith(doubt)]
    own = replace(stored, provenance=replace(stored.provenance, rig="irc5-cell"))
    from_file = replace(stored, provenance=replace(stored.provenance, recordings=(), file="plant.yaml"))
    for rig, plant in ((real, own), (real, from_file), (real.as_simulated(), stored)):
        assert not [note for note in with_plant_in_use(rig, plant).notes if "was found" in note]
