"""Choosing an order: what is held out decides, and the simpler model wins a tie."""

from dataclasses import replace

import numpy as np
import pytest

from gateway.bsfm import RationalBezier
from gateway.bsfm.fit.levenberg_marquardt import Effort
from gateway.bsfm.fit.order_choice import FitSettings, Score, choose_fit, score_orders
from gateway.bsfm.fit.outliers import inlier_mask
from gateway.bsfm.ladder.measured_ladder import Ladder

QUICK = FitSettings(effort=Effort(screened=64, descending=8))


def test_polynomial_data_choose_their_own_order(loops):
    ladder = loops["smooth"](1)
    rising, falling = (RationalBezier(0.0, 5.0, handles, (1.0,) * 4) for handles in ((0, 4, 24, 38), (0, 22, 26, 38)))
    clean = np.where(ladder.direction > 0, rising.value(ladder.voltage_v), falling.value(ladder.voltage_v))
    noise = 0.2 * np.random.default_rng(5).standard_normal(len(ladder))
    cubic = Ladder(ladder.voltage_v, clean + noise, ladder.direction, ladder.group)
    assert choose_fit(score_orders(cubic, ["psfm"], range(1, 8))).result.order == 3


def test_residual_falls_for_ever_and_the_held_out_error_does_not(loops):
    scores = score_orders(loops["smooth"](3, noise_n=0.5), ["psfm"], range(1, 13))
    inside, outside = [s.result.rms_n for s in scores], [s.heldout_rms_n for s in scores]
    assert min(inside) == inside[-1] and outside[-1] > min(outside)
    assert choose_fit(scores).result.order < 8


def test_the_loop_needs_two_branches_and_few_coefficients(loops):
    scores = score_orders(loops["smooth"](4), ["pfm", "psfm", "bfm", "bsfm"], range(1, 4), "tied", QUICK)
    chosen = choose_fit(scores)
    assert chosen.result.model.per_direction and chosen.result.verdicts.usable
    assert chosen.heldout_rms_n < 0.5 * min(s.heldout_rms_n for s in scores if not s.result.model.per_direction)
    assert all(s.coefficients >= chosen.coefficients for s in scores if s.heldout_n2 <= chosen.heldout_n2)


def test_what_cannot_drive_a_plant_is_chosen_only_if_nothing_else_is_there(loops):
    ladder = loops["smooth"](4)
    inverted = Ladder(ladder.voltage_v, -ladder.force_n, ladder.direction, ladder.group)
    chosen = choose_fit(score_orders(inverted, ["psfm"], range(1, 4)))
    assert not chosen.result.verdicts.usable
    assert chosen.result.verdicts.sentences[0] == "the rising branch is not increasing"


def scored(score: Score, *groups_n2: float) -> Score:
    squares = np.array(groups_n2)
    error_n2 = float(squares.std(ddof=1) / np.sqrt(len(squares)))
    return replace(score, heldout_n2=float(squares.mean()), error_n2=error_n2, groups_n2=groups_n2)


def test_a_shaken_group_does_not_make_a_straight_line_as_good_as_the_best(loops):
    """Of two groups one was shaken: the errors of all orders differ by group, their differences do not."""
    straight, bent = score_orders(loops["smooth"](6), ["bsfm"], (1, 2), "tied", QUICK)
    straight, bent = scored(straight, 0.28, 1.30), scored(bent, 0.01, 1.00)
    assert straight.heldout_n2 < bent.heldout_n2 + bent.error_n2, "within the error of the best one by itself"
    assert choose_fit([straight, bent]) is bent
    doubtful = scored(straight, 0.28, 0.80)
    assert choose_fit([doubtful, bent]) is doubtful


def test_what_may_drive_a_plant_is_chosen_however_much_better_something_else_is(loops):
    useful, bent_back = score_orders(loops["smooth"](6), ["bsfm"], (1, 2), "tied", QUICK)
    unusable = replace(bent_back.result, verdicts=replace(bent_back.result.verdicts, falling_monotone=False))
    useful, bent_back = scored(useful, 4.0, 4.1), scored(replace(bent_back, result=unusable), 0.01, 0.02)
    assert choose_fit([useful, bent_back]) is useful
    assert choose_fit([bent_back]) is bent_back


def test_how_sure_a_held_out_error_is_goes_by_the_scatter_of_its_groups(loops):
    ladder = loops["smooth"](3, noise_n=0.5)
    (score,) = score_orders(ladder.part(ladder.group < 2), ["bsfm"], (1,), "tied", QUICK)
    first, second = score.groups_n2
    assert score.heldout_n2 == pytest.approx(0.5 * (first + second)) and first != second
    assert score.error_n2 == pytest.approx(0.5 * abs(first - second)), "of two values: half of what parts them"


@pytest.mark.parametrize(("readings", "rejected"), [(2, 0), (3, 1)])
def test_of_two_readings_of_a_stair_nobody_can_tell_which_one_is_wrong(readings: int, rejected: int) -> None:
    """Of the other stairs, read three times each, the noise is known all the same."""
    volts = np.concatenate([np.repeat(np.arange(10.0), 3), np.full(readings, 20.0)])
    force_n = np.concatenate([np.tile([0.0, 0.1, -0.1], 10), [0.0, 8.0, 0.05][:readings]])
    ladder = Ladder(volts, force_n, np.ones(len(volts), dtype=int), np.zeros(len(volts), dtype=int))
    assert int((~inlier_mask(ladder)).sum()) == rejected


def test_one_group_cannot_be_left_out(loops):
    ladder = loops["smooth"](1)
    with pytest.raises(ValueError, match="two groups"):
        score_orders(ladder.part(ladder.group == 0), ["bsfm"], range(1, 3))
