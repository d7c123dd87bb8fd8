"""The first rise in contact, judged sample by sample against a model whose expectation is given: sign, gain, and when it is
proven."""

from types import SimpleNamespace
from typing import Any

import pytest

from gateway.bsfm import Branches, Bsfm, LinearBlend, RationalBezier
from gateway.codes.faults import FaultCode
from gateway.control.sample_conditioning import Reading
from gateway.control.supervision.plausibility import ExpectedForce, RiseCheck
from tests.control.bench import bsfm

TICK_S, LASTS = 0.0625, 5  # so many samples are 0.3 s
RIGHT, SIGN, GAIN = FaultCode.NONE, FaultCode.SIGN_INVERTED, FaultCode.GAIN_WRONG
WIDTH_N = 2.0  # and 1 N of slack beside it


class Rise:
    """Contact from 0.5 N on; the cell's low-pass has come to rest before each judgement."""

    def __init__(self, rest_n: float = 0.0) -> None:
        self.check, self.outside_n = RiseCheck(0.5), 0.0
        self.hold(rest_n)
        self.check.start()

    def hold(self, cell_n: float, readings: int = 200) -> None:
        for _ in range(readings):
            self.check.smooth(Reading(cell_n=cell_n, interval_s=TICK_S, is_new=True, is_usable=True))

    def judged(self, expected_n: float, times: int = LASTS, *, touching: bool = True, kept_n: float = 0.0) -> FaultCode:
        model: Any = SimpleNamespace(
            rise_n=lambda share: expected_n, width_n=WIDTH_N, kept_n=kept_n, outside_n=self.outside_n
        )
        return [self.check.judge(model, 1.0, touching, TICK_S) for _ in range(times)][-1]

    def at(self, cell_n: float) -> "Rise":
        self.hold(cell_n)
        return self


@pytest.mark.parametrize(
    ("cell_n", "expected_n", "touching", "fault"),
    [
        (-0.51, 1.0, False, SIGN),
        (-0.51, 0.99, False, RIGHT),
        (-0.49, 1.0, False, RIGHT),
        (-3.01, 10.0, False, SIGN),
        (-2.99, 10.0, False, RIGHT),
        (37.0, 12.0, True, GAIN),  # over three times, and by more than friction
        (35.0, 12.0, True, RIGHT),
        (3.9, 1.0, True, RIGHT),  # friction explains it
        (4.1, 1.0, True, GAIN),
        (4.1, 0.99, True, RIGHT),
        (37.0, 12.0, False, RIGHT),
        (5.0, 20.0, True, GAIN),  # under 0.3 of the 17 beyond friction: 5.1
        (5.2, 20.0, True, RIGHT),
        (1.1, 20.0, True, GAIN),
        (0.9, 20.0, True, RIGHT),  # not moved: no air
    ],
)
def test_what_the_rise_says_of_sign_and_gain(
    cell_n: float, expected_n: float, touching: bool, fault: FaultCode
) -> None:
    rise = Rise().at(cell_n)
    assert rise.judged(expected_n, LASTS - 1, touching=touching) is RIGHT, "it has to last"
    assert rise.judged(expected_n, 1, touching=touching) is fault


@pytest.mark.parametrize(
    ("outside_n", "cell_n", "expected_n", "fault"),
    [
        (8.0, 27.1, 1.0, GAIN),  # three times 9
        (8.0, 26.9, 1.0, RIGHT),
        (8.0, 5.0, 20.0, GAIN),  # it may have been taken for zero: as without
        (8.0, 5.2, 20.0, RIGHT),
        (-8.0, 2.6, 20.0, GAIN),  # under 0.3 of the 9 beyond friction
        (-8.0, 2.8, 20.0, RIGHT),
        (-8.0, 4.1, 1.0, GAIN),
    ],
)
def test_what_is_known_to_come_from_outside_may_show_and_need_not(
    outside_n: float, cell_n: float, expected_n: float, fault: FaultCode
) -> None:
    rise = Rise()
    rise.outside_n = outside_n
    assert rise.at(cell_n).judged(expected_n) is fault


@pytest.mark.parametrize(("cell_n", "kept_n", "fault"), [(-2.4, 9.0, RIGHT), (-2.6, 9.0, SIGN), (-1.6, 1.0, SIGN)])
def test_what_friction_kept_at_the_last_tare_may_leave_and_is_no_wrong_sign(
    cell_n: float, kept_n: float, fault: FaultCode
) -> None:
    """Signal wires were blamed where the tool came to rest anew at 0.3 V (seed 259310 of the schedules)."""
    assert Rise().at(cell_n).judged(1.0, kept_n=kept_n) is fault


def test_what_friction_kept_when_the_model_was_measured_is_no_wrong_gain() -> None:
    assert Rise().at(8.0).judged(2.0, kept_n=4.0) is RIGHT
    assert Rise().at(9.5).judged(2.0, kept_n=4.0) is GAIN


def test_a_violation_that_ceases_is_counted_anew() -> None:
    for wrong_n, fault in ((-5.0, SIGN), (37.0, GAIN)):
        rise = Rise().at(wrong_n)
        assert rise.judged(12.0, LASTS - 1) is RIGHT
        rise.at(6.0).judged(4.9, 1)  # too small to prove the gain
        assert rise.at(wrong_n).judged(12.0, LASTS - 1) is RIGHT
        assert rise.judged(12.0, 1) is fault


