"""Where a value lies on an axis, and which values are marked."""

import pytest

from gateway.reports.axis import Axis


def test_whole_numbers_are_marked_up_to_both_ends() -> None:
    assert Axis(0.5, 4.0, "order", whole=True).ticks() == [1.0, 2.0, 3.0, 4.0]
    assert Axis(1.0, 4.5, "order", whole=True).ticks() == [1.0, 2.0, 3.0, 4.0]


@pytest.mark.parametrize(("value", "share"), [(1.0, 0.0), (10.0, 1.0 / 3.0), (100.0, 2.0 / 3.0), (1000.0, 1.0)])
def test_on_a_logarithmic_axis_each_decade_takes_as_much(value: float, share: float) -> None:
    assert Axis(1.0, 1000.0, "Hz", logarithmic=True).share(value) == pytest.approx(share)
    assert Axis(1.0, 1000.0, "Hz").share(value) == pytest.approx((value - 1.0) / 999.0)
