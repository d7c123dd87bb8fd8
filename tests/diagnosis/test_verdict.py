"""What an answer may call itself, and what its figures may never say of each other."""

from itertools import product
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.catalogue.all_effects import BY_NAME, EFFECTS
from gateway.diagnosis import Options, Verdict, diagnose
from gateway.diagnosis.experiments import identifiability
from gateway.diagnosis.experiments.identifiability import _why
from gateway.diagnosis.noise.noise_floor import NoiseFloor
from gateway.diagnosis.result import FloorSource
from gateway.diagnosis.verdict import _decide_verdict, _Noise, _plant_of, _strongest_first
from tests.diagnosis.machine import MACHINE, NOISE_N, recorded, times_s

THERE: Any = ("something",)
TRUE_OR_NOT = (False, True)


@pytest.mark.parametrize(("caused", "left", "reached", "unexplained"), list(product(TRUE_OR_NOT, repeat=4)))
def test_a_verdict_never_says_more_than_is_known(caused: bool, left: bool, reached: bool, unexplained: bool) -> None:
    found = _decide_verdict(THERE * caused, THERE * left, reached=reached, unexplained=unexplained)
    assert (found in (Verdict.PARTIAL, Verdict.CONFIRMED)) == caused
    assert (found is Verdict.CONFIRMED) == (caused and reached and not left), "confirmed beside what is left over"
    assert (found is Verdict.NOTHING_FOUND) == (not caused and not left and not unexplained), "an error without a cause"


@pytest.mark.parametrize(
    ("share", "creep_s", "given_n"),
    [
        pytest.param(0.03, 4.0, 1.06 * NOISE_N, id="a floor above what is left"),
        pytest.param(0.01, 20.0, None, id="a time that hardly shows"),
    ],
)
def test_the_figures_of_an_answer_agree_with_each_other(share: float, creep_s: float, given_n: float | None) -> None:
    hidden = {"contact.creep_share": share, "contact.creep_s": creep_s}
    answer = diagnose([recorded(hidden, seed=2, time_s=times_s(24.0, 100.0))], MACHINE, Options(noise_floor_n=given_n))
    assert answer.base.cell.zero_n > 0.0, "the offset is the cell's, with its own sign"
    assert answer.baseline.noise_floor_n <= min(answer.extended.held_out_rms_n, answer.baseline.rms_n)
    (cause,) = answer.causes
    known = {one.name: one for form in BY_NAME[cause.name].forms for one in form.parameters}
    for name, estimate in cause.parameters.items():
        low, high = estimate.ci95
        assert known[name].low <= low <= estimate.value <= high <= known[name].high, "there is no time below 0"
    direct = {effect.name for effect in EFFECTS if effect.direct}
    assert not direct & {each.name for each in answer.not_identifiable}, "the readings themselves would tell"


@pytest.mark.parametrize(("share", "told"), [(0.0, "100 %"), (0.03, "97 %"), (0.06, "within the noise")])
def test_what_the_base_model_absorbs_is_told_by_how_much(share: float, told: str) -> None:
    effect = BY_NAME["creep"]
    said = _why(effect, frozenset({"command_v"}), 400.0, share)
    assert told in said and effect.excitation in said


def test_what_readings_tell_by_themselves_is_never_among_what_a_recording_cannot_show(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(identifiability, "with_known_rests", lambda *_: None)
    nothing: Any = SimpleNamespace(beside=SimpleNamespace(parameters=None, free=()), scores=())
    bench: Any = SimpleNamespace(columns=lambda: frozenset({"command_v"}))
    found = identifiability.find_invisible_effects(bench, EFFECTS, nothing, frozenset({"creep"}))
    told = {effect.name for effect in EFFECTS if not effect.direct and effect.name != "creep"}
    assert {each.name for each in found} == told and all(each.why for each in found)


def test_the_cause_that_makes_most_of_the_squared_error_is_told_first() -> None:
    """Of 1.0 N the way from 1.0 to 0.8 is longer than that from 0.5 to 0.25, though its difference is smaller."""
    gains = {"weak": (0.5, 0.25), "strong": (1.0, 0.8), "none": (0.3, 0.3)}
    causes: Any = [
        SimpleNamespace(name=name, gain=SimpleNamespace(held_out_rms_before_n=before_n, held_out_rms_after_n=after_n))
        for name, (before_n, after_n) in gains.items()
    ]
    assert [cause.name for cause in _strongest_first(causes)] == ["strong", "weak", "none"]


def test_what_is_left_reaches_a_floor_within_what_that_floor_is_unsure_by() -> None:
    for error_share, left_n, is_reached in (
        (0.0, 1.04, True),
        (0.0, 1.06, False),
        (0.1, 1.14, True),
        (0.1, 1.16, False),
    ):
        noise = _Noise(2.0, NoiseFloor(1.0, FloorSource.RESTS, error_share), 1.0, None)
        assert noise.is_reached(left_n) is is_reached, (error_share, left_n)


def test_the_zero_of_a_machine_that_was_recorded_several_times_is_the_mean_of_theirs() -> None:
    fitted: Any = SimpleNamespace(
        parameters=SimpleNamespace(plant_of=lambda recording: MACHINE, offsets_n=(0.25, 0.5, 0.75))
    )
    assert _plant_of(fitted).cell.zero_n == 0.5
