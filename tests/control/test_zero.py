"""What a zero is made of, by number."""

import pytest

from gateway.control.tare import Zero
from tests.control.bench import settings


@pytest.mark.parametrize(("readings", "why"), [(4, "4 usable samples, at least 5 are needed"), (5, "")])
def test_a_zero_is_the_mean_of_five_readings_at_least(readings, why):
    zero = Zero(settings().supervision)
    for _ in range(readings):
        zero.observe(0.1, 0.01)
    assert zero.unsteady(0.0) == why


@pytest.mark.parametrize("share", [0.49, 0.51, -0.51])
def test_a_zero_beyond_half_of_the_saturation_leaves_no_range_to_measure(share):
    supervision = settings().supervision
    zero = Zero(supervision)
    for _ in range(20):
        zero.observe(share * supervision.saturation_n, 0.01)
    assert ("stuck in contact or wrong cell" in zero.unsteady(0.0)) is (abs(share) > 0.5)


def test_of_a_fast_cell_no_sample_of_before_a_gap_is_in_the_zero_behind_it() -> None:
    zero = Zero(settings().supervision)
    zero.observe(20.0, 0.004)
    zero.forget()
    for _ in range(2 * 5):
        zero.observe(1.0, 0.004)
    assert zero.unsteady(0.0) == ""
    zero.take(0.0)
    assert zero.zero_n == 1.0
