"""A ladder judged: every model and order fitted, held out, one chosen, its reversal identified.

The choice is among fits that may drive a plant: the fewest coefficients not certainly worse than the best held-out
error. Where no free optimum may, the best BSFM that may is looked for (fit_usable) and said to be that. One group alone
cannot be left out; then every fifth stair is, which flatters, and is said too. Importing this costs scipy.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import nan
from typing import Final

import numpy as np

from gateway.bsfm.branches import Branches
from gateway.bsfm.fit.branch_fit import FitSettings
from gateway.bsfm.fit.order_choice import Score, choose_fit, score_orders
from gateway.bsfm.fit.result import ModelName, Ties
from gateway.bsfm.fit.usable_fit import fit_usable, is_moderate
from gateway.bsfm.ladder.check import CheckedLadder
from gateway.bsfm.ladder.ladder_error import LadderError, LadderFlaw
from gateway.bsfm.ladder.measured_ladder import Ladder
from gateway.bsfm.model import Bsfm
from gateway.bsfm.slip.reversal_choice import ReversalChoice, choose_reversal

FOLDS: Final = 5
POOR_SHARE: Final = 0.8  # held-out errors further apart than this are worth a constrained search
ORDER_TO_MOVE: Final = 3
SPARING: Final = 0.8  # of the stairs may be coefficients of one curve
NEAR: Final = 1.1  # of the smallest residual: the lowest order that comes this close
DEFAULT_SPAN_SHARE: Final = 0.2  # of the force range, where nothing identifies the span


@dataclass(frozen=True, slots=True, kw_only=True)
class FitRequest:
    """What to fit. reference_span_n: the active calibration's span, used where the walk is missing."""

    models: tuple[ModelName, ...] = tuple(ModelName)
    orders: tuple[int, ...] = (1, 2, 3, 4, 5)
    ties: Ties = Ties.TIED
    outliers: str = "reject"
    reference_span_n: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """All fits of a ladder, and the model that is to be activated.

    scores: by model, then order; chosen: one of them, or a constrained fit; model: what is to be activated, whose branches
    a joint fit with slip stops has moved; reversal: None where the span is assumed.
    """

    checked: CheckedLadder
    scores: tuple[Score, ...]
    chosen: Score
    model: Bsfm
    span_n: float
    reversal: ReversalChoice | None
    notes: tuple[str, ...]


def evaluate(checked: CheckedLadder, question: FitRequest) -> Evaluation:
    """Fit every model and order, choose one, and choose how it reverses. LadderError where nothing usable can be fitted."""
    ladder, notes = _with_groups(checked.ladder)
    if not checked.closed:
        question = replace(question, ties=Ties.FREE)
        notes.append("the loop's top is cut off: each branch gets its own ends")
    question = replace(question, orders=_possible(ladder, question.orders, notes))
    settings = _settings(ladder, question)
    scores = score_orders(ladder, question.models, question.orders, question.ties, settings)
    chosen = choose_fit(scores)
    if _is_poor(chosen, scores):
        chosen = _fit_constrained(ladder, question, settings, chosen, notes)
    reversal = choose_reversal(_to_move(chosen, scores), checked.ladder, checked.minor_v, checked.minor_n)
    span_n = reversal.span_n if reversal else _assume_span(chosen, question, notes)
    model = reversal.model if reversal else chosen.result.bsfm(span_n)
    order = model.branches.rising.order
    if order != chosen.result.order:
        notes.append(
            f"with the slip stops the branches are fitted anew, to the minor loops as well: of order {order}, which the model "
            "keeps; the table above is of the staircase alone"
        )
    return Evaluation(checked, tuple(scores), chosen, model, span_n, reversal, (*checked.notes, *notes))


def _with_groups(ladder: Ladder) -> tuple[Ladder, list[str]]:
    """Groups that can be left out one at a time."""
    if len(ladder.groups) >= 2:
        return ladder, []
    note = (
        f"one group only: every {FOLDS}th stair is held out in its place, which flatters the held-out error; repeat the "
        "ladder for an honest one"
    )
    return replace(ladder, group=np.arange(len(ladder)) % FOLDS), [note]


