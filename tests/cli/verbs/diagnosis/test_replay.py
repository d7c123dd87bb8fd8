"""`replay` on a recording of the gateway: against itself, another calibration, and what cannot be replayed."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gateway.calibrations.store import CalibrationStore
from gateway.cli.diagnosis.inputs import read_sources
from gateway.profiles import load_calibration, shipped_profiles_folder
from gateway.recording import read_recording, read_table
from gateway.recording.calibrations_used import tell_changes
from gateway.recording.care.what_happened import tell_happened
from gateway.recording.export import export_csv
from gateway.recording.measurement import measurement_of
from tests.service.test_replayed_control import record_work, scaled


@pytest.fixture(scope="module")
def state(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One recording, and calibration 2 with forces that are a tenth larger."""
    state = tmp_path_factory.mktemp("state")
    record_work(state)
    own = load_calibration("demo")
    store = CalibrationStore(state, own)
    store.add(own)
    store.add(scaled(own, 1.1))
    return state


def differences(call, state: Path, *words: str) -> dict[str, dict[str, object]]:
    answer = call("replay", "1", "--json", "--state", state, "--rig", "demo", *words)
    assert answer.exit_code == 0, answer.output
    return {one["signal"]: one for one in json.loads(answer.stdout)["differences"]}


def test_the_same_rig_gives_zero(state: Path, call) -> None:
    found = differences(call, state, "--against", "demo")
    assert set(found) >= {"command_v", "feedforward_v", "trim_v", "state", "fault_code"}
    assert all(one["rows"] == 0 for one in found.values())
    told = call("replay", "1", "--against", "demo", "--state", state, "--rig", "demo").output
    assert told.rstrip().endswith("no difference")


def test_another_calibration_is_told_by_signal(state: Path, call) -> None:
    number = max(int(path.stem) for path in (state / "calibrations").glob("*.yaml") if path.stem.isdecimal())
    found = differences(call, state, "--against", str(number))
    assert found["applied_n"]["rows"] == 0
    assert found["command_v"]["rms"] > 0.05
    told = call("replay", "1", "--against", number, "--state", state, "--rig", "demo").output
    assert f"calibration {number} " in told
    assert "no difference" not in told
    assert max(len(line) for line in told.splitlines() if "recordings" not in line) <= 60


def test_alone_it_is_compared_with_what_was_recorded(state: Path, call) -> None:
    assert differences(call, state)["applied_n"]["rms"] < 1e-6


def test_an_exported_table_is_replayed_with_the_calibration_that_it_was_made_with(
    state: Path, call, tmp_path: Path
) -> None:
    """A table holds its facts as text: the plant in use was an internal error, and the calibration silently the rig's own."""
    number = max(int(path.stem) for path in (state / "calibrations").glob("*.yaml") if path.stem.isdecimal())
    recording = read_recording(state / "recordings" / "0001.fgr")
    facts = {"calibration": number, "plant_in_use": {"number": 3, "compensated": [], "cell": None}}
    export_csv(replace(recording, header=recording.header | facts), tmp_path / "exported.csv")
    answer = call("replay", tmp_path / "exported.csv", "--state", state, "--rig", "demo")
    assert answer.exit_code == 0, answer.output
    assert f"calibration {number} " in answer.stdout
    assert "plant 3 was in use" in answer.stderr


def test_a_calibration_that_came_into_use_amid_a_recording_is_told_with_its_time(
    state: Path, call, tmp_path: Path
) -> None:
    """By the list of recordings, by replay and by diagnose: the header has the first one alone."""
    recording = read_recording(state / "recordings" / "0001.fgr")
    numbers = recording.columns["calibration"].copy()
    numbers[recording.columns["time_s"] >= 1.5] = 2.0
    numbers[recording.columns["time_s"] >= 2.5] = 99.0
    export_csv(replace(recording, columns=recording.columns | {"calibration": numbers}), tmp_path / "changed.csv")
    changes = "calibration 2 from 1.50 s on, calibration 99 from 2.50 s on"
    told = call("replay", tmp_path / "changed.csv", "--state", state, "--rig", "demo")
    assert told.exit_code == 0, told.output
    assert changes in told.stderr and "calibration 99 is not stored here" in told.stderr
    changed = read_table(tmp_path / "changed.csv")
    assert changes in tell_happened(changed).as_words()
    assert read_sources([str(tmp_path / "changed.csv")], rig="demo", columns=None, state=state).notes == (
        f"changed.csv: {changes}",
    )
    assert "calibration" not in measurement_of(changed).covariates
    quick = replace(changed, columns=changed.columns | {"calibration": np.arange(changed.rows) % 2.0})
    assert tell_changes(quick).endswith(f"s on, {changed.rows - 4} more changes of calibration")


