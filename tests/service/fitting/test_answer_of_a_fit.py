"""What becomes of a fit without fitting: what is stored once, what is told of what failed, and by what it is judged."""

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gateway.bsfm.fit.model_error import Error
from gateway.bsfm.ladder.ladder_error import LadderError, LadderFlaw
from gateway.calibrations.store import CalibrationStore
from gateway.cli.setup.starter_rig import starter_rig
from gateway.numbered_documents.store import StoreError
from gateway.profiles import load_rig
from gateway.recording import RecordingError
from gateway.service.fitting import acceptance, fit_process, ladder_fit, ladder_source, measured_response
from gateway.service.fitting.acceptance import judge_fit
from gateway.service.fitting.fit_process import fit_and_store
from gateway.service.fitting.measured_response import measure_recorded_response
from tests.calibrations.coefficients import calibration


class Fits:
    """The parts that a fit is made of, which answer at once."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.made = calibration(8)
        self.asked, self.reports = list[Any](), list[Path]()
        self.fails: Exception | None = None
        monkeypatch.setattr(ladder_source, "read_source", lambda recording: recording)
        monkeypatch.setattr(ladder_fit, "fit_recording", self._fit)
        monkeypatch.setattr(ladder_fit, "calibration_of", lambda fit, range_n: self.made)
        monkeypatch.setattr(ladder_fit, "write_report", lambda fit, path: self.reports.append(path))

    def _fit(self, source: Any, request: Any, context: Any) -> Any:
        self.asked.append((source, request, context))
        if self.fails is not None:
            raise self.fails
        return SimpleNamespace(document={"kept": True})


@pytest.fixture
def fits(monkeypatch: pytest.MonkeyPatch) -> Fits:
    return Fits(monkeypatch)


def store_of(state: Path) -> CalibrationStore:
    return CalibrationStore(state, load_rig("demo").calibration)


def test_the_same_data_is_stored_once_and_told_by_its_number_again(fits: Fits, tmp_path: Path) -> None:
    first = fit_and_store(tmp_path / "1.fgr", "demo", tmp_path)
    assert first == {"stored": 2, "report": str(fits.reports[0]), "document": first["document"]}
    assert json.loads(Path(first["document"]).read_text()) == {
        "kept": True,
        "calibration": 2,
        "report": first["report"],
    }
    assert fit_and_store(tmp_path / "1.fgr", "demo", tmp_path) == first
    assert len(fits.reports) == 1, "its report stands"
    Path(first["document"]).unlink()  # interrupted before it was written
    assert fit_and_store(tmp_path / "1.fgr", "demo", tmp_path) == first
    assert len(fits.reports) == 2 and Path(first["document"]).exists()
    fits.made = calibration(9)
    assert fit_and_store(tmp_path / "2.fgr", "demo", tmp_path)["stored"] == 3


def test_a_ladder_of_a_rig_without_ports_yet_is_fitted(fits: Fits, tmp_path: Path) -> None:
    """A minute's ladder of a rehearsed rig, as `init` writes it, ended with "output.port is a placeholder"."""
    rig = tmp_path / "cell.yaml"
    rig.write_text(starter_rig("cell"))
    assert fit_and_store(tmp_path / "1.fgr", str(rig), tmp_path)["stored"] == 2


def test_a_fit_that_is_not_offered_is_told_with_its_number_and_why(fits: Fits, tmp_path: Path) -> None:
    fits.made = calibration(8, rejected="it is out of band")
    for _ in range(2):
        told = fit_and_store(tmp_path / "1.fgr", "demo", tmp_path)
        assert (told["rejected"], told["refused"]) == (
            2,
            "E435 calibration 2 is stored as rejected and not offered: it is out of band",
        )
        assert "stored" not in told and Path(told["document"]).exists()


