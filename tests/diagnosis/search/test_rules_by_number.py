"""Rules of the search that a whole one reaches seldom: what overwhelms, which blocks count, and which doubt goes first."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gateway.diagnosis.result import Gain
from gateway.diagnosis.search import significance
from gateway.diagnosis.search.acceptance import _blocks_past_the_start, stands_in_its_own_noise
from gateway.diagnosis.search.model_comparison import _count_starts
from gateway.diagnosis.search.significance import drop_doubtful_effects, share_of_excess

UNASKED: Any = None


def test_an_effect_whose_chi_square_overwhelms_is_believed_whatever_noise_is_left() -> None:
    winner: Any = SimpleNamespace(gain=80.1)
    assert stands_in_its_own_noise(UNASKED, UNASKED, winner, 1, UNASKED)


def test_a_block_that_feels_the_recording_s_beginning_in_more_than_half_of_its_rows_proves_no_cause() -> None:
    """Rows that are not judged count neither way."""
    judged = np.array([True] * 4 + [True] * 4 + [True, True, False, False] + [True] * 4)
    unsettled = np.array([True] * 4 + [True, True, False, False] + [True, True, False, False] + [False] * 4)
    bench: Any = SimpleNamespace(block_of_row=np.repeat(np.arange(4), 4), judged=judged, unsettled=unsettled)
    assert _blocks_past_the_start(bench).tolist() == [1, 3]


@pytest.mark.parametrize(("is_line", "starts"), [(False, 2), (True, 252)])
def test_a_frequency_that_was_chosen_counts_as_all_that_the_rows_could_tell_apart(is_line: bool, starts: int) -> None:
    """Of a thousand rows some line always fits noise: as one start among two it would be a cause."""
    form = SimpleNamespace(quadrature=is_line)
    found: Any = SimpleNamespace(candidates=[SimpleNamespace(form=form, start=(1.0, 2.0, 3.0))] * 2)
    hints: Any = SimpleNamespace(duration_s=10.0, row_s=0.01)
    assert _count_starts(found, hints) == starts


@pytest.mark.parametrize(
    ("before_n", "after_n", "floor_n", "share"),
    [(0.5, 0.3, 0.1, 2.0 / 3.0), (0.5, 0.5, 0.1, 0.0), (0.5, 0.6, 0.1, 0.0), (0.5, 0.1, 0.1, 1.0), (0.5, 0.2, 0.3, 1.0),
     (0.5, 0.4, 0.6, 1.0), (0.0, 0.0, 0.0, 0.0)],
)  # fmt: skip
def test_what_a_model_explains_is_a_share_of_what_lies_above_the_floor(
    before_n: float, after_n: float, floor_n: float, share: float
) -> None:
    """A floor that is guessed too high is no reason to say that nothing, or more than all, is explained."""
    assert share_of_excess(before_n, after_n, floor_n) == pytest.approx(share)


def test_of_two_doubtful_effects_the_worse_one_goes_first_and_the_other_is_judged_anew(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Beside a cause that is none another one looks doubtful, too."""
    lows = {"creep": -0.01, "warm-up": -0.2}

    def refit(bench: Any, found: Any) -> Any:
        without = tuple(each.effect.name for each in found.accepted)
        return SimpleNamespace(
            without=without, whiten=UNASKED, base=SimpleNamespace(residual_n=0.0), held_out=SimpleNamespace(rms_n=0.05),
            fitted=UNASKED,
        )  # fmt: skip

    def gain_of(before: str, after: Any, floor_n: float) -> Gain:
        low_n = lows[before] if len(found_now) == 2 else 0.05
        return Gain(0.5, 0.4, (low_n, 0.3), 0.5)

    def refit_without(bench: Any, found: Any, taken: Any, kept: Any) -> Any:
        found_now[:] = [each.effect.name for each in kept]
        return UNASKED

    found_now = list(lows)
    monkeypatch.setattr(significance, "_refit_for_report", refit)
    monkeypatch.setattr(significance, "held_out_errors", lambda bench, name, whiten: name)
    monkeypatch.setattr(significance, "gain_of", gain_of)
    monkeypatch.setattr(significance, "reason_for_doubt", lambda each, gain: "doubt" if gain.ci95[0] <= 0.0 else "")
    monkeypatch.setattr(significance, "_reason_in_size", lambda each, fitted: "")
    monkeypatch.setattr(significance, "refit_without", refit_without)
    monkeypatch.setattr(significance, "replace", lambda found, **changes: SimpleNamespace(**vars(found) | changes))
    accepted = tuple(SimpleNamespace(effect=SimpleNamespace(name=name)) for name in lows)
    bench: Any = SimpleNamespace(rms_n=lambda residual_n: 0.1)
    found: Any = SimpleNamespace(accepted=accepted, fitted=UNASKED, base=UNASKED)
    left, _, dropped = drop_doubtful_effects(bench, found)
    assert [one.name for one in dropped] == ["warm-up"]
    assert [each.effect.name for each in left.accepted] == ["creep"]
