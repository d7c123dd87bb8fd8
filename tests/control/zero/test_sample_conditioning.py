"""What a sample means for control: new or not, fresh or not, too strong either way; and which samples a zero may be made of."""

import pytest

from gateway.control.compensation.cell_map import CellMap
from gateway.control.sample_conditioning import SampleConditioner, at_time
from gateway.control.settings import Supervision
from gateway.devices.messages import ForceSample, Quality

BOUNDS = Supervision(sample_timeout_s=0.05, saturation_n=96.0)


def sample(force_n: float, time_s: float) -> ForceSample:
    return ForceSample(force_n, force_n, Quality.OK, time_s)


def test_a_sample_is_new_once_and_never_when_it_is_older_than_the_last() -> None:
    """An interval below 0 would take back what supervision has counted."""
    conditioner = SampleConditioner(BOUNDS)
    conditioner.read(1.0, sample(5.0, 1.0), 0.0)
    for time_s in (1.0, 0.99, 0.5):
        again = conditioner.read(1.01, sample(5.0, time_s), 0.0)
        assert not again.is_new and again.interval_s == 0.0
    assert conditioner.read(1.02, sample(5.0, 1.02), 0.0).interval_s == pytest.approx(0.02)


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("force_n", [96.0, -96.0])
def test_a_saturated_cell_is_an_overload_pressed_or_pulled(force_n: float, direction: float) -> None:
    conditioner = SampleConditioner(BOUNDS)
    conditioner.direction = direction
    reading = conditioner.read(1.0, sample(force_n, 1.0), 0.0)
    assert reading.overload and not reading.is_usable
    assert not conditioner.read(1.0, sample(0.99 * force_n, 1.01), 0.0).overload


def test_a_reading_grows_old_between_two_steps_too() -> None:
    """An edge that comes then is judged by the cell of then."""
    reading = SampleConditioner(BOUNDS).read(1.04, sample(5.0, 1.0), 0.0)
    assert reading.is_fresh and at_time(reading, 0.009, BOUNDS).is_fresh
    later = at_time(reading, 0.02, BOUNDS)
    assert not later.is_fresh and not later.is_new and later.age_s == pytest.approx(0.06)


def test_a_zero_is_made_of_no_sample_from_before_a_gap() -> None:
    conditioner = SampleConditioner(BOUNDS)
    for k in range(20):
        conditioner.read(1.0, sample(1.0, 1.0 + 0.01 * k), 0.0)
    assert conditioner.why_no_zero(0.0) == ""
    for k in range(3):
        conditioner.read(9.0, sample(1.2, 9.0 + 0.01 * k), 0.0)
    assert conditioner.why_no_zero(0.0).startswith("3 usable samples")


def test_an_overload_is_no_part_of_a_zero() -> None:
    conditioner = SampleConditioner(BOUNDS)
    for k in range(12):
        force_n = 120.0 if k == 6 else 1.0
        conditioner.read(1.0, sample(force_n, 1.0 + 0.01 * k), 0.0)
    assert conditioner.why_no_zero(0.0) == ""
    conditioner.take_zero(0.0)
    assert conditioner.zero_n == pytest.approx(1.0)


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("hung_n", [45.0, 50.0])
def test_a_zero_and_its_refusal_count_the_weight_the_same_way_pressed_or_pulled(
    direction: float, hung_n: float
) -> None:
    """A payload that hangs on the cell is taken off, whichever way is positive; what is left may be half of the range."""
    conditioner = SampleConditioner(BOUNDS)
    conditioner.direction = direction
    for k in range(12):
        conditioner.read(1.0, sample(hung_n - 5.0, 1.0 + 0.01 * k), direction * 5.0)
    assert (conditioner.why_no_zero(direction * 5.0) == "") == (hung_n < 48.0)
    before_n = conditioner.read(1.2, sample(hung_n - 5.0, 1.2), direction * 5.0).contact_n
    moved_n = conditioner.take_zero(direction * 5.0)
    after_n = conditioner.read(1.21, sample(hung_n - 5.0, 1.21), direction * 5.0).contact_n
    assert (after_n, before_n - moved_n) == (pytest.approx(0.0), pytest.approx(0.0))


CELLS = (None, CellMap(crosstalk_n_per_v=0.4), CellMap(crosstalk_n_per_v=-0.3, quadratic_per_n=2.0e-3, zero_n=0.4))


@pytest.mark.parametrize("before", CELLS)
@pytest.mark.parametrize("after", CELLS)
def test_what_was_zero_is_zero_by_other_defects_of_the_cell_too(before: CellMap | None, after: CellMap | None) -> None:
    """No voltage was out when the tare was taken: none of its zero is the voltage's."""
    conditioner = SampleConditioner(BOUNDS, before)
    for k in range(12):
        conditioner.read(1.0, sample(3.0, 1.0 + 0.01 * k), 0.0)
    conditioner.take_zero(0.0)
    conditioner.use(after)
    assert conditioner.read(1.2, sample(3.0, 1.2), 0.0).cell_n == pytest.approx(0.0, abs=1e-6)


def test_a_zero_is_the_mean_of_a_fifth_of_a_second() -> None:
    conditioner = SampleConditioner(BOUNDS)
    for k in range(40):
        conditioner.read(1.0, sample(9.0 if k < 20 else 1.0 if k < 35 else 1.4, 1.0 + 0.01 * k), 0.0)
    conditioner.take_zero(0.0)
    assert conditioner.zero_n == pytest.approx(1.1)


def test_a_sample_that_is_dated_later_than_its_step_has_no_age_and_a_gap_counts_as_one_time_out() -> None:
    """What is learned from a sample is learned over its interval: of a gap nobody knows what was in it."""
    conditioner = SampleConditioner(BOUNDS)
    conditioner.read(1.0, sample(1.0, 1.0), 0.0)
    assert conditioner.read(1.01, sample(1.0, 1.012), 0.0).age_s == 0.0
    behind = conditioner.read(9.0, sample(1.0, 9.0), 0.0)
    assert behind.is_new and behind.interval_s == BOUNDS.sample_timeout_s


@pytest.mark.parametrize("is_known", [True, False])
def test_while_nobody_knows_what_stands_on_the_output_a_force_is_no_zero(is_known: bool) -> None:
    conditioner = SampleConditioner(BOUNDS)
    for k in range(30):
        conditioner.note_output(is_known=is_known)
        conditioner.read(0.01 * k, sample(5.0, 0.01 * k), 0.0)
    assert (conditioner.why_no_zero(0.0) == "") is is_known
