"""No cause whose gain may be nothing, none that leaves the error as large, none that wins by chance: each with a sentence."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gateway.catalogue.all_effects import BY_NAME
from gateway.diagnosis import Options, Verdict, diagnose
from gateway.diagnosis.model_fit.normal_equations import HeldOutErrors
from gateway.diagnosis.result import Gain
from gateway.diagnosis.search.acceptance import AcceptedEffect
from gateway.diagnosis.search.model_comparison import ModelComparison, RefinedEffect
from gateway.diagnosis.search.significance import gain_of, reason_for_doubt
from gateway.reports.diagnosis import wording as words
from tests.diagnosis.machine import MACHINE, recorded, times_s

UNSET: Any = None


def accepted(name: str, shares: dict[str, float]) -> AcceptedEffect:
    effect = BY_NAME[name]
    return AcceptedEffect(effect, effect.forms[0], ModelComparison(UNSET, (), shares, UNSET, 1, ()))


SURE = accepted("creep", {"creep": 0.97})


@pytest.mark.parametrize(
    ("taken", "gain", "why"),
    [
        (SURE, Gain(0.243, 0.251, (-0.02, 0.01), 0.0), "may be nothing"),
        (SURE, Gain(0.243, 0.242, (0.0005, 0.002), 0.01), "leaves the error as large"),
        (accepted("dwell-stiction", {"dwell-stiction": 0.33}), Gain(0.3, 0.2, (0.05, 0.15), 0.8), "33 % of the ways"),
        (SURE, Gain(0.3, 0.2, (0.05, 0.15), 0.8), ""),
        (accepted("creep", {"creep": 0.3, "warm-up": 0.4, "pad-wear": 0.2}), Gain(0.3, 0.2, (0.05, 0.15), 0.8), ""),
    ],
)
def test_what_is_no_finding_is_told_why(taken: AcceptedEffect, gain: Gain, why: str) -> None:
    told = reason_for_doubt(taken, gain)
    assert why in told
    assert bool(told) == bool(why)


def test_names_that_win_equally_often_stand_in_the_order_of_their_gain() -> None:
    """A set's order differs from process to process, and the answer with it."""
    relatives = ("extra-lag", "clock-offset", "viscous-friction")
    ranked = tuple(
        RefinedEffect(BY_NAME[name], BY_NAME[name].forms[0], UNSET, 10.0 - 0.1 * k, 1, UNSET)
        for k, name in enumerate(("transport-delay", *relatives))
    )
    shares = {"transport-delay": 1.0, **dict.fromkeys(relatives, 0.0)}
    found = ModelComparison(UNSET, ranked, shares, UNSET, 1, ())
    assert found.group("transport-delay") == ("transport-delay", *relatives)


def held(squares: np.ndarray) -> HeldOutErrors:
    blocks = squares.reshape(20, -1)
    return HeldOutErrors(blocks.sum(axis=1), np.full(20, float(blocks.shape[1])), np.zeros((20, 1)), squares)


def test_a_gain_s_interval_holds_0_where_noise_alone_gained() -> None:
    rng = np.random.default_rng(3)
    before, after = (rng.normal(0.0, 0.1, 4000) ** 2 + 1.0e-9 for _ in range(2))
    low, high = gain_of(held(before), held(after), 0.0).ci95
    assert low < 0.0 < high


def test_an_effect_that_shows_in_one_block_of_twenty_has_a_gain_all_the_same() -> None:
    """Drawn by whole blocks, a third of all draws would not hold it."""
    after = np.random.default_rng(4).normal(0.0, 0.1, 4000) ** 2 + 1.0e-9
    before = after.copy()
    before[1000:1200] += 0.09
    assert gain_of(held(before), held(after), 0.0).ci95[0] > 0.0


def test_a_named_cause_never_stands_beside_nothing_explained() -> None:
    """A small real effect in a short recording: whatever is answered, name and numbers agree."""
    for size in (0.004, 0.02):
        given = recorded({"contact.creep_share": size, "contact.creep_s": 4.0}, seed=2, time_s=times_s(24.0, 100.0))
        answer = diagnose([given], MACHINE, Options())
        assert bool(answer.causes) == (answer.verdict in (Verdict.PARTIAL, Verdict.CONFIRMED))
        for cause in answer.causes:
            assert cause.gain.ci95[0] > 0.0
            assert cause.gain.held_out_rms_after_n < cause.gain.held_out_rms_before_n
            assert words.explained_share(answer) >= 0.01
    assert answer.causes, "the larger one is found"
    assert replace(answer).extended.held_out_rms_n < answer.baseline.rms_n
