"""What the push gate leaves to the long run."""

import itertools
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import settings
from hypothesis._settings import local_settings

from tests.gate.budgets import examples, leave_out_long, scenes, striped


class Item(SimpleNamespace):
    """As much of pytest's as is asked for."""

    __hash__ = object.__hash__

    def add_marker(self, mark: Any) -> None:
        self.skipped = mark.name == "skip"


def table(name: str, cases: int, *marks: str) -> list[Any]:
    return [Item(nodeid=f"{name}[{case}]", keywords=set(marks), skipped=False) for case in range(cases)]


def run_of(items: list[Any]) -> list[str]:
    leave_out_long(items, in_silence=False)
    return [item.nodeid for item in items if not item.skipped]


@pytest.mark.parametrize(("cases", "run"), [(1, 1), (3, 1), (4, 2), (72, 24)])
def test_of_a_sampled_table_one_case_in_three_is_run_and_one_always(cases: int, run: int) -> None:
    assert len(run_of(table("test_a", cases, "sampled"))) == run


def test_each_table_has_its_sample_and_other_tests_are_all_run() -> None:
    items = (
        table("test_a", 6, "sampled") + table("test_b", 3, "sampled") + table("test_c", 4) + table("test_d", 2, "long")
    )
    names = [name[:6] for name in run_of(items)]
    assert [names.count(name) for name in ("test_a", "test_b", "test_c", "test_d")] == [2, 1, 4, 0]


def test_it_is_the_same_sample_in_any_order_and_no_stripe_of_the_table() -> None:
    found = run_of(table("test_a", 60, "sampled"))
    assert set(found) == set(run_of(table("test_a", 60, "sampled")[::-1]))
    places = [int(name[7:-1]) for name in found]
    assert len({after - before for before, after in itertools.pairwise(places)}) > 2


def test_in_silence_what_is_left_out_is_gone() -> None:
    items = table("test_a", 6, "sampled")
    leave_out_long(items, in_silence=True)
    assert len(items) == 2


@pytest.mark.parametrize(("is_push", "drawn"), [(True, [34, 1]), (False, [100, 1])])
def test_hypothesis_draws_a_third_of_the_examples_in_a_push_and_never_none(is_push: bool, drawn: list[int]) -> None:
    with local_settings(settings(derandomize=is_push)):
        assert [examples(100), examples(1)] == drawn


def test_where_no_number_is_said_it_is_that_of_a_hundred() -> None:
    assert settings().max_examples == examples(100)


@pytest.mark.parametrize(("in_silence", "left"), [(False, ["short", "long"]), (True, ["short"])])
def test_what_needs_the_bigger_budget_does_not_run_without_it(in_silence: bool, left: list[str]) -> None:
    class Item:
        def __init__(self, name: str, *keywords: str) -> None:
            self.name, self.keywords, self.marks = name, keywords, list[str]()

        def add_marker(self, mark: pytest.MarkDecorator) -> None:
            self.marks.append(mark.name)

    items: list[Any] = [Item("short"), Item("long", "long")]
    short, long = items
    leave_out_long(items, in_silence=in_silence)
    assert [item.name for item in items] == left
    assert (short.marks, long.marks) == ([], ["skip"])


def test_a_drawn_search_plays_a_third_of_its_scenes_in_a_push_and_never_none() -> None:
    assert [scenes(count, 1) for count in (1, 2, 7, 30)] == [1, 1, 3, 10]
    assert scenes(7, 20) == 140


def test_of_a_striped_table_a_third_is_run_and_of_each_row_and_column_something() -> None:
    run = [cell.values for cell in striped("abc", range(7)) if not cell.marks]
    assert len(striped("abc", range(7))) == 21 and len(run) == 7
    assert {row for row, _ in run} == set("abc") and {column for _, column in run} == set(range(7))
