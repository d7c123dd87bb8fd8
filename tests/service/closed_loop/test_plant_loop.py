"""The loop closes on a machine that is not the twin of its rig's plant: what a plant in use gains is measured on two runs of
it, and a plant that makes the force worse is named. The whole gateway in virtual time."""

import json
from functools import cache
from math import inf
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from gateway.cli.main import command
from gateway.diagnosis.force_error import GainVerdict, compare_runs
from gateway.plants.force_reference import keep_reference, reference_of
from gateway.plants.in_use import with_plant_in_use
from gateway.plants.recorded_force import read_recorded_force
from gateway.plants.store import NumberedPlant, PlantStore
from gateway.recording import Recording
from gateway.registers.words import State
from gateway.service.running_rig.rig_plants import PlantEdges, RigPlants
from gateway.watch.force_watch import ForceWatch, PlantSince
from tests.plants.test_plant_store import TOLD, bowed
from tests.service.closed_loop.plant_loop import Machine
from tests.service.rigs import demo
from tests.service.wired import ENABLE, Wired

BOW = 0.06
RIGHT = NumberedPlant(number=1, profile=bowed(regulator__command_bow=BOW), provenance=TOLD)
WRONG = NumberedPlant(number=2, profile=bowed(regulator__command_bow=-BOW), provenance=TOLD)


