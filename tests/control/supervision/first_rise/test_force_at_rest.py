"""The forces that the first rise begins from: at rest, the lowest since then, and what both are behind a tare."""

import pytest

from gateway.codes.faults import FaultCode
from gateway.control import LineStatus
from gateway.control.supervision.plausibility import LeftForce
from tests.control.bench import bsfm
from tests.control.supervision.first_rise.test_judged_rise import GAIN, RIGHT, Rise

KEPT_N = 6.0  # pressed at rest: of 30 N that are expected too little for a rise, and 1.5 N are a move
EXPECTED_N = 30.0


@pytest.mark.parametrize(("cell_n", "fault"), [(KEPT_N, RIGHT), (KEPT_N + 1.4, RIGHT), (KEPT_N + 1.6, GAIN)])
def test_whether_a_force_has_moved_counts_from_the_one_at_rest(cell_n: float, fault: FaultCode) -> None:
    """What friction has kept and still keeps has no wrong unit."""
    assert Rise(KEPT_N).at(cell_n).judged(EXPECTED_N) is fault


def test_each_enable_takes_its_own_force_at_rest() -> None:
    rise = Rise().at(KEPT_N)
    assert rise.judged(EXPECTED_N) is GAIN
    rise.check.start()
    assert rise.judged(EXPECTED_N) is RIGHT


def test_a_false_reading_right_before_an_enable_is_no_force_at_rest() -> None:
    rise = Rise(KEPT_N)
    rise.hold(-40.0, 1)
    rise.check.start()
    assert rise.at(KEPT_N).judged(40.0) is RIGHT, "a part of it, 1.7 N, is less than a move"


@pytest.mark.parametrize("moved_n", [10.0, -10.0])
def test_a_tare_moves_the_force_at_rest_with_it(moved_n: float) -> None:
    for cell_n, fault in ((KEPT_N, RIGHT), (KEPT_N + 1.4, RIGHT), (KEPT_N + 1.6, GAIN)):
        rise = Rise(KEPT_N + moved_n)
        rise.check.shift(moved_n)
        assert rise.at(cell_n).judged(EXPECTED_N) is fault


def test_what_pressed_at_the_enable_and_stays_has_not_risen_too_high() -> None:
    rise = Rise(20.0)
    assert rise.judged(4.0) is RIGHT and not rise.check.is_too_high
    rise.at(0.0).at(20.0).check.start()
    assert rise.judged(4.0) is RIGHT, "the lowest force of before the enable does not count"


def test_what_has_left_since_the_enable_and_comes_again_has_risen() -> None:
    assert Rise(20.0).at(5.0).at(20.0).judged(4.0) is GAIN
    assert Rise(20.0).at(9.0).at(20.0).judged(4.0) is RIGHT


def test_a_tare_moves_the_lowest_force_with_it() -> None:
    rise = Rise(10.0)
    rise.check.shift(-10.0)
    assert rise.at(20.0).judged(2.0) is RIGHT


def test_what_may_stand_on_an_output_leaves_from_when_something_else_surely_does() -> None:
    left, lag_s = LeftForce(bsfm(), 0.1, 0.0), 0.1
    before_n = bsfm().force_n(4.0, 1.0)
    for stands_v, wanted_v, share in ((4.0, 4.0, 1.0), (None, 0.0, 1.0), (0.0, 0.0, 0.37), (None, 0.0, 0.14)):
        line = LineStatus(acknowledged_v=4.0, sent_v=wanted_v, standing_v=stands_v)
        for _ in range(2000 if share == 1.0 else 100):
            left.advance(wanted_v, line, 0.01 * lag_s)
        assert left.rise_n == pytest.approx(share * before_n, rel=0.15)
    lost = LineStatus(acknowledged_v=None, sent_v=None, standing_v=None)
    left.advance(4.0, LineStatus(acknowledged_v=4.0, sent_v=4.0, standing_v=4.0), 10.0)
    kept_n = left.rise_n
    left.advance(0.0, lost, 10.0)
    assert left.rise_n >= kept_n, "a port that is away takes no force away"