@pytest.mark.parametrize(("expected_n", "readings", "is_proven"), [(5.0, 5, True), (5.0, 4, False), (4.9, 20, False)])
def test_a_gain_is_proven_by_a_rise_that_is_large_enough_and_lasts(
    expected_n: float, readings: int, is_proven: bool
) -> None:
    rise = Rise().at(5.0)
    rise.judged(expected_n, readings)
    rise.hold(37.0)
    assert rise.judged(12.0) is (RIGHT if is_proven else GAIN)
    rise.hold(0.0)
    rise.check.start()
    rise.hold(37.0)
    assert rise.judged(12.0) is GAIN, "each enable looks again"


def test_a_wrong_gain_proves_nothing() -> None:
    rise = Rise().at(37.0)
    for _ in range(3):
        rise.judged(12.0, LASTS - 1)
        assert rise.check.is_too_high
    assert rise.judged(12.0) is GAIN
    assert rise.judged(12.0, touching=False) is RIGHT and not rise.check.is_too_high, "nothing is held back for it"


def test_a_force_that_still_rises_is_not_too_low_yet() -> None:
    """The low-pass behind it is 0.2 s long, and a plant nobody has measured may need three times as much."""
    rising, resting = Rise(), Rise().at(4.0)
    rising.hold(4.0, 3)
    assert rising.judged(20.0) is RIGHT and resting.judged(20.0) is GAIN


def test_a_rest_above_the_contact_threshold_is_force_and_below_it_zero_error() -> None:
    assert [Rise(rest_n).check.measured_rise_n for rest_n in (3.0, 0.25, -3.0)] == pytest.approx([2.5, 0.0, 0.0])
    for rest_n, rise_n in ((3.0, 2.5), (-3.0, 0.0)):
        rise = Rise()
        rise.hold(10.0)
        rise.check.start()
        rise.check.shift(10.0 - rest_n)
        assert rise.check.smooth_n == pytest.approx(rest_n) and rise.check.measured_rise_n == pytest.approx(rise_n)


def test_what_pressed_at_the_enable_and_leaves_is_no_rise() -> None:
    """Right behind a restart the pressure of before still leaves, while the model expects what is set from now on."""
    rise = Rise(30.0).at(7.0)
    assert rise.judged(2.0) is RIGHT and not rise.check.is_too_high
    assert rise.check.measured_rise_n == pytest.approx(6.5) and rise.check.rise_since_lowest_n == pytest.approx(0.0)
    rise.hold(14.5)
    assert rise.judged(2.0) is GAIN and rise.check.wrong_rise_n == pytest.approx(7.5)
    rise.check.shift(3.0)
    assert rise.check.wrong_rise_n == pytest.approx(7.5)


def test_a_force_below_its_rest_has_not_risen_by_more_than_from_rest() -> None:
    rise = Rise().at(-5.0).at(3.9)
    assert rise.check.rise_since_lowest_n == pytest.approx(3.9)
    assert rise.judged(1.0) is RIGHT


def test_a_new_start_holds_nothing_back_that_the_one_before_did() -> None:
    rise = Rise().at(37.0)
    rise.judged(12.0, 1)
    assert rise.check.is_too_high
    rise.check.start()
    assert not rise.check.is_too_high


def test_what_a_model_expects_is_above_its_force_at_rest_and_friction_has_no_sign() -> None:
    crossed = Bsfm(Branches(bsfm().branches.falling, bsfm().branches.rising), LinearBlend(6.0))
    for model in (bsfm(), crossed):
        expected = ExpectedForce(model, 0.1, 0.0, stands_v=4.0)
        assert expected.width_n == pytest.approx(4.0) and expected.kept_n == 0.0
        assert expected.rise_n(1.0) == pytest.approx(model.force_n(4.0, 1.0))
    sinking = Bsfm(Branches(*(RationalBezier(0.0, 8.0, [-3.0, 26.0, 57.0], [1.0] * 3),) * 2), LinearBlend(6.0))
    expected = ExpectedForce(sinking, 0.1, 0.0)
    assert expected.kept_n == 0.0, "below 0 nothing is pressed"
    assert expected.rise_n(1.0) == 0.0 and expected.force_n(1.0) == -3.0


@pytest.mark.parametrize(
    ("cell_n", "readings", "fault"), [(4.0, 48, RIGHT), (4.0, 47, GAIN), (1.9, 48, GAIN), (8.1, 48, GAIN)]
)
def test_a_small_rise_that_was_near_what_is_expected_for_3_s_has_no_other_unit(
    cell_n: float, readings: int, fault: FaultCode
) -> None:
    """A rig that holds 4 N for hours was let go by a push of 9, with the units of the cell to blame."""
    rise = Rise().at(cell_n)
    assert rise.judged(4.0, readings) is RIGHT
    assert rise.at(13.0).judged(4.0) is fault


@pytest.mark.parametrize("is_new_start", [False, True])
def test_the_time_near_what_is_expected_is_one_without_a_break(is_new_start: bool) -> None:
    """Two seconds near it, twice, are no proof that the cell has the right unit."""
    rise = Rise().at(4.0)
    assert rise.judged(4.0, 32) is RIGHT
    if is_new_start:
        rise.hold(0.0)
        rise.check.start()
        rise.hold(4.0)
    else:
        rise.judged(1.5, 2)  # beyond twice of it
    assert rise.judged(4.0, 32) is RIGHT
    assert rise.at(13.0).judged(4.0) is GAIN
