"""A name is no surer than what is still open beside it allows."""

import pytest

from gateway.diagnosis.confidence import bound_confidences
from gateway.diagnosis.result import Cause, Gain

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
