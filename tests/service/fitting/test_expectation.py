"""What is known of the rig that a ladder was recorded on, and what its data are compared with."""

from math import inf
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gateway.profiles import load_rig
from gateway.recording import Recording
from gateway.service.fitting import measured_response
from gateway.service.fitting.ladder_source import RigContext, expectation


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
