"""`simulate`: a plant beside a recording, in figures and as a series; `effects`: the catalogue as a contract."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result

from gateway.diagnosis import EFFECTS
from gateway.profiles import load_plant
from gateway.profiles.kinds.plant_writer import plant_text, with_origins
from gateway.recording import read_table
from gateway.twin.plant import values, with_value
from tests.reports.fake_diagnosis import command_v

Call = Callable[..., Result]


def recorded(path: Path, force_n: np.ndarray, time_s: np.ndarray) -> Path:
    table = np.stack([time_s, command_v(time_s), force_n], axis=1)
    np.savetxt(path, table, "%.9g", ",", header="time_s,command_v,force_n", comments="")
    return path


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    time_s = np.arange(1000) / 100.0
    return recorded(tmp_path / "a.csv", 8.0 * command_v(time_s), time_s)


def test_a_plant_that_made_the_recording_leaves_nothing(tmp_path: Path, call: Call, recording: Path) -> None:
    start = load_plant("paper-slide")
    quiet = with_value(with_value(start.plant, "cell", "noise_n", 0.0), "cell", "zero_n", 1.25)
    plant = tmp_path / "other.yaml"
    plant.write_text(plant_text(with_origins(start, quiet, {})), encoding="utf-8")
    series = tmp_path / "series.csv"
    assert call("simulate", str(recording), "--plant", str(plant), "--csv", str(series)).exit_code == 0
    columns = read_table(series).columns
    again = recorded(tmp_path / "b.csv", columns["simulated_n"], columns["time_s"])
    answer = call("simulate", str(again), "--plant", str(plant), "--json")
    document = json.loads(answer.stdout)
    assert document["format"] == 1 and set(document["residual_n"]) == {"all", "rising", "falling"}
    assert document["residual_n"]["all"]["max_n"] < 1e-4


def test_a_position_of_something_else_does_not_move_the_slide(tmp_path: Path, call: Call, recording: Path) -> None:
    series, elsewhere = tmp_path / "series.csv", tmp_path / "c.csv"
    assert call("simulate", str(recording), "--csv", str(series)).exit_code == 0
    columns = read_table(series).columns
    along_mm = 300.0 + 200.0 * np.sin(0.7 * columns["time_s"])
    table = np.stack([columns["time_s"], columns["command_v"], columns["simulated_n"], along_mm], axis=1)
    np.savetxt(elsewhere, table, "%.9g", ",", header="time_s,command_v,force_n,position_mm", comments="")
    document = json.loads(call("simulate", str(elsewhere), "--json").stdout)
    assert document["residual_n"]["all"]["max_n"] < 1e-4
    assert any("position_mm is not taken for the motion" in note for note in document["notes"])


def test_the_series_and_the_figures_are_one_story(tmp_path: Path, call: Call, recording: Path) -> None:
    series = tmp_path / "series.csv"
    answer = call("simulate", str(recording), "--rig", "demo", "--csv", str(series), "--json")
    assert answer.exit_code == 0, answer.output
    columns = read_table(series).columns
    assert list(columns) == ["time_s", "force_n", "command_v", "simulated_n", "residual_n", "usable"]
    left_n = columns["residual_n"][columns["usable"] == 1.0]
    text = json.loads(answer.stdout)["residual_n"]["all"]
    assert text["rms_n"] == pytest.approx(np.sqrt(np.mean(left_n**2)), rel=1e-6)
    assert np.allclose(columns["force_n"] - columns["simulated_n"], columns["residual_n"], atol=1e-6)


def test_the_terminal_tells_rms_and_max_by_direction(call: Call, recording: Path) -> None:
    answer = call("simulate", str(recording), "--rig", "demo")
    assert answer.exit_code == 0, answer.output
    for text in ("rig demo · plant paper-slide", "RMS N", "max N", "rising", "falling"):
        assert text in answer.stdout


def test_a_plant_file_with_a_fault_is_told_at_its_place(tmp_path: Path, call: Call, recording: Path) -> None:
    plant = tmp_path / "bad.yaml"
    plant.write_text("name: bad\nfriction:\n  coulomb_n: 3\n")
    answer = call("simulate", str(recording), "--plant", str(plant))
    assert answer.exit_code == 78 and "bad.yaml:3" in answer.stderr


def test_a_table_that_is_none_is_bad_input(tmp_path: Path, call: Call) -> None:
    path = tmp_path / "a.csv"
    path.write_text("time_s,force_n\n0,1\n")
    series = tmp_path / "series.csv"
    assert call("simulate", str(path), "--csv", str(series)).exit_code == 65
    assert not series.exists()


def test_the_series_may_not_replace_the_recording(call: Call, recording: Path) -> None:
    before = recording.read_bytes()
    assert call("simulate", str(recording), "--csv", str(recording)).exit_code == 2
    assert recording.read_bytes() == before


def test_effects_as_json_has_the_contract_s_fields_for_every_effect(call: Call) -> None:
    document = json.loads(call("effects", "--json").stdout)
    assert document["format"] == 1 and len(document["effects"]) == len(EFFECTS) == 45
    for effect in document["effects"]:
        assert {"name", "what", "signature", "excitation", "parameters", "group"} <= set(effect)
        assert all({"name", "unit", "null"} <= set(parameter) for parameter in effect["parameters"])
        assert effect["parameters"] and effect["what"] and effect["signature"] and effect["excitation"]
        assert effect["group"][0] == effect["name"] and len(set(effect["group"])) == len(effect["group"])


def test_each_parameter_of_an_effect_has_a_name_of_its_own_and_stands_in_a_plant(call: Call) -> None:
    plant = {(section, name) for section, name, _ in values(load_plant("paper-slide").plant)}
    for effect in json.loads(call("effects", "--json").stdout)["effects"]:
        names = [parameter["name"] for parameter in effect["parameters"]]
        assert len(set(names)) == len(names), effect["name"]
        assert {(parameter["section"], parameter["name"]) for parameter in effect["parameters"]} <= plant


def test_effects_prints_every_name_within_80_columns(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    answer = call("effects")
    assert max(map(len, answer.stdout.splitlines())) <= 80
    assert all(effect.name in answer.stdout for effect in EFFECTS)
