"""Which cells drift: found where they do, with their cause, and not more often than promised where none does."""

import numpy as np
import pytest

from gateway.cli.fleet.cell_table import print_cells
from gateway.fleet.drift import ALPHA, find_drifts
from gateway.fleet.page import fleet_page, headline
from gateway.fleet.tasks import Row
from gateway.fleet.trend import fit_trend, level_of


def row(cell: str, day: int, value_n: float, *causes: tuple[str, float], error: str = "") -> Row:
    return {
        "file": f"{cell}/{day}",
        "cell": cell,
        "date": f"2026-11-{day + 1:02d}",
        "sha256": "",
        "value_n": None if error else value_n,
        "causes": [] if error else [{"name": name, "gain_n": gain_n, "group": [name]} for name, gain_n in causes],
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


@pytest.mark.long
def test_among_many_fleets_without_a_drift_hardly_one_is_accused() -> None:
    rng = np.random.default_rng(7)
    accused = 0
    for _ in range(300):
        rows = fleet(rng, 12, 6)
        for each in rows:
            each["value_n"] = 0.3 + rng.normal(0.0, 1.0)  # so that no change is too small to matter
        accused += any(one.drifts for one in find_drifts(rows))
    assert accused <= 300 * ALPHA * 3


def test_a_day_of_more_recordings_has_no_more_of_a_cause() -> None:
    """The creep that every recording has would be why a cell drifts that is recorded more often by now."""
    days = [(day, each) for day in range(8) for each in range(1 + day)]
    rows = [row("a", day, 0.3 + 0.1 * day + 0.001 * each, ("creep", 0.3), ("leak", 0.1 * day)) for day, each in days]
    assert [(one.cause, one.cause_n) for one in find_drifts(rows)] == [("leak", pytest.approx(0.7))]


def test_a_cause_that_shrinks_is_not_why_the_error_grows() -> None:
    rows = [row("a", day, 0.3 + 0.1 * day, ("leak", 0.9 - 0.1 * day), ("creep", 0.3)) for day in range(8)]
    (cell,) = find_drifts(rows)
    assert cell.drifts and cell.change_n == pytest.approx(0.7)
    assert (cell.cause, cell.cause_n, cell.group) == ("", 0.0, ()), "nobody has said what it is"


def test_a_trend_that_nobody_would_mind_is_none() -> None:
    rows = [row("a", day, 0.3 + 0.001 * day) for day in range(10)]
    (cell,) = find_drifts(rows)
    assert cell.trend is not None and cell.trend.chance < 1e-6 and not cell.drifts


def test_three_days_tell_no_trend_and_errors_are_counted_only() -> None:
    (cell,) = find_drifts([row("a", day, float(day)) for day in range(3)] + [row("a", 9, 0.0, error="E403")])
    assert cell.trend is None and not cell.drifts and cell.errors == 1
    assert "No cell has 4 days" in headline([cell])


@pytest.mark.parametrize("days", [5, 6, 10, 14])
def test_the_chance_is_small_no_more_often_than_it_says_and_the_interval_holds_the_slope(days: int) -> None:
    rng, runs = np.random.default_rng(3), 600
    trends = [fit_trend(list(range(days)), rng.standard_t(3, days).tolist()) for _ in range(runs)]
    found = [each for each in trends if each is not None]
    for level in (0.05, 0.01):
        assert sum(each.chance <= level for each in found) <= runs * level * 1.3 + 3
    assert sum(each.low <= 0.0 <= each.high for each in found) >= 0.93 * runs


def test_slope_and_interval_of_many_days_are_those_of_scipy_and_the_line_halves_them() -> None:
    from scipy.stats import theilslopes

    rng = np.random.default_rng(3)
    days = [0.0, 1.0, 2.0, 4.0, 7.0, 9.0, 10.0, 12.0, 13.0, 15.0, 16.0, 20.0]
    values = [0.2 * day + float(rng.normal()) for day in days]
    trend, expected = fit_trend(days, values), theilslopes(values, days)
    assert trend is not None and trend.slope_n_per_day == pytest.approx(expected.slope)
    assert trend.low <= expected.low_slope and trend.high >= expected.high_slope
    assert trend.high - trend.low < 1.5 * (expected.high_slope - expected.low_slope)
    level = level_of(trend, days, values)
    assert sum(value > level + trend.slope_n_per_day * day for day, value in zip(days, values, strict=True)) == 6


def test_a_bad_day_makes_no_drift_and_in_two_weeks_hides_none() -> None:
    steady, drifting = (fleet(np.random.default_rng(4), 20, 14, slope_n=slope_n) for slope_n in (0.0, 0.1))
    for rows in (steady, drifting):
        rows[13]["value_n"] += 1.0 * (rows is steady)  # cell 0, its last day
        rows[4]["value_n"] += 2.0 * (rows is drifting)
    assert not any(one.drifts for one in find_drifts(steady))
    assert [one.cell for one in find_drifts(drifting) if one.drifts] == ["0"]


def test_a_name_that_stands_on_two_late_days_is_not_why_a_cell_has_drifted_for_ten() -> None:
    rows = [row("a", day, 0.06 * day, ("leak", 0.05 * day)) for day in range(7)]
    rows += [
        row("a", 7, 0.39, ("backlash", 0.86)),
        row("a", 8, 0.49, ("leak", 0.45)),
        row("a", 9, 0.57, ("backlash", 0.5)),
    ]
    rows[2]["causes"][0]["group"] = ["leak", "creep"]
    (cell,) = find_drifts(rows)
    assert cell.drifts and (cell.cause, cell.group) == ("leak", ("leak",))
    for each in rows:
        for cause in each["causes"]:
            cause["group"] = [cause["name"], "warm-up"]
    assert headline(find_drifts(rows)).startswith("1 of 1 cells drifts: cell a (leak or warm-up, +0.")


def test_a_cell_that_gets_better_has_changed_as_well_by_what_has_gone_and_not_by_what_came_beside_it() -> None:
    rows = [row("a", day, 2.0 - 0.06 * day, ("leak", 1.0 - 0.08 * day), ("creep", 0.12 * day)) for day in range(10)]
    (cell,) = find_drifts(rows)
    assert cell.drifts and cell.change_n == pytest.approx(-0.54)
    assert cell.cause == "leak" and cell.cause_n == pytest.approx(-0.72)


def test_the_page_answers_first_and_hides_no_name_of_a_file() -> None:
    rows = [*fleet(np.random.default_rng(1), 3, 8, slope_n=0.1), row("<b>", 1, 0.0, error="E403")]
    rows[-1]["error"] = "line 3, force_n: '<b>1' is no number"
    text = fleet_page(rows, find_drifts(rows), "diagnose")
    assert "<h1>1 of 4 cells drifts: cell 0 (leak," in text
    assert text.count("&lt;b&gt;") >= 2 and "&lt;b&gt;1" in text and "<b>" not in text
    assert "<dd>24</dd><dd class='unit'>read</dd>" in text and "<dd>1</dd><dd class='unit'>recordings</dd>" in text
    assert text.count("<figure") >= 3


def test_a_cell_is_told_by_its_whole_name_whatever_stands_in_it(capsys: pytest.CaptureFixture[str]) -> None:
    """Two cells were both shown as `press`, and a third ended the command."""
    cells = find_drifts(row(name, 0, 0.1) for name in ("press[left]", "press[right]", "[/x]"))
    print_cells(cells)
    told = capsys.readouterr().out
    assert all(one.cell in told for one in cells) and len(cells) == 3


def test_of_more_cells_than_are_shown_the_rest_is_counted(capsys: pytest.CaptureFixture[str]) -> None:
    cells = find_drifts(row(f"{cell:02d}", day, float(day)) for cell in range(23) for day in range(8))
    assert headline(cells).startswith("23 of 23 cells drift: cell 00 (") and headline(cells).endswith("; and 20 more")
    print_cells(cells)
    assert capsys.readouterr().out.endswith("and 3 cells more: cells.parquet has all\n")


def test_two_values_of_one_day_and_three_days_make_no_trend() -> None:
    """Between two values of one moment no slope is any number."""
    assert fit_trend([0.0, 1.0, 1.0, 2.0, 3.0], [0.0, 1.0, 5.0, 2.0, 3.0]) is None
    assert fit_trend([0.0, 1.0, 2.0], [0.0, 1.0, 2.0]) is None
    assert fit_trend([0.0, 1.0, 2.0, 3.0], [0.0, 1.0, 2.0, 3.5]) is not None
