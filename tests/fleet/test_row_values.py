"""What stands in a fleet's rows, cells and page is what was found: from one recording's answer to the trend of its cell."""

import re
from math import sqrt
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.bsfm import Branches, RationalBezier
from gateway.cli.fleet.files import cell_row, day_rows
from gateway.cli.fleet.rows import Question, diagnose_row, fit_row
from gateway.diagnosis import Diagnosis, Options
from gateway.fleet.drift import CellDrift, _holm, find_drifts, undated
from gateway.fleet.page import describe_drift, fleet_page
from gateway.fleet.tasks import Task, find_tasks
from tests.fleet.test_drift import row
from tests.reports.fake_diagnosis import FRICTION, diagnosis

TASK = Task("cell=7/date=2026-11-01/a.csv", "7", "2026-11-01", "abc")


def test_of_a_diagnosis_the_drift_is_watched_beyond_the_noise_and_a_cause_s_gain_is_what_it_saves(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[Any] = []
    known = {"calibration_noise_n": 0.02, "late_s": 0.3, "quantum_n": 0.01, "is_own": True}

    def search(measurements: list[Any], plant: str, options: Options) -> Diagnosis:
        told.append((plant, options))
        return diagnosis(causes=(FRICTION,))

    told: list[Any] = []

    def read(files: list[str], **options: Any) -> SimpleNamespace:
        asked.append((files, options["rig"], options["columns"]))
        return SimpleNamespace(measurements=[], plant=SimpleNamespace(plant="its rig's"), **known)

    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "1")
    monkeypatch.setattr("gateway.cli.diagnosis.inputs.read_sources", read)
    monkeypatch.setattr("gateway.diagnosis.diagnose", search)
    found = diagnose_row(Question("cell-7", "map.yaml"), TASK)
    assert told == [("its rig's", Options(**known))], "what the recording's own rig says goes into the search"
    assert asked == [([TASK.path], "cell-7", "map.yaml")]
    assert (found["rms_before_n"], found["rms_after_n"], found["floor_n"]) == (1.186, 0.257, 0.12)
    assert found["value_n"] == pytest.approx(sqrt(1.186**2 - 0.12**2))
    ((name, gain_n),) = [(cause["name"], cause["gain_n"]) for cause in found["causes"]]
    assert (name, gain_n) == (FRICTION.name, pytest.approx(1.186 - 0.257))


def test_of_a_fit_the_force_amid_both_branches_is_watched_by_the_rig_that_was_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    branches = Branches(
        RationalBezier(0.0, 8.0, (0.0, 40.0), (1.0, 1.0)), RationalBezier(0.0, 8.0, (0.0, 60.0), (1.0, 1.0))
    )
    asked: list[Any] = []

    def fit(recording: Any, request: Any, context: Any) -> SimpleNamespace:
        asked.append(context.rig)
        chosen = {"model": "bsfm", "order": 1, "heldout_rms_n": 0.3}
        model = SimpleNamespace(branches=branches)
        verdict = SimpleNamespace(error=SimpleNamespace(rms_n=0.1, max_n=0.2))
        evaluation = SimpleNamespace(model=model, span_n=3.0)
        return SimpleNamespace(document={"chosen": chosen}, evaluation=evaluation, verdict=verdict)

    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "1")
    monkeypatch.setattr("gateway.service.fitting.ladder_source.read_source", lambda *given: None)
    monkeypatch.setattr("gateway.service.fitting.ladder_fit.fit_recording", fit)
    found = fit_row(Question(rig="cell-7"), TASK)
    assert asked == ["cell-7"] and found["value_n"] == pytest.approx(0.5 * (20.0 + 30.0))
    assert (found["rms_n"], found["max_n"], found["held_out_rms_n"]) == (0.1, 0.2, 0.3)
    assert (found["rising_handles_n"], found["falling_handles_n"]) == ([0.0, 40.0], [0.0, 60.0])


def test_a_cell_is_told_by_the_folders_alone(tmp_path: Path) -> None:
    folder = tmp_path / "cell=7" / "date=2026-11-01"
    folder.mkdir(parents=True)
    (folder / "cell=x.csv").write_text("x")
    assert [(task.cell, task.date) for task in find_tasks([f"{tmp_path}/**/*.csv"])] == [("7", "2026-11-01")]


