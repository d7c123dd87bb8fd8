"""Which fits are offered: a bad one, or one worse than what is in use, is kept with its reason and not used by accident."""

import json
from dataclasses import replace
from itertools import pairwise
from math import pi, sin
from pathlib import Path

import numpy as np
import pytest

from gateway.bsfm import CoefficientLimits
from gateway.bsfm.fit.model_error import Error, branch_error_n, measured_error_n
from gateway.bsfm.ladder.check import CheckedLadder
from gateway.bsfm.ladder.measured_ladder import Ladder
from gateway.bsfm.slip.reversal import LinearBlend
from gateway.calibrations.activation import Activation
from gateway.calibrations.store import CalibrationStore
from gateway.numbered_documents.store import StoreError
from gateway.profiles import load_rig
from gateway.recording import Recorder
from gateway.service.fitting.acceptance import _beyond_band, _worse
from gateway.service.fitting.fit_process import fit_and_store

TURNS_V = [8.0, 7.0, 2.0, 5.0, 3.0, 4.5, 1.0, 6.0, 3.5, 5.5, 0.5, 2.5, 1.5, 3.0]


def recorded(state: Path, step_v: float = 1.0, shape: float = 0.0, walk: bool = True) -> Path:
    """A play of 3 N on a thrust that bends by 4 N, and waves by `shape` N: two groups and partial reversals, 10 Hz."""
    up = np.arange(0.0, 8.01, step_v).tolist()
    partly = (
        [volts for a, b in pairwise([0.0, *TURNS_V]) for volts in np.linspace(a, b, 4)[1:].tolist()] if walk else []
    )
    recorder = Recorder(state / "recordings", {"rig": "demo", "name": "left cell"}, ("time_s", "command_v", "force_n"))
    rng, time_s, newtons = np.random.default_rng(5), 0.0, 0.0
    for volts in [*(up + up[-2::-1]) * 2, *partly, 0.0]:
        for _ in range(5):
            recorder.append((time_s, volts, newtons + rng.normal(0.0, 0.02)))
            time_s += 0.1
            thrust_n = 8.0 * volts + 4.0 * sin(0.125 * pi * volts) + shape * sin(2.5 * volts)
            newtons = float(np.clip(newtons, thrust_n - 0.2 * volts, thrust_n + 0.2 * volts))
    recorder.close()
    return recorder.path


def store_of(state: Path) -> CalibrationStore:
    return CalibrationStore(state, load_rig("demo").calibration)


def test_a_good_fit_is_offered_under_the_users_name_with_its_error_on_all_points(tmp_path: Path) -> None:
    result = fit_and_store(recorded(tmp_path), "demo", tmp_path)
    stored = store_of(tmp_path).load(result["stored"])
    document = json.loads(Path(result["document"]).read_text(encoding="utf-8"))
    assert (stored.name, stored.rejected) == ("left cell", "")
    assert document["measured"]["points"] == document["ladder"]["points"] + document["ladder"]["minor_points"] - 1
    assert stored.rms_n == pytest.approx(document["measured"]["rms_n"])
    report = Path(result["report"]).read_text(encoding="utf-8")
    assert f"<title>left cell · calibration {result['stored']}</title>" in report
    assert f"Calibration {result['stored']} · left cell" in report
    assert f"{stored.rms_n:.3f}" in report
    assert "reversals included" in report


@pytest.mark.sampled
@pytest.mark.parametrize("why", ["the band", "what is in use"])
def test_what_is_out_of_band_or_worse_than_what_is_in_use_is_kept_and_not_offered(why: str, tmp_path: Path) -> None:
    if why == "the band":
        result, words = (
            fit_and_store(recorded(tmp_path, shape=3.0), "demo", tmp_path),
            "allowed 1.000 N (in_band_tolerance_n",
        )
    else:
        store_of(tmp_path).use(fit_and_store(recorded(tmp_path), "demo", tmp_path)["stored"])
        result, words = (
            fit_and_store(recorded(tmp_path, step_v=2.0, walk=False), "demo", tmp_path),
            "N by calibration 2 in use on the",
        )
    assert "stored" not in result
    assert result["refused"].startswith(f"E435 calibration {result['rejected']} is stored as rejected")
    before = store_of(tmp_path).find_selected().selection
    store = store_of(tmp_path)
    rejected = store.load(result["rejected"])
    assert words in rejected.rejected
    assert "Rejected, not offered" in Path(result["report"]).read_text(encoding="utf-8")
    activation = Activation(store, CoefficientLimits(cell_range_n=98.0))
    with pytest.raises(StoreError, match=f"E436 calibration {rejected.number} was rejected: .*--force"):
        activation.use_offered(rejected.number)
    assert store.find_selected().selection == before
    assert activation.use_offered(rejected.number, force=True).calibration == rejected
    assert store_of(tmp_path).find_selected().document == rejected


@pytest.mark.parametrize(("in_use_n", "band_n", "most_n"), [(1.0, 1.0, 1.1), (0.1, 1.0, 0.15), (0.1, 4.0, 0.3)])
def test_worse_is_by_more_than_a_tenth_and_by_more_than_a_twentieth_of_the_band(
    in_use_n: float, band_n: float, most_n: float
) -> None:
    for rms_n, is_worse in ((most_n - 0.001, False), (most_n + 0.001, True)):
        assert bool(_worse(Error(rms_n, rms_n, 50), Error(in_use_n, in_use_n, 50), 7, band_n)) is is_worse


def test_the_band_is_one_of_the_rms_and_not_of_the_worst_point() -> None:
    for rms_n, is_beyond in ((0.999, False), (1.0, False), (1.001, True)):
        assert bool(_beyond_band(Error(rms_n, 3.0, 50), 1.0)) is is_beyond


def test_without_a_reversal_part_the_branches_are_judged_and_it_is_said(tmp_path: Path) -> None:
    result = fit_and_store(recorded(tmp_path, walk=False), "demo", tmp_path)
    measured = json.loads(Path(result["document"]).read_text(encoding="utf-8"))["measured"]
    assert not measured["reversals"]
    assert measured["rms_n"] < 0.3


def test_slip_stops_in_use_are_judged_with_their_reversals_by_a_ladder_without_a_reversal_part() -> None:
    """Their branches lie beside the stairs behind the top: a fit five times worse than what is in use was offered."""
    model = load_rig("demo").calibration.model()
    forces_n = [*np.linspace(1.0, 58.0, 8).tolist(), *np.linspace(58.0, 1.0, 8)[1:].tolist()]
    memory, before_n, volts = model.reversal.start(), forces_n[0], []
    for force_n in forces_n:
        memory, before_n = model.memory_after(memory, before_n, force_n), force_n
        volts.append(model.voltage_v(force_n, model.branch_share(memory))[0])
    way, none = [1] * 8 + [-1] * 7, np.array([])
    ladder = Ladder(np.array(volts), np.array(forces_n), np.array(way), np.zeros(15, int))
    checked = CheckedLadder(ladder, none, none, 0.1, 8.0, ())
    assert Error.of(branch_error_n(model, ladder)).rms_n > 0.5
    assert Error.of(measured_error_n(model, checked)).max_n < 0.01
    blend = replace(model, reversal=LinearBlend(14.0))
    assert np.array_equal(measured_error_n(blend, checked), branch_error_n(model, ladder)), "its span may be assumed"
