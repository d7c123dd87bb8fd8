"""What the base model fits anew in each recording drifts, too: a seal that stiffens leaves no error behind."""

from pathlib import Path

import numpy as np
import pytest

from gateway.cli.fleet.rows import Question, diagnose_row
from gateway.fleet.drift import ALPHA, find_drifts
from gateway.fleet.page import fleet_page, headline
from gateway.fleet.tasks import Row, Task
from tests.diagnosis.machine import recorded, times_s
from tests.fleet.test_drift import row


def fleet(rng: np.random.Generator, slope_n: float, *, cells: int = 12, days: int = 8) -> list[Row]:
    """Friction of cell 0 grows, beside an error that does not."""
    return [
        row(str(cell), day, 0.3 + rng.normal(0.0, 0.05))
        | {
            "refitted": [
                {"name": "coulomb-friction", "value": 1.0, "unit": "N", "by_n": slope_n * day * (cell == 0) + noise_n},
                {"name": "lag_s", "value": 0.07, "unit": "s", "by_n": rng.normal(0.0, 0.05)},
            ]
        }
        for cell in range(cells)
        for day in range(days)
        for noise_n in [rng.normal(0.0, 0.05)]
    ]


def test_the_cell_whose_friction_grows_is_named_with_it_and_no_other() -> None:
    rows = [*fleet(np.random.default_rng(1), 0.1), row("0", 9, 0.0, error="E403")]
    cells = find_drifts(rows)
    assert [one.cell for one in cells if one.drifts] == ["0"]
    assert (cells[0].cause, cells[0].is_refitted, cells[0].errors) == ("coulomb-friction", True, 1)
    assert cells[0].change_n == cells[0].cause_n == pytest.approx(0.7, abs=0.15)
    assert headline(cells).startswith("1 of 12 cells drifts: cell 0 (coulomb-friction, refitted, +0.")
    assert "what refitting coulomb-friction makes up for (N) by day" in fleet_page(rows, cells, "diagnose")


def test_an_error_that_grows_is_told_before_what_is_refitted() -> None:
    rows = fleet(np.random.default_rng(2), 0.1)
    for each in rows[:8]:
        each["value_n"] += 0.1 * (int(each["date"][-2:]) - 1)
        each["causes"] = [{"name": "leak", "gain_n": each["value_n"], "group": ["leak"]}]
    assert [(one.cause, one.is_refitted) for one in find_drifts(rows) if one.drifts] == [("leak", False)]


@pytest.mark.parametrize("steepest", ["coulomb-friction", "lag_s"])
def test_of_two_numbers_that_drift_in_a_cell_the_one_that_changes_most_is_told(steepest: str) -> None:
    rng, rows = np.random.default_rng(3), fleet(np.random.default_rng(3), 0.0)
    for day, each in enumerate(rows[:8]):
        for number in each["refitted"]:
            number["by_n"] = (-0.2 if number["name"] == steepest else 0.1) * day + rng.normal(0.0, 0.02)
    assert [(one.cell, one.cause) for one in find_drifts(rows) if one.drifts] == [("0", steepest)]


@pytest.mark.long
def test_among_many_fleets_without_a_drift_hardly_one_is_accused() -> None:
    rng, accused = np.random.default_rng(7), 0
    for _ in range(300):
        rows = fleet(rng, 0.0, days=6)
        for each in rows:
            for number in each["refitted"]:
                number["by_n"] = rng.normal(0.0, 1.0)  # so that no change is too small to matter
        accused += any(one.drifts for one in find_drifts(rows))
    assert accused <= 300 * ALPHA * 3


def test_a_recording_s_row_tells_what_was_refitted_and_which_way(tmp_path: Path) -> None:
    """By the machine's own lag of 0.055 s, friction of 2.7 N, and the start's 0.072 s and 1 N."""
    found = recorded({"friction.coulomb_n": 2.7}, time_s=times_s(30.0))
    table = np.stack([found.time_s, found.command_v, found.force_n], axis=1)
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header="time_s,command_v,force_n", comments="")
    told = diagnose_row(Question(), Task(str(tmp_path / "a.csv"), "7", "2026-11-29", ""))
    refitted = {each["name"]: each for each in told["refitted"]}
    assert sorted(refitted) == ["area_m2", "coulomb-friction", "lag_s"]
    assert refitted["coulomb-friction"]["value"] == pytest.approx(2.7, rel=0.05)
    assert refitted["coulomb-friction"]["by_n"] == pytest.approx(1.7, abs=0.5)
    assert refitted["lag_s"]["by_n"] < -0.1