def test_behind_the_first_cell_that_drifts_the_next_is_judged_among_the_others() -> None:
    """Holm's procedure: by Bonferroni's the second one would have to be twice as sure."""
    assert _holm({"a": 0.004, "b": 0.009, "c": 0.5}) == set()
    assert _holm({"a": 0.003, "b": 0.0049, "c": 0.5}) == {"a", "b"}
    assert _holm({"a": 0.003, "b": 0.009, "c": 0.5}) == {"a"}


def test_a_cell_is_judged_as_one_of_all_that_were_asked() -> None:
    """By itself each is sure of a trend, for its six days rise one by one: among twenty, chance gives that often enough."""
    rows = [
        row(str(cell), day, value_n) for cell in range(20) for day, value_n in enumerate((0.0, 0.1, 0.2, 0.3, 0.4, 9.0))
    ]
    assert [one.drifts for one in find_drifts(rows[:6])] == [True]
    assert not any(one.drifts for one in find_drifts(rows))


def test_what_has_no_answer_is_not_counted_as_without_a_day() -> None:
    rows = [row("a", 1, 1.0), row("a", 2, 0.0, error="E403"), row("a", 3, 1.0)]
    rows = [each | {"date": "3.11.2026"} for each in rows]
    assert undated(rows) == [rows[0], rows[2]]


def test_days_and_cells_are_written_as_they_were_found() -> None:
    rows = [
        row("a", 0, 1.0, ("leak", 0.1)),
        row("a", 0, 3.0),
        row("a", 0, 0.0, error="E403"),
        row("a", 1, 0.0, error="E1"),
    ]
    whole, broken = day_rows(rows)
    assert whole == {
        "cell": "a", "date": "2026-11-01", "recordings": 3, "errors": 1, "value_n": 2.0, "causes": ["leak"],
    }  # fmt: skip
    assert (broken["recordings"], broken["errors"], broken["value_n"], broken["causes"]) == (1, 1, None, [])
    (cell,) = find_drifts(row("a", day, 0.5 * day + 0.1 * (day % 2), ("leak", 0.1 * day)) for day in range(6))
    trend, told = cell.trend, cell_row(cell)
    assert trend is not None and trend.low < trend.slope_n_per_day < trend.high
    names = ("slope_low_n_per_day", "slope_n_per_day", "slope_high_n_per_day", "chance")
    assert [told[name] for name in names] == [trend.low, trend.slope_n_per_day, trend.high, trend.chance]
    assert (told["change_n"], told["cause"], told["cause_n"]) == (cell.change_n, "leak", pytest.approx(0.5))


def test_a_day_is_its_median_and_its_trend_is_drawn_the_way_that_it_goes() -> None:
    rows = [row("a", day, 1.0 + 0.5 * day) for day in range(6)]
    rows += [row("a", 2, value_n) for value_n in (2.0, 90.0)]
    (cell,) = find_drifts(rows)
    assert cell.values_n == pytest.approx((1.0, 1.5, 2.0, 2.5, 3.0, 3.5))
    html = fleet_page(rows, [cell], "diagnose")
    assert "<td>+0.500 .. +0.500</td>" in html
    noisy = [row("a", day, 1.0 + 0.5 * day + 0.1 * (day % 2)) for day in range(6)]
    (cell,) = find_drifts(noisy)
    assert cell.trend and cell.trend.low < 0.5 < cell.trend.high
    assert f"<td>{cell.trend.low:+.3f} .. {cell.trend.high:+.3f}</td>" in fleet_page(noisy, [cell], "diagnose")
    heights = [
        float(point.split(",")[1]) for point in re.findall(r"walk[^>]*(?:points|d)=.M?([^\"']+)", html)[0].split()
    ]
    assert heights[0] > heights[-1], "downwards is up"


def test_a_drift_is_told_by_its_own_change_and_not_by_that_of_its_cause() -> None:
    one = CellDrift("7", "2026-11-01", (0.0, 5.0), (0.1, 0.9), None, 0.82, True, "leak", 0.5, ("leak",), 0)
    assert describe_drift(one) == "cell 7 (leak, +0.82 N in 5 days)"