def test_a_rig_of_a_file_is_the_one_that_is_given(state: Path, call, tmp_path: Path) -> None:
    """`its rig my-cell is not known here` was the answer to --rig my-cell.yaml, from any folder but the file's own."""
    text = (shipped_profiles_folder() / "rigs" / "demo.yaml").read_text(encoding="utf-8")
    for name in ("my-cell", "another"):
        (tmp_path / f"{name}.yaml").write_text(text.replace("name: demo", f"name: {name}"), encoding="utf-8")
    recording = read_recording(state / "recordings" / "0001.fgr")
    export_csv(replace(recording, header=recording.header | {"rig": "my-cell"}), tmp_path / "mine.csv")
    words = ("replay", tmp_path / "mine.csv", "--state", state)
    answer = call(*words, "--rig", tmp_path / "my-cell.yaml")
    assert answer.exit_code == 0 and "replayed with rig my-cell, calibration 1 " in answer.stdout
    for rig in ((), ("--rig", "demo"), ("--rig", tmp_path / "another.yaml")):
        refused = call(*words, *rig)
        assert refused.exit_code == 65 and "my-cell is not known here: give that rig's file by --rig" in refused.stderr


@pytest.mark.parametrize(("words", "code", "why"), [(("7",), 65, "E403"), (("1", "--against", "nothing-such"), 78, "")])
def test_what_is_not_there_is_one_sentence(words: tuple[str, ...], code: int, why: str, state: Path, call) -> None:
    answer = call("replay", *words, "--state", state, "--rig", "demo")
    assert answer.exit_code == code, answer.output
    assert why in answer.stderr
    assert "Traceback" not in answer.stderr


@pytest.mark.parametrize(("name", "code"), [("time_s", 65), ("state", 65), ("quality", 0)])
def test_a_row_without_its_time_or_state_is_named_and_one_without_quality_is_a_good_one(
    name: str, code: int, state: Path, tmp_path: Path, call
) -> None:
    recording = read_recording(state / "recordings" / "0001.fgr")
    recording.columns[name][40] = float("nan")
    export_csv(recording, tmp_path / "edited.csv")
    answer = call("replay", tmp_path / "edited.csv", "--state", state, "--rig", "demo")
    assert answer.exit_code == code, answer.output
    assert "E500" not in answer.output


def test_rows_that_are_missing_are_told_with_where_and_how_long(state: Path, call, tmp_path: Path) -> None:
    """Control ramped on while nothing was written: the replay differed there by volts, and said nothing of it."""
    whole = read_recording(state / "recordings" / "0001.fgr")
    there = np.delete(np.arange(whole.rows), [*range(22, 42), *range(150, 165)])
    export_csv(
        replace(whole, columns={name: values[there] for name, values in whole.columns.items()}), tmp_path / "a.csv"
    )
    answer = call("replay", tmp_path / "a.csv", "--state", state, "--rig", "demo")
    assert answer.exit_code == 0, answer.output
    time_s = whole.columns["time_s"]
    assert f"2 gaps in time (the longest {time_s[42] - time_s[21]:.2g} s, " in answer.stderr
    assert f"at {time_s[21] - time_s[0]:.3f} s the first): " in answer.stderr
    assert "with the reading before" in answer.stderr
    assert "gaps" not in call("replay", "1", "--state", state, "--rig", "demo").stderr
