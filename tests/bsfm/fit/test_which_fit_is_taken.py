"""Which fit may drive a plant and is taken, without fitting: usable, moderate, held where nothing free is, and its order."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gateway.bsfm.fit import evaluation
from gateway.bsfm.fit.evaluation import (
    FOLDS,
    ORDER_TO_MOVE,
    POOR_SHARE,
    FitRequest,
    _assume_span,
    _fit_constrained,
    _is_poor,
    _may_drive,
    _possible,
    _settings,
    _to_move,
    _with_groups,
    evaluate,
)
from gateway.bsfm.fit.result import Ties
from gateway.bsfm.ladder.ladder_error import LadderError
from gateway.bsfm.ladder.measured_ladder import Ladder

SETTINGS: Any = SimpleNamespace(slope_floor_n_per_v=0.5)


@pytest.fixture(autouse=True)
def moderate_as_it_says(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(evaluation, "is_moderate", lambda branches: branches.is_moderate)


def score(
    rms_n: float, *, usable: bool = True, moderate: bool = True, order: int = 2, trained_n: float | None = None
) -> Any:
    """rms_n: held out; trained_n: of the rows that it was fitted to, where that is another."""
    branches = SimpleNamespace(is_moderate=moderate, name=f"order {order}, {rms_n:g} N")
    result = SimpleNamespace(verdicts=SimpleNamespace(usable=usable), branches=branches, order=order)
    result.rms_n = rms_n if trained_n is None else trained_n
    return SimpleNamespace(result=result, heldout_n2=rms_n**2, heldout_rms_n=rms_n)


def test_only_what_is_usable_and_moderate_may_drive() -> None:
    assert [_may_drive(score(0.1, usable=u, moderate=m)) for u in (True, False) for m in (True, False)] == [
        True,
        False,
        False,
        False,
    ]


@pytest.mark.parametrize(
    ("chosen", "best_n", "poor"),
    [
        (score(2.0), 1.98, False),
        (score(2.0), 1.98 * POOR_SHARE, True),
        (score(2.0), 2.02 * POOR_SHARE, False),
        (score(1.0, usable=False), 1.0, True),
        (score(1.0, moderate=False), 1.0, True),
    ],
)
def test_a_choice_is_poor_where_it_may_not_drive_or_another_describes_the_data_much_better(
    chosen: Any, best_n: float, poor: bool
) -> None:
    assert _is_poor(chosen, [chosen, score(5.0), score(best_n, usable=False)]) is poor


def test_how_much_better_the_data_are_described_is_told_by_what_was_held_out() -> None:
    """What was fitted to every wiggle of its own rows describes none of the others."""
    chosen, wiggly = score(1.0), score(3.0, usable=False, trained_n=0.01)
    assert not _is_poor(chosen, [chosen, wiggly])
    assert _is_poor(chosen, [chosen, wiggly, score(0.5, usable=False)])


def held(monkeypatch: pytest.MonkeyPatch, rms_n: dict[int, float], free: Any, orders: tuple[int, ...]) -> Any:
    """What is taken where fits that are held to what may drive have these errors by their order; and what is noted."""
    tried = list[int]()

    def fit(ladder: Any, model: Any, order: int, ties: Any, settings: Any) -> Any:
        tried.append(order)
        if order not in rms_n:
            raise ValueError("it does not come to an end")
        return SimpleNamespace(order=order, rms_n=rms_n[order])

    monkeypatch.setattr(evaluation, "fit_usable", fit)
    notes = list[str]()
    ladder: Any = None
    taken = _fit_constrained(ladder, FitRequest(orders=orders), SETTINGS, free, notes)
    assert tried == list(orders[:3])
    return taken, notes


def test_of_fits_that_are_held_the_lowest_order_is_taken_that_is_nearly_as_good(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    nothing = score(0.1, usable=False)
    for rms_n, order in (({1: 0.9, 2: 0.5, 3: 0.499}, 2), ({1: 0.5, 2: 0.499, 3: 0.498}, 1), ({3: 0.7}, 3)):
        taken, notes = held(monkeypatch, rms_n, nothing, (1, 2, 3, 4))
        assert taken.result.order == order
        assert f"of order {order} that increases by 0.5 N/V" in notes[0]
        assert np.isnan(taken.heldout_n2)


def test_a_free_optimum_that_may_drive_stays_unless_a_held_one_is_much_better(monkeypatch: pytest.MonkeyPatch) -> None:
    free = score(2.0)
    for held_n, stays in ((1.98 * POOR_SHARE, False), (2.02 * POOR_SHARE, True)):
        taken, notes = held(monkeypatch, {1: held_n}, free, (1,))
        assert (taken is free) == stays == (not notes)
    assert held(monkeypatch, {}, free, (1, 2))[0] is free


def test_where_nothing_may_drive_nothing_is_made_of_the_data(monkeypatch: pytest.MonkeyPatch) -> None:
    for free in (score(0.1, usable=False), score(0.1, moderate=False)):
        with pytest.raises(LadderError, match="no fit of any model and order may drive a plant"):
            held(monkeypatch, {}, free, (1, 2, 3))


def test_slip_stops_are_fitted_from_a_low_order_where_one_may_drive() -> None:
    high = score(0.1, order=ORDER_TO_MOVE + 1)
    low, lower = score(0.3, order=ORDER_TO_MOVE), score(0.2, order=1)
    assert _to_move(high, [high, low, lower]) is lower.result.branches
    assert _to_move(high, [high, low, score(0.2, order=1, usable=False)]) is low.result.branches
    assert _to_move(high, [high, score(0.2, order=1, usable=False)]) is high.result.branches
    assert _to_move(low, [high, low, lower]) is low.result.branches


def ladder_of(groups: int, stairs: int) -> Ladder:
    up = np.arange(float(stairs))
    volts = np.concatenate([up, up[::-1]] * groups)
    way = np.concatenate([np.ones(stairs), -np.ones(stairs)] * groups)
    return Ladder(volts, 7.0 * volts, way, np.repeat(np.arange(groups), 2 * stairs))


def test_one_group_is_held_out_stair_by_stair_and_that_is_said() -> None:
    two = ladder_of(2, 12)
    assert _with_groups(two) == (two, [])
    parted, notes = _with_groups(ladder_of(1, 12))
    assert len(parted.groups) == FOLDS and "one group only" in notes[0]


def test_orders_that_the_stairs_cannot_carry_are_not_tried() -> None:
    notes = list[str]()
    ladder = ladder_of(2, 12)
    tried = _possible(ladder, (1, 2, 3, 15), notes)
    assert _possible(ladder, (3, 4, 5), []) == (3, 4), "nine coefficients, of 12 stairs"
    assert tried and 15 not in tried and len(notes) == 1
    assert notes[0].startswith(f"12 stairs on a branch: orders above {max(tried)} are not tried")
    assert notes[0].endswith("the errors are those at the stairs; between them nothing was measured")
    notes.clear()
    assert _possible(ladder, tried, notes) == tried and notes == []
    with pytest.raises(LadderError, match="12 stairs on a branch carry no order of 15"):
        _possible(ladder, (15,), notes)


def test_the_branch_with_the_fewest_stairs_in_any_rest_decides() -> None:
    whole = ladder_of(2, 12)
    cut = whole.part((whole.group == 0) | (whole.direction > 0) | (whole.voltage_v < 6.0))
    assert _possible(cut, (1, 2, 3), []) == (1,)


def evaluated(monkeypatch: pytest.MonkeyPatch, reversal: Any, *, closed: bool = True, poor: bool = False) -> Any:
    """The evaluation of a ladder whose fits are made up; the held one is of order 1."""
    chosen, constrained = score(0.2, order=2), score(0.1, order=1)
    model = SimpleNamespace(branches=SimpleNamespace(rising=SimpleNamespace(order=2)), force_range_n=(0.0, 50.0))
    chosen.result.bsfm = constrained.result.bsfm = lambda span_n: model
    asked = list[Any]()
    for name, stand_in in {
        "score_orders": lambda *given: asked.append(given) or [chosen],
        "choose_fit": lambda scores: chosen,
        "_is_poor": lambda *_: poor,
        "_fit_constrained": lambda *_: constrained,
        "choose_reversal": lambda *_: reversal,
    }.items():
        monkeypatch.setattr(evaluation, name, stand_in)
    checked: Any = SimpleNamespace(ladder=ladder_of(2, 12), closed=closed, minor_v=[], minor_n=[], notes=("checked",))
    told = evaluate(checked, FitRequest(orders=(1, 2, 15)))
    return told, asked[0], chosen, constrained, model


def test_what_is_chosen_is_told_with_how_it_reverses(monkeypatch: pytest.MonkeyPatch) -> None:
    told, (_, _, orders, ties, _), chosen, _, model = evaluated(monkeypatch, None)
    assert (told.chosen, told.model, told.span_n, told.reversal) == (chosen, model, 10.0, None)
    assert (orders, ties) == ((1, 2), FitRequest().ties)
    assert [note.partition(":")[0] for note in told.notes] == ["checked", "12 stairs on a branch", "no minor-loop part"]
    slip = SimpleNamespace(span_n=3.0, model=SimpleNamespace(branches=model.branches))
    told, *_ = evaluated(monkeypatch, slip)
    assert (told.span_n, told.model, told.reversal) == (3.0, slip.model, slip)
    assert not any("fitted anew" in note for note in told.notes)
    slip.model = SimpleNamespace(branches=SimpleNamespace(rising=SimpleNamespace(order=1)))
    told, *_ = evaluated(monkeypatch, slip)
    assert "of order 1, which the model keeps" in told.notes[-1]


def test_a_poor_choice_is_held_and_a_loop_that_is_cut_off_has_ends_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    told, (_, _, _, ties, _), _, constrained, _ = evaluated(monkeypatch, None, closed=False, poor=True)
    assert told.chosen is constrained
    assert ties is Ties.FREE and any("each branch gets its own ends" in note for note in told.notes)


def test_outliers_are_treated_as_asked_and_the_curves_span_the_ladder() -> None:
    for asked in ("reject", "huber", "keep"):
        settings = _settings(ladder_of(2, 12), FitRequest(outliers=asked))  # type: ignore[arg-type]
        assert (settings.outliers, settings.voltage_range_v) == (asked, (0.0, 11.0))


def test_without_minor_loops_the_blend_is_that_in_use_or_a_share_of_the_range_and_told_as_assumed() -> None:
    chosen: Any = SimpleNamespace(result=SimpleNamespace(bsfm=lambda span: SimpleNamespace(force_range_n=(10.0, 60.0))))
    notes = list[str]()
    assert _assume_span(chosen, FitRequest(reference_span_n=3.5), notes) == 3.5
    assert _assume_span(chosen, FitRequest(), notes) == round(evaluation.DEFAULT_SPAN_SHARE * 50.0, 1)
    assert ["of the active calibration" in note for note in notes] == [True, False]
    assert "assumed, not identified" in notes[1]