def _possible(ladder: Ladder, orders: Sequence[int], notes: list[str]) -> tuple[int, ...]:
    """Orders that the fewest stairs of one branch in any rest can carry with some to spare: the groups visit the same
    voltages, so leaving one out does not show what a curve does between the stairs."""
    rests = [ladder.part(ladder.group != group) for group in ladder.groups]
    stairs = min(len(np.unique(rest.voltage_v[rest.direction == way])) for rest in rests for way in (1, -1))
    possible = tuple(order for order in orders if 2 * order + 1 <= SPARING * stairs)
    if not possible:
        raise LadderError(
            LadderFlaw.TOO_SHORT, f"{stairs} stairs on a branch carry no order of {', '.join(map(str, orders))}"
        )
    if len(possible) < len(orders):
        notes.append(
            f"{stairs} stairs on a branch: orders above {max(possible)} are not tried, and the errors are those at the stairs; "
            "between them nothing was measured"
        )
    return possible


def _settings(ladder: Ladder, question: FitRequest) -> FitSettings:
    outliers = "reject" if question.outliers == "reject" else "huber" if question.outliers == "huber" else "keep"
    ends_v = (float(ladder.voltage_v.min()), float(ladder.voltage_v.max()))
    return FitSettings(outliers=outliers, voltage_range_v=ends_v)  # type: ignore[arg-type]


def _is_poor(chosen: Score, scores: Sequence[Score]) -> bool:
    """Nothing usable, or something that may not drive a plant describes the data much better."""
    best = min(scores, key=lambda score: score.heldout_n2)
    return not _may_drive(chosen) or best.heldout_rms_n < POOR_SHARE * chosen.heldout_rms_n


def _may_drive(score: Score) -> bool:
    return score.result.verdicts.usable and is_moderate(score.result.branches)


def _fit_constrained(
    ladder: Ladder, question: FitRequest, settings: FitSettings, free: Score, notes: list[str]
) -> Score:
    """The best BSFM that is held to what may drive a plant, where it beats the best free optimum that may."""
    results = []
    for order in question.orders[:3]:
        try:
            results.append(fit_usable(ladder, ModelName.BSFM, order, question.ties, settings))
        except ValueError:
            continue
    smallest_n = min((result.rms_n for result in results), default=0.0)
    best = next((result for result in results if result.rms_n <= NEAR * smallest_n), None)
    if best is None and not _may_drive(free):
        raise LadderError(
            LadderFlaw.NO_FIT, "no fit of any model and order may drive a plant: see the verdicts in the table"
        )
    if best is None or (_may_drive(free) and best.rms_n >= POOR_SHARE * free.heldout_rms_n):
        return free
    notes.append(
        f"the better free optima may not drive a plant (see the verdicts); chosen is the best BSFM of order {best.order} that "
        f"increases by {settings.slope_floor_n_per_v:g} N/V or more everywhere and does not cross: {best.rms_n:.3f} N RMS"
    )
    return Score(best, nan, nan)


def _to_move(chosen: Score, scores: Sequence[Score]) -> Branches:
    """Where a joint fit with slip stops begins: at the chosen branches, or a lower order's, for it takes seconds from 3 on."""
    lower = [score for score in scores if score.result.order <= ORDER_TO_MOVE and score.result.verdicts.usable]
    if chosen.result.order <= ORDER_TO_MOVE or not lower:
        return chosen.result.branches
    return min(lower, key=lambda score: score.heldout_n2).result.branches


def _assume_span(chosen: Score, question: FitRequest, notes: list[str]) -> float:
    low_n, high_n = chosen.result.bsfm(0.0).force_range_n
    if question.reference_span_n is not None:
        notes.append(
            f"no minor-loop part: the blend span of {question.reference_span_n:g} N is that of the active calibration"
        )
        return question.reference_span_n
    span_n = round(DEFAULT_SPAN_SHARE * (high_n - low_n), 1)
    notes.append(f"no minor-loop part: a blend span of {span_n:g} N is assumed, not identified")
    return span_n