@pytest.mark.parametrize("rejected", ["", "it is out of band"])
def test_a_report_that_the_disk_does_not_take_makes_no_refusal_of_a_calibration_that_is_stored(
    rejected: str, fits: Fits, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was told as refused, and nobody knew its number."""
    fits.made = calibration(8, rejected=rejected)
    with monkeypatch.context() as full:
        full.setattr(ladder_fit, "write_report", lambda fit, path: (_ for _ in ()).throw(OSError(28, "No space left")))
        told = fit_and_store(tmp_path / "1.fgr", "demo", tmp_path)
    assert told["rejected" if rejected else "stored"] == 2 and ("refused" in told) is bool(rejected)
    assert "0002.html: No space left; only the report is missing" in told["unreported"] and "report" not in told
    assert "report" in fit_and_store(tmp_path / "1.fgr", "demo", tmp_path) and len(fits.reports) == 1


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (LadderError(LadderFlaw.NO_FIT, "no stair"), "E421 {path}: no stair"),
        (RecordingError("cut off"), "E403 cut off"),
        (StoreError("E431", "no room"), "E431 no room"),
        (PermissionError(13, "Permission denied", "/there"), "E106 /there: Permission denied"),
        (OSError(5, "Input/output error"), "E106 {path}: Input/output error"),
    ],
)
def test_what_fails_is_told_by_its_kind_and_stores_nothing(
    fits: Fits, error: Exception, sentence: str, tmp_path: Path
) -> None:
    path = tmp_path / "1.fgr"
    fits.fails = error
    assert fit_and_store(path, "demo", tmp_path) == {"refused": sentence.format(path=path)}
    assert store_of(tmp_path).list() == []
    assert "refused" in fit_and_store(path, "no-such-rig", tmp_path)


def test_the_blend_of_the_calibration_in_use_is_what_a_ladder_without_reversals_gets(
    fits: Fits, tmp_path: Path
) -> None:
    fit_and_store(tmp_path / "1.fgr", "demo", tmp_path)
    (_, request, context) = fits.asked[0]
    assert request.reference_span_n == load_rig("demo").calibration.blend_span_n
    assert (context.rig, context.state) == ("demo", tmp_path)
    store_of(tmp_path).use(2)
    fit_and_store(tmp_path / "1.fgr", "demo", tmp_path)
    assert fits.asked[1][1].reference_span_n == fits.made.blend_span_n != request.reference_span_n


@pytest.mark.parametrize(("stops", "span_n"), [({"slip_radii_v": (1.5,), "slip_shares": (1.0,)}, None), ({}, 0.0)])
def test_a_blend_that_slip_stops_leave_unused_is_none_for_a_ladder_without_reversals(
    stops: dict[str, Any], span_n: float | None, fits: Fits, tmp_path: Path
) -> None:
    """A set with stops may come with a span of 0: taken over it would switch the branches at each reversal."""
    store = store_of(tmp_path)
    store.use(store.add(calibration(8, blend_span_n=0.0, **stops)))
    fit_and_store(tmp_path / "1.fgr", "demo", tmp_path)
    assert fits.asked[0][1].reference_span_n == span_n


@pytest.mark.parametrize(("rejected", "code"), [("", 0), ("it is out of band", 65)])
def test_the_process_ends_well_only_with_a_fit_that_is_offered(
    fits: Fits, rejected: str, code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.setattr(fit_process.priority, "lower_priority", lambda: None)
    fits.made = calibration(8, rejected=rejected)
    asked = json.dumps({"recording": str(tmp_path / "1.fgr"), "rig": "demo", "state": str(tmp_path)})
    assert fit_process.main([asked]) == code
    assert json.loads(capsys.readouterr().out)["document"].endswith("0002.json")


def measured(monkeypatch: pytest.MonkeyPatch, header: dict[str, str], rows: Callable[..., Any]) -> Any:
    monkeypatch.setattr(measured_response, "usable_rows", rows)
    monkeypatch.setattr(measured_response, "measure_response", lambda run, model, when: (run, when))
    evaluation: Any = SimpleNamespace(model=None)
    recording: Any = SimpleNamespace(header=header, columns={})
    return measure_recorded_response(recording, evaluation)


def test_rows_that_are_none_are_why_there_is_no_response_and_the_day_is_the_runs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def refuse(columns: Any, header: Any) -> Any:
        raise LadderError(LadderFlaw.NO_FIT, "no row can be used")

    rows = SimpleNamespace(time_s=1, command_v=2, force_n=3)
    told = measured(monkeypatch, {"ladder": "x"}, refuse)
    assert (told.response, told.why_not) == (
        None,
        "the response was not measured: no row can be used",
    )
    for day, when in (("2026-05-01T10:00:00Z", " on 2026-05-01"), ("", "")):
        run, said = measured(monkeypatch, {"ladder": "x", "started_utc": day}, lambda *_: rows)
        assert (run.time_s, run.command_v, run.force_n, said) == (1, 2, 3, when)


@pytest.mark.parametrize(
    ("rms_n", "other_n", "tolerance_n", "why"),
    [
        (0.4, 0.4, 0.5, ""),
        (0.5, None, 0.5, ""),
        (0.6, None, 0.5, "allowed 0.500 N"),
        (0.5, 0.4, 0.5, "0.400 N by calibration 7 in use on the same data"),
        (0.6, 0.4, 0.5, "allowed 0.500 N (in_band_tolerance_n of the rig) and 0.400 N by calibration 7"),
        (9.0, 0.1, None, ""),
    ],
)
def test_a_fit_is_judged_by_the_band_and_by_what_is_in_use_on_the_same_data(
    rms_n: float, other_n: float | None, tolerance_n: float | None, why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(acceptance, "measured_error_n", lambda model, checked: np.full(10, model))
    evaluation: Any = SimpleNamespace(model=rms_n, checked=SimpleNamespace(minor_v=[1.0, 2.0]))
    in_use: Any = None if other_n is None else SimpleNamespace(model=lambda: other_n, number=7)
    judged = judge_fit(evaluation, tolerance_n, in_use)
    assert judged.rejected == "" if not why else why in judged.rejected
    assert judged.error == Error(pytest.approx(rms_n), pytest.approx(rms_n), 10)
    facts = judged.facts()
    assert (facts["in_use"], facts["in_use_rms_n"]) == (
        7 if other_n else None,
        pytest.approx(other_n) if other_n else None,
    )
    assert (facts["rms_n"], facts["points"], facts["reversals"]) == (pytest.approx(rms_n), 10, True)
    assert (facts["allowed_rms_n"], facts["rejected"]) == (tolerance_n, judged.rejected)
    evaluation.checked.minor_v = [1.0]
    assert judge_fit(evaluation, tolerance_n, in_use).has_walk is False


def test_a_document_that_another_one_of_this_number_has_left_is_not_told_as_its_own(fits: Fits, tmp_path: Path) -> None:
    (tmp_path / "calibrations").mkdir()
    (tmp_path / "calibrations" / "0002.json").write_text('{"calibration": 2, "kept": "of another one"}')
    told = fit_and_store(tmp_path / "1.fgr", "demo", tmp_path)
    assert json.loads(Path(told["document"]).read_text())["kept"] is True


@pytest.mark.parametrize(("weights", "name"), [((1.0, 1.2), "bsfm-1"), ((1.0, 0.9, 1.2), "bsfm-2")])
def test_a_calibration_that_nobody_has_named_bears_the_order_that_it_has(weights: tuple[float, ...], name: str) -> None:
    """Slip stops are fitted with branches of a higher order than the chosen staircase: it was listed as bsfm-1, bsfm n=2."""
    document = {"chosen": {"model": "bsfm", "order": 1}, "model": {"rising_weights": list(weights)}}
    assert ladder_fit.default_name(document) == name
