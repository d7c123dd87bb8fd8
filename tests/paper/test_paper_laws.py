"""Laws of the ways to turn a wish into volts, and of the statistics that compare them."""

import numpy as np
import pytest
from paper.comparison import Comparison, Interval, compare_scores, interval
from paper.experiments.laws import Switched
from paper.verdicts.verdict import YES, near, word

from gateway.bsfm import Branches, RationalBezier

BRANCHES = Branches(
    RationalBezier(0.0, 5.0, (0.0, 36.0), (1.0, 1.0)), RationalBezier(0.0, 5.0, (4.0, 40.0), (1.0, 1.0))
)


def test_the_switched_law_stays_on_its_branch_until_the_wish_turns() -> None:
    law = Switched(BRANCHES)
    wishes_n = (10.0, 20.0, 20.0, 19.0, 19.0, 19.5, 0.0)
    rising_v, falling_v = (lambda n: n * 5.0 / 36.0), (lambda n: (n - 4.0) * 5.0 / 36.0)
    expected = [rising_v(10.0), rising_v(20.0), rising_v(20.0), falling_v(19.0), falling_v(19.0), rising_v(19.5), 0.0]
    assert [law.command_v(wish_n, 0.0) for wish_n in wishes_n] == pytest.approx(expected)


def test_the_open_loop_does_not_listen_to_the_load_cell() -> None:
    quiet, loud = Switched(BRANCHES), Switched(BRANCHES)
    assert [quiet.command_v(n, 0.0) for n in (5.0, 9.0)] == [loud.command_v(n, 1.0e3) for n in (5.0, 9.0)]


def test_an_interval_of_equal_ratios_is_a_point_and_turns_over_with_its_ratios() -> None:
    assert interval(np.full(20, 0.4)) == Interval(*(pytest.approx(0.4),) * 3)
    ratios = np.random.default_rng(1).uniform(0.3, 0.9, 20)
    one, other = interval(ratios), interval(1.0 / ratios)
    assert one.low < one.mean < one.high
    assert other.mean == pytest.approx(1.0 / one.mean)


def test_more_seeds_make_a_narrower_interval() -> None:
    ratios = np.random.default_rng(2).lognormal(0.0, 0.3, 400)
    few, many = interval(ratios[:20]), interval(ratios)
    assert many.high - many.low < 0.5 * (few.high - few.low)


def test_of_many_seeds_the_interval_is_that_of_95_percent() -> None:
    """1.96 standard errors of the mean to each side: of 90 % it were 1.64."""
    ratios = np.random.default_rng(5).lognormal(0.0, 0.3, 900)
    found, error = interval(ratios), float(np.std(np.log(ratios))) / 30.0
    wide = np.log([found.high / found.mean, found.mean / found.low]) / error
    assert wide == pytest.approx([1.96, 1.96], abs=0.12)


def test_a_goal_is_met_only_by_the_whole_interval() -> None:
    def comparison(ratios: list[float]) -> Comparison:
        return compare_scores("error", "N", {"bsfm": np.ones(4), "ours": np.array(ratios)}, goal=0.5)

    assert comparison([0.3, 0.4, 0.35, 0.3]).meets("ours")
    assert not comparison([0.1, 0.9, 0.1, 0.9]).meets("ours")


def test_a_verdict_is_a_check_not_an_opinion() -> None:
    assert word(near(1.2, 1.32, 0.25)) == YES
    assert word(near(1.2, 2.65, 0.25)) != YES
