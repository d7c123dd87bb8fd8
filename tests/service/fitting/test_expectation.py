"""What is known of the rig that a ladder was recorded on, and what its data are compared with."""

from dataclasses import replace
from math import inf
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gateway.calibrations.store import CalibrationStore
from gateway.profiles import load_rig, shipped_profiles_folder
from gateway.recording import ColumnMapping, Recorder, Recording
from gateway.service.fitting import measured_response
from gateway.service.fitting.ladder_source import (
    RigContext,
    acceptance_bounds,
    expectation,
    find_rig,
    read_source,
    rig_of_state,
)


def recording(**header: Any) -> Recording:
    return Recording(Path("0001.fgr"), header, {"time_s": np.zeros(2)}, 2, False)


def test_a_ladder_is_compared_with_its_own_rigs_cell_and_cylinder() -> None:
    rig = load_rig("demo")
    expected, notes = expectation(recording(rig="demo", rig_fingerprint=rig.fingerprint), RigContext())
    assert rig.plant is not None
    assert expected.saturation_n == rig.control.supervision.saturation_n
    assert expected.area_mm2 == pytest.approx(1.0e6 * rig.plant.cylinder.area_m2) and expected.area_mm2 > 50.0
    assert notes == []


def test_only_the_recordings_own_rig_can_have_changed_since() -> None:
    _, of_its_own = expectation(recording(rig="demo", rig_fingerprint="another"), RigContext())
    _, of_another = expectation(recording(rig="demo", rig_fingerprint="another"), RigContext(rig="irc5-cell"))
    assert [["have changed since" in note for note in notes] for notes in (of_its_own, of_another)] == [[True], []]


def test_the_unit_that_was_given_and_the_calibration_in_use_are_what_counts(tmp_path: Path) -> None:
    expected, _ = expectation(recording(rig="demo"), RigContext(rig="demo", force_unit="kgf"))
    assert expected.force_unit == "kgf" and expected.rig == "demo"
    store = CalibrationStore(tmp_path, load_rig("demo").calibration)
    store.use(store.add(replace(load_rig("demo").calibration, name="another")))
    known = RigContext(rig="demo", state=tmp_path)
    assert expectation(recording(rig="demo"), known)[0].named.endswith("(another)")
    tolerance_n, in_use = acceptance_bounds(recording(rig="demo"), known)
    assert tolerance_n == load_rig("demo").control.defaults.in_band_tolerance_n
    assert in_use is not None and in_use.name == "another"


def test_a_state_is_of_the_rig_that_was_recorded_last(tmp_path: Path) -> None:
    for rig in ("before", "demo", ""):
        recorder = Recorder(tmp_path / "recordings", {"rig": rig} if rig else {}, ("time_s",))
        recorder.append((0.0,))
        recorder.close()
    assert rig_of_state(tmp_path) == "demo"


def test_a_rig_file_that_has_become_another_s_is_not_taken_for_it(tmp_path: Path) -> None:
    file = tmp_path / "cell-3.yaml"
    text = next(shipped_profiles_folder().rglob("rigs/demo.yaml")).read_text(encoding="utf-8")
    file.write_text(text.replace("name: demo", "name: cell-3"), encoding="utf-8")
    found, notes = find_rig("cell-3", str(file))
    assert found is not None and found.name == "cell-3" and notes == []
    found, notes = find_rig("cell-4", str(file))
    assert found is None and "rig cell-4 is not known here" in notes[0]


def test_a_unit_that_the_mapping_says_is_known_from_then_on(tmp_path: Path) -> None:
    table = tmp_path / "t.csv"
    table.write_text("t,u,f\n" + "".join(f"{row},{row},{10 * row}\n" for row in range(20)))
    for mapping, unit in (("time_s=t,command_v=u,force_n=f:kgf", "N"), ("time_s=t,command_v=u,force_n=f", None)):
        assert read_source(table, ColumnMapping.parse(mapping)).header.get("force_unit") == unit, mapping


def test_a_table_of_others_has_no_response() -> None:
    """Nobody knows when its commands went out."""
    measured = measured_response.measure_recorded_response(recording(rig="demo"), SimpleNamespace(model=None))  # type: ignore[arg-type]
    assert measured.response is None and measured.description == measured_response.NOT_OURS


@pytest.mark.parametrize("rig", ["demo", "nobody's"])
def test_a_response_is_measured_by_the_slew_of_the_rig_where_that_is_known(
    rig: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = SimpleNamespace(time_s=np.zeros(1), command_v=np.zeros(1), force_n=np.zeros(1))
    slews: list[float] = []
    monkeypatch.setattr(measured_response, "usable_rows", lambda columns, header: rows)
    monkeypatch.setattr(measured_response, "measure_response", lambda run, model, when: slews.append(run.slew_v_per_s))
    evaluation = SimpleNamespace(model=None)
    measured_response.measure_recorded_response(recording(rig=rig, ladder={}), evaluation)  # type: ignore[arg-type]
    assert slews == [load_rig("demo").control.limits.voltage_slew_v_per_s if rig == "demo" else inf]
