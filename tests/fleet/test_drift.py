"""Which cells drift: found where they do, with their cause, and not more often than promised where none does."""

import numpy as np
import pytest

from gateway.fleet.drift import ALPHA, find_drifts, fit_trend
from gateway.fleet.page import fleet_page, headline
from gateway.fleet.tasks import Row


def row(cell: str, day: int, value_n: float, *causes: tuple[str, float], error: str = "") -> Row:
    return {
        "file": f"{cell}/{day}",
        "cell": cell,
        "date": f"2026-11-{day + 1:02d}",
        "sha256": "",
        "value_n": None if error else value_n,
        "causes": [] if error else [{"name": name, "gain_n": gain_n} for name, gain_n in causes],
        "error_code": error,
        "error": "broken" if error else "",
    }


def fleet(rng: np.random.Generator, cells: int, days: int, slope_n: float = 0.0) -> list[Row]:
    """Cell 0 has the slope, and a leak that grows with it; all have creep of one size and noise of 0.05 N."""
    rows = []
    for cell in range(cells):
        for day in range(days):
            grown_n = slope_n * day if cell == 0 else 0.0
            causes = [("creep", 0.3)] + ([("leak", grown_n)] if grown_n else [])
            rows.append(row(str(cell), day, 0.3 + grown_n + rng.normal(0.0, 0.05), *causes))
    return rows


def test_the_cell_that_leaks_more_each_day_is_named_with_leak_and_no_other() -> None:
    cells = find_drifts(fleet(np.random.default_rng(1), 20, 8, slope_n=0.1))
    assert [one.cell for one in cells if one.drifts] == ["0"]
    assert cells[0].cause == "leak" and cells[0].change_n == pytest.approx(0.7, abs=0.1)
    trend = cells[0].trend
    assert trend is not None and trend.low < 0.1 < trend.high
    assert headline(cells).startswith("1 of 20 cells drifts: cell 0 (leak, +0.")


def test_among_many_fleets_without_a_drift_hardly_one_is_accused() -> None:
    rng = np.random.default_rng(7)
    accused = 0
    for _ in range(300):
        rows = fleet(rng, 12, 6)
        for each in rows:
            each["value_n"] = 0.3 + rng.normal(0.0, 1.0)  # so that no change is too small to matter
        accused += any(one.drifts for one in find_drifts(rows))
    assert accused <= 300 * ALPHA * 3


def test_a_trend_that_nobody_would_mind_is_none() -> None:
    rows = [row("a", day, 0.3 + 0.001 * day) for day in range(10)]
    (cell,) = find_drifts(rows)
    assert cell.trend is not None and cell.trend.chance < 1e-6 and not cell.drifts


def test_three_days_tell_no_trend_and_errors_are_counted_only() -> None:
    (cell,) = find_drifts([row("a", day, float(day)) for day in range(3)] + [row("a", 9, 0.0, error="E403")])
    assert cell.trend is None and not cell.drifts and cell.errors == 1
    assert "No cell has 4 days" in headline([cell])


def test_the_slope_and_its_interval_are_those_of_scipy() -> None:
    from scipy.stats import linregress, t

    rng = np.random.default_rng(3)
    days = [0.0, 1.0, 2.0, 4.0, 7.0, 9.0]
    values = [0.2 * day + float(rng.normal()) for day in days]
    trend, expected = fit_trend(days, values), linregress(days, values)
    assert trend is not None
    assert trend.slope_n_per_day == pytest.approx(expected.slope)
    assert trend.chance == pytest.approx(expected.pvalue)
    assert trend.high - trend.slope_n_per_day == pytest.approx(float(t.ppf(0.975, 4)) * expected.stderr)


def test_the_page_answers_first_and_hides_no_name_of_a_file() -> None:
    rows = [*fleet(np.random.default_rng(1), 3, 8, slope_n=0.1), row("<b>", 1, 0.0, error="E403")]
    text = fleet_page(rows, find_drifts(rows), "diagnose")
    assert "<h1>1 of 4 cells drifts: cell 0 (leak," in text
    assert "&lt;b&gt;" in text and "<b>" not in text
    assert text.count("<figure") >= 3
