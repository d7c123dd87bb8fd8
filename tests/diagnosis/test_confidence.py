"""A name is no surer than what is still open beside it allows."""

from dataclasses import replace

import numpy as np
import pytest

from gateway.diagnosis import Options, diagnose
from gateway.diagnosis.confidence import bound_confidences
from gateway.diagnosis.result import Cause, Gain, Verdict
from tests.diagnosis.machine import MACHINE, NOISE_N, recorded, times_s

FLOOR_N = 0.1


def cause(explained_n2: float, confidence: float = 1.0) -> Cause:
    before_n = (FLOOR_N**2 + explained_n2) ** 0.5
    return Cause("leak", ("leak",), confidence, {}, Gain(before_n, FLOOR_N, (0.0, 1.0), 1.0))


def bounded(*explained_n2: float, unexplained_n2: float = 0.0) -> list[float]:
    return [each.confidence for each in bound_confidences([cause(one) for one in explained_n2], unexplained_n2)]


def test_where_nothing_is_open_resampling_alone_decides() -> None:
    assert bounded(0.01) == [1.0]
    assert [each.confidence for each in bound_confidences([cause(0.01, 0.6)], 0.0)] == [0.6]


def test_more_unexplained_than_explained_is_no_certainty() -> None:
    """Steps of the command that won 98 % beside a stiction, with six times as much left open."""
    assert bounded(0.0035, unexplained_n2=0.0218) == [pytest.approx(0.138, abs=0.001)]


def test_what_a_stronger_cause_may_have_left_is_no_sure_cause_but_two_alike_are() -> None:
    """A leak that won 100 % beside a hunting of eleven times its size: it was the friction's answer to the oscillation."""
    strong, weak = bounded(0.0142, 0.00126)
    assert strong == 1.0
    assert weak < 0.8
    assert min(bounded(0.01, 0.009)) > 0.95


def test_a_cause_that_explains_nothing_is_never_sure() -> None:
    assert bounded(0.0) == [0.0]


def test_noise_is_not_what_a_cause_leaves_open() -> None:
    """A wave of 0.05 N that has no name is: above the floor it leaves a tenth of what the noise itself would."""
    given = recorded({"contact.creep_share": 0.03, "contact.creep_s": 4.0}, seed=2, time_s=times_s(24.0, 100.0))
    waved = replace(given, force_n=given.force_n + 0.05 * np.sin(2.0 * np.pi * 0.9 * given.time_s))
    (creep,) = diagnose([waved], MACHINE, Options(noise_floor_n=NOISE_N)).causes
    assert creep.name == "creep"
    assert 0.9 < creep.confidence < 0.99


def test_a_cause_that_another_one_s_form_may_be_confirms_nothing() -> None:
    """The floor is given, and reached: without its doubt about the second cause the answer would be `confirmed`."""
    hidden = {"contact.creep_share": 0.1, "contact.creep_s": 4.0, "regulator.hysteresis_pa": 3000.0}
    answer = diagnose([recorded(hidden, seed=2, time_s=times_s(24.0, 100.0))], MACHINE, Options(noise_floor_n=NOISE_N))
    strong, weak = answer.causes
    assert (strong.name, weak.name) == ("creep", "regulator-hysteresis")
    assert answer.extended.reaches_noise_floor and not answer.leftover
    assert weak.confidence < 0.5
    assert answer.verdict is Verdict.PARTIAL