@pytest.fixture(scope="module")
def state(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two runs of a machine whose command map is bowed: before and with the right plant in use, and one with a wrong one."""
    directory = tmp_path_factory.mktemp("state")
    for plant in (None, RIGHT, WRONG):
        Machine(directory, {"regulator__command_bow": BOW}).record(plant, rounds=2)
    return directory


@cache
def recording(state: Path, number: int) -> Recording:
    from gateway.recording import find_recording, read_recording

    return read_recording(find_recording(state, number))


def ring(recorded: Recording) -> tuple[bytes, tuple[str, ...]]:
    """The rows of a run as the sample ring has them."""
    columns = tuple(recorded.columns)
    return np.stack([recorded.columns[name] for name in columns], axis=1).astype("<f8").tobytes(), columns


def compare(state: Path, *words: object) -> dict:
    told = CliRunner().invoke(command, ["diagnose", *map(str, words), "--state", str(state), "--json", "-"])
    assert told.exit_code == 0, told.output
    return dict(json.loads(told.stdout))


def test_the_right_plant_gains_force_and_the_interval_excludes_0(state):
    found = compare(state, "--before", 1, "--after", 2)
    assert (found["verdict"], found["before"]["plant"], found["after"]["plant"]) == ("better", 0, 1)
    assert found["force_error"]["gain_ci95"][0] > 0.0
    assert found["held"]["ratio_ci95"][1] < 0.5, "the error of held forces is halved at least"


def test_a_wrong_plant_is_worse_and_the_watch_names_it(state):
    assert compare(state, "--before", 1, "--after", 3)["verdict"] == "worse"
    keep_reference(state, reference_of(recording(state, 1), 2, None))
    watch = ForceWatch(state, tolerance_n=0.5)
    watch.follow(PlantSince(2, since_s=-inf))
    watch.look(*ring(recording(state, 3)))
    assert not watch.sentence, "one look is no proof"
    watch.look(*ring(recording(state, 3)))
    assert "since plant 2 is in use the force is 6." in watch.sentence
    assert "force-gateway plant rollback" in watch.sentence
    watch.follow(PlantSince(0, since_s=9.0))
    assert not watch.sentence, "it was rolled back"


def test_the_watch_is_silent_about_the_right_plant_and_without_a_reference(state):
    watch = ForceWatch(state, tolerance_n=0.5)
    for number, run in ((1, 2), (2, 3)):
        keep_reference(state, reference_of(recording(state, 1), 1, None))  # for plant 1: plant 2 has none
        watch.follow(PlantSince(number, since_s=-inf))
        for _ in range(3):
            watch.look(*ring(recording(state, run)))
        assert not watch.sentence


def test_rows_from_before_the_change_are_no_witness(state):
    keep_reference(state, reference_of(recording(state, 1), 2, None))
    watch = ForceWatch(state, tolerance_n=0.5)
    watch.follow(PlantSince(2, since_s=1e6))
    for _ in range(3):
        watch.look(*ring(recording(state, 3)))
    assert not watch.sentence


def test_what_is_compensated_changes_only_while_the_output_is_disabled():
    wired = Machine(Path(), {"regulator__command_bow": BOW}).wired(None).pressing(20.0)
    rig = with_plant_in_use(demo(), RIGHT)
    with pytest.raises(ValueError, match="only while the output is disabled"):
        wired.controller.compensate(rig.control, rig.compensation, rig.calibration_in_use(rig.calibration))
    before_n = held_error_n(wired)
    wired.write(0, 0, 0)
    wired.until(lambda: wired.state is State.OFF, 3.0)
    wired.controller.compensate(rig.control, rig.compensation, rig.calibration_in_use(rig.calibration))
    assert held_error_n(wired) < 0.5 * before_n


def held_error_n(wired: Wired) -> float:
    """RMS of the true force over two rounds, 0.7 s after each step and later."""
    errors_n = []
    for level_n in (12.0, 28.0, 18.0, 34.0, 22.0):
        wired.write(0, ENABLE, round(100 * level_n))
        wired.run(0.8)
        errors_n += [each.twin.force_n - level_n for each in wired.samples(0.4)]
    return float(np.sqrt(np.mean(np.square(errors_n))))


def test_a_running_rig_takes_a_plant_when_its_output_is_off_and_tells_so(tmp_path):
    store, said, used = PlantStore(tmp_path), [], []
    store.add(RIGHT)
    plants = RigPlants(demo(), tmp_path)
    plants.run_in_background = lambda do, done: done(do())  # type: ignore[assignment]
    is_free = [False]
    plants.serve(
        PlantEdges(lambda: is_free[0], used.append, lambda: 5.0, lambda cause, sentence: said.append(sentence))
    )
    answer = plants.answer({"do": "plant", "use": 1})
    assert (plants.status()["active"], plants.status()["waiting"], used, answer["failed"]) == (0, 1, [], False)
    assert "will be in use from the moment the output is disabled" in said[0]
    assert "compensated: command-nonlinearity" in said[0]
    plants.take_waiting()
    assert used == [], "it still presses"
    is_free[0] = True
    plants.take_waiting()
    assert (plants.status()["active"], used[0].compensation.acts, said[-1]) == (
        1,
        ("command-nonlinearity",),
        "plant 1 (bowed) in use",
    )
    assert RigPlants(demo(), tmp_path).rig.plant_in_use.number == 1, "a restart finds it"
    plants.answer({"do": "plant", "rollback": True})
    assert (plants.status()["active"], used[1].compensation.acts) == (0, ())
    plants.answer({"do": "plant", "rollback": True})
    assert plants.status()["active"] == 1
    assert RigPlants(demo(), tmp_path).rig.plant_in_use.number == 1, "what was gone back to is found, too"
    plants.run_in_background = lambda do, done: None  # type: ignore[assignment]
    plants.answer({"do": "plant", "use": 0})
    with pytest.raises(ValueError, match="plant use 0 is under way"):
        plants.answer({"do": "plant", "use": 1})
    plants.close()


def test_the_same_machine_unchanged_is_neither_better_nor_worse(tmp_path):
    runs = []
    for seed in (7, 8):
        machine = Machine(tmp_path, {"regulator__command_bow": BOW}, seed)
        wired_run = read_recorded_force(machine.record(None))
        runs.append(wired_run.blocks(None))
    assert compare_runs(*runs).verdict is GainVerdict.UNKNOWN


@pytest.mark.long
def test_recorded_diagnosed_used_and_run_again_it_gains(tmp_path):
    """gateway/diagnosis/README.md, "Close the loop": the diagnosis finds the effect hidden in the gateway's own recording."""
    machine = Machine(tmp_path, {"regulator__command_bow": BOW})
    machine.record(None, rounds=5)
    told = CliRunner().invoke(command, ["diagnose", "1", "--save", "--state", str(tmp_path)])
    assert told.exit_code == 0, told.output
    used = CliRunner().invoke(command, ["plant", "use", "1", "--state", str(tmp_path), "--json"])
    assert json.loads(used.stdout)["compensated"] == ["command-nonlinearity"], used.output
    plant = PlantStore(tmp_path).find_selected().document
    assert plant is not None
    assert plant.profile.plant.regulator.command_bow == pytest.approx(BOW, rel=0.1)
    Machine(tmp_path, {"regulator__command_bow": BOW}, seed=8).record(plant, rounds=5)
    found = compare(tmp_path, "--before", 1, "--after", 2)
    assert found["verdict"] == found["held"]["verdict"] == "better"
    assert found["held"]["ratio"] < 0.3
