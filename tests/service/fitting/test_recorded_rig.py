"""A recording brings its rig along: its plant is the recorded one, whatever the files are now."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gateway.profiles import ProfileError, load_rig
from gateway.recording import Recorder, Recording, export_csv, export_parquet, read_recording, read_table
from gateway.service.fitting.recorded_rig import plant_of, recorded_noise_n, rig_of, rig_texts


def table(header: dict[str, Any]) -> Recording:
    return Recording(Path("x.csv"), header, {"time_s": np.zeros(0)}, 0, False)


@pytest.fixture
def texts() -> dict[str, str]:
    return dict(load_rig("demo").texts)


def changed(texts: dict[str, str], old: str, new: str) -> dict[str, str]:
    """In the plant's text only."""
    found = {file: text.replace(old, new) if "plants" in file else text for file, text in texts.items()}
    assert found != texts
    return found


def test_the_recorded_plant_is_the_rig_s(texts: dict[str, str]) -> None:
    found = plant_of(table({"rig": "demo", "rig_texts": texts}))
    assert found == load_rig("demo").plant_profile


def test_a_plant_that_has_changed_since_is_taken_as_recorded(texts: dict[str, str]) -> None:
    line = next(
        line for file, text in texts.items() if "plants" in file for line in text.splitlines() if "area_m2" in line
    )
    old = changed(texts, line, "  area_m2: {value: 0.00099, source: assumed}")
    found = plant_of(table({"rig": "demo", "rig_texts": old}))
    assert found
    assert found.plant.cylinder.area_m2 == 0.00099


def test_every_format_carries_it(tmp_path: Path, texts: dict[str, str]) -> None:
    recorder = Recorder(tmp_path, {"rig": "demo", "rig_texts": texts}, ("time_s", "force_n"))
    recorder.append((0.0, 1.0))
    recorder.close()
    recording = read_recording(recorder.path)
    export_csv(recording, tmp_path / "out.csv")
    export_parquet(recording, tmp_path / "out.parquet")
    for name in ("0001.fgr", "out.csv", "out.parquet"):
        found = read_table(tmp_path / name)
        assert rig_texts(found) == texts
        assert plant_of(found) == load_rig("demo").plant_profile


def test_a_table_that_only_names_its_rig_has_that_rig_s_plant() -> None:
    assert plant_of(table({"rig": "demo"})) == load_rig("demo").plant_profile
    rig = rig_of(table({"rig": "demo"}))
    assert rig and rig.name == "demo"


@pytest.mark.parametrize("header", [{}, {"rig": "nobody's"}, {"rig_texts": "{"}, {"rig_texts": ["a"]}, {"rig": ""}])
def test_a_table_of_nobody_has_none(header: dict[str, Any]) -> None:
    assert plant_of(table(header)) is None
    assert rig_of(table(header)) is None


def test_a_rig_without_a_plant_has_none(texts: dict[str, str]) -> None:
    rig_file = next(iter(texts))
    without = "\n".join(line for line in texts[rig_file].splitlines() if not line.startswith("plant:"))
    assert plant_of(table({"rig": "demo", "rig_texts": texts | {rig_file: without}})) is None


def test_a_plant_that_this_version_cannot_read_is_told_by_its_place(texts: dict[str, str]) -> None:
    with pytest.raises(ProfileError, match=r"plants/.*yaml:\d+"):
        plant_of(table({"rig": "demo", "rig_texts": changed(texts, "area_m2", "aera_m2")}))


def test_a_device_of_the_plant_s_name_is_not_the_plant(texts: dict[str, str]) -> None:
    plant = next(file for file in texts if "plants" in file)
    rig_file, *others = texts
    device = f"devices/{Path(plant).name}"
    told = {rig_file: texts[rig_file], device: "name: a-device\n"} | {file: texts[file] for file in others}
    assert plant_of(table({"rig": "demo", "rig_texts": told})) == load_rig("demo").plant_profile


@pytest.mark.parametrize("noise_n", [None, "", "much", -0.1, 0.0, float("inf"), float("nan"), [1]])
def test_a_noise_that_is_none_is_not_known(noise_n: object) -> None:
    assert recorded_noise_n(table({"calibration_noise_n": noise_n})) is None
    assert recorded_noise_n(table({"calibration_noise_n": "0.05"})) == 0.05


def test_texts_that_are_nested_without_end_are_none() -> None:
    assert rig_texts(table({"rig_texts": "[" * 100_000})) == {}
