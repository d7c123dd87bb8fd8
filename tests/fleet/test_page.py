"""What the report of a fleet says of its cells: each number from its own place, and what was left out told."""

import re
from collections.abc import Sequence

import numpy as np
import pytest

from gateway.fleet.drift import CellDrift, find_drifts
from gateway.fleet.page import fleet_page
from gateway.fleet.tasks import Row
from tests.fleet.test_drift import fleet, row

BADGE = re.compile(r"<span class='badge (\w+)'>(\w+)</span> Fleet: diagnose")


def page_of(rows: Sequence[Row], cells: Sequence[CellDrift] = ()) -> str:
    return fleet_page(rows, cells or find_drifts(rows), "diagnose")


def drifting() -> list[Row]:
    """Two recordings of a cell that is judged not, one that was not read, and three cells, of which one drifts."""
    return [
        *fleet(np.random.default_rng(1), 3, 8, slope_n=0.1),
        *(row("9", day, 0.3, ("warm-up", 0.1)) for day in range(2)),
        row("9", 3, 0.0, error="E403"),
    ]


def test_a_fleet_that_drifts_and_one_that_does_not_are_told_apart_at_the_first_look() -> None:
    steady = page_of(fleet(np.random.default_rng(1), 3, 8))
    assert BADGE.findall(page_of(drifting())) == [("warn", "drift")]
    assert BADGE.findall(steady) == [("good", "steady")]
    assert "<dd>4</dd><dd class='unit'>1 drifting</dd>" in page_of(drifting())
    assert "<dd>3</dd><dd class='unit'>0 drifting</dd>" in steady


def test_each_cause_is_counted_by_the_recordings_that_name_it() -> None:
    table = page_of(drifting()).partition("Causes that were named</h2>")[2].partition("</table>")[0]
    counted = re.findall(r"<th>([\w-]+)</th><td>(\d+)</td>", table)
    assert counted == [("creep", "24"), ("leak", "7"), ("warm-up", "2")]


def test_of_a_cell_whose_trend_is_not_judged_the_days_are_told_and_no_number_is_made_up() -> None:
    text = page_of(drifting())
    assert "<th>9</th><td>2</td><td>-</td><td>-</td><td>-</td><td>-</td><td></td>" in text
    assert "1 cell has fewer than 4 days or no dates: its trend is not judged." in text


def test_the_trend_is_drawn_from_the_first_day_to_the_last_and_called_so() -> None:
    """Of days without noise it goes through each of them."""
    text = page_of([row("a", day, 1.0 + 0.5 * day) for day in (0, 1, 3, 7)])
    line = [tuple(map(float, point.split(","))) for point in re.findall(r'walk" points="([^"]+)', text)[0].split()]
    dots = [tuple(map(float, point)) for point in re.findall(r"M?([\d.]+) ([\d.]+)h0", text.partition("dots core")[2])]
    assert len(dots) == 4
    assert [*line[0], *line[-1]] == pytest.approx([*dots[0], *dots[-1]], abs=0.11)
    assert '<i class="walk"></i>trend' in text


def test_of_more_cells_than_are_drawn_the_page_says_where_the_others_are() -> None:
    text = page_of([row(f"{cell:02d}", day, 0.3) for cell in range(41) for day in range(4)])
    assert text.count("<figure") == 40
    assert "40 of 41 cells are drawn; cells.parquet has all." in text
    assert "are drawn" not in page_of([row(f"{cell:02d}", 0, 0.3) for cell in range(40)])
