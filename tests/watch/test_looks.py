"""What the residual watch does with its looks: what it searches in, how often, and what it takes for usual."""

from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.registers.residual_cause import ResidualCause
from gateway.twin.plant import Plant, with_value
from gateway.watch.plant_comparison import PlantComparison
from gateway.watch.reference import WatchReference
from gateway.watch.residual_watch import Watch, WatchSettings
from gateway.watch.warning_filter import WindowVerdict
from gateway.watch.window import Window

WINDOW_S, EVERY_S = 60.0, 30.0


class Bench(Watch):
    """Windows of an hour that has been; is_off: what the cheap look sees; searched: how long the windows that were judged."""

    def __init__(self) -> None:
        self.now_s, self.is_off, self.searched = 3600.0, False, list[float]()
        comparison: Any = SimpleNamespace(
            why_unsuitable=lambda window: "", rms_n=lambda window: 1.0, floor_n=lambda window: 0.1,
            is_exceeded=lambda window, rms_n: self.is_off, judge=self.judge,
        )  # fmt: skip
        super().__init__(None, comparison, WatchSettings(WINDOW_S, EVERY_S), lambda: self.now_s)  # type: ignore[arg-type]

    def _window(self, window_s: float) -> Window:
        return Window(window_s, self.now_s, 1.0, 9)  # type: ignore[arg-type]

    def judge(self, window: Window) -> WindowVerdict:
        self.searched.append(window.measurement)  # type: ignore[arg-type]
        return WindowVerdict(ResidualCause.COULOMB_FRICTION, "friction", 1.0)

    def look_again(self, after_s: float = EVERY_S) -> None:
        self.now_s += after_s
        self.check_newest_window()


def test_only_what_is_younger_than_the_last_healthy_look_is_searched_in() -> None:
    bench = Bench()
    bench.check_newest_window()
    bench.is_off = True
    bench.look_again(0.5 * WINDOW_S)
    assert bench.searched == [], "half old and half new has a wrong name"
    bench.look_again(0.2 * WINDOW_S)
    assert bench.searched == [pytest.approx(0.7 * WINDOW_S)]
    bench.look_again(0.5 * WINDOW_S)
    assert bench.searched[1:] == [WINDOW_S]


def test_a_search_that_finds_nothing_is_a_healthy_look_and_one_that_cannot_tell_is_none() -> None:
    """What was searched once and was well is not searched again, half old and half new."""
    for found, searched in ((WindowVerdict(excitation_v=1.0), 1), (None, 2)):
        bench = Bench()
        bench._comparison.judge = lambda window, bench=bench, found=found: bench.searched.append(1.0) or found  # type: ignore[method-assign]
        bench.is_off = True
        bench.look_again()
        bench.look_again(0.5 * WINDOW_S)
        assert len(bench.searched) == searched
        bench.look_again(0.2 * WINDOW_S)
        assert len(bench.searched) == searched + 1


def test_a_cause_that_stands_is_searched_for_less_and_less_and_never_given_up() -> None:
    bench = Bench()
    bench.is_off = True
    searches_s = []
    for _ in range(600):
        count = len(bench.searched)
        bench.look_again()
        if len(bench.searched) > count:
            searches_s.append(bench.now_s)
    gaps_s = [after - before for before, after in pairwise(searches_s)]
    assert gaps_s == sorted(gaps_s)
    assert gaps_s[0] == EVERY_S and gaps_s[-1] == 600.0


def test_a_cause_that_stands_for_a_month_is_still_searched_for_every_ten_minutes() -> None:
    """From the 1026th window on, a week later, the pause could not be calculated, and the watch died of it."""
    bench = Bench()
    bench.is_off = True
    for _ in range(30 * 24 * 6):
        bench.look_again(600.0)
    assert len(bench.searched) > 30 * 24 * 6 - 5
    assert bench.published.cause is ResidualCause.COULOMB_FRICTION


def window(excitation_v: float) -> Window:
    return Window(None, 0.0, excitation_v, 9)  # type: ignore[arg-type]


def test_a_quieter_window_does_not_make_the_usual_an_excess() -> None:
    """The floor is what the noisiest of such windows had in which nothing was found."""
    reference = WatchReference(Plant())
    for rms_n in (0.4, 0.1):
        reference.raise_floor(window(1.1), rms_n)
    assert reference.floor_n(window(1.9)) == 0.4
    assert not reference.is_exceeded(window(1.1), 0.45)
    assert reference.floor_n(window(2.1)) is None


@pytest.mark.parametrize(("delay_s", "is_taken"), [(0.02, True), (-0.02, True), (0.1, False), (-0.1, False)])
def test_only_a_delay_of_the_size_of_a_serial_line_is_the_lines(delay_s: float, is_taken: bool) -> None:
    """Anything larger, either way, is a change of the machine that has to be told."""
    plant = with_value(Plant(), "regulator", "delay_s", 0.15)
    reference = WatchReference(plant)
    found: Any = SimpleNamespace(plant=with_value(plant, "regulator", "delay_s", 0.15 + delay_s))
    reference.take_line_delays(found)
    assert reference.plant.regulator.delay_s == pytest.approx(0.15 + delay_s if is_taken else 0.15)


@pytest.mark.parametrize(
    ("excitation_v", "moves", "is_settled", "suits"),
    [(0.2, 4, False, True), (0.19, 4, False, False), (0.2, 3, False, False), (0.0, 0, True, True)],
)
def test_the_first_window_must_have_been_moved_and_later_ones_need_not(
    excitation_v: float, moves: int, is_settled: bool, suits: bool
) -> None:
    reference: Any = SimpleNamespace(is_settled=is_settled)
    comparison = PlantComparison(reference, None, 0.1)  # type: ignore[arg-type]
    told = comparison.why_unsuitable(Window(None, 0.0, excitation_v, moves))  # type: ignore[arg-type]
    assert told == ("" if suits else "too little was commanded to begin with")


def test_what_is_usual_is_exceeded_by_a_quarter_and_what_is_not_known_by_anything() -> None:
    reference = WatchReference(Plant())
    assert reference.is_exceeded(window(1.0), 0.0)
    reference.raise_floor(window(1.0), 0.4)
    assert [reference.is_exceeded(window(1.0), rms_n) for rms_n in (0.49, 0.51)] == [False, True]


def test_a_window_that_cannot_be_compared_is_skipped_and_counted() -> None:
    """It neither clears nor confirms what stands, and is told by its sentence."""
    bench = Bench()
    bench._comparison.why_unsuitable = lambda window: "another tool is on"  # type: ignore[method-assign]
    for is_off in (False, True):
        bench.is_off = is_off
        bench.look_again()
    assert bench.searched == [] and bench.why_skipped == "another tool is on"
    assert (bench.counters["looks"], bench.counters["judged"], bench.counters["skipped"]) == (2, 0, 2)


def test_healthy_looks_clear_what_was_published() -> None:
    bench = Bench()
    bench.is_off = True
    for _ in range(6):
        bench.look_again()
    assert bench.published.cause is ResidualCause.COULOMB_FRICTION
    bench.is_off = False
    for _ in range(6):
        bench.look_again()
    assert bench.published.cause is ResidualCause.NONE
