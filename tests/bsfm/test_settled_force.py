"""The force at which a voltage settles is the one whose voltage it is, on wide loops and steep branches too."""

import pytest

from gateway.bsfm import Branches, Bsfm, LinearBlend, RationalBezier

VOLTS = (0.05, 0.17, 1.0, 4.0, 7.3, 7.75, 7.95)


@pytest.mark.parametrize("branch_share", [-0.94, -0.7, 0.0, 0.8])
@pytest.mark.parametrize(
    ("rising_n", "falling_n", "weights"),
    [
        ((0.0, 0.2, 60.0), (0.0, 59.0, 60.0), (1.0, 20.0, 1.0)),
        ((0.0, 21.0, 41.0, 60.0), (0.0, 59.4, 59.7, 60.0), (1.0, 20.0, 1.0, 1.0)),
        ((0.0, 4.7, 5.7, 60.0), (0.0, 59.1, 59.2, 60.0), (1.0, 20.0, 20.0, 1.0)),
    ],
)
def test_a_force_is_found_where_newtons_steps_would_leave_the_loop(
    rising_n: tuple[float, ...], falling_n: tuple[float, ...], weights: tuple[float, ...], branch_share: float
) -> None:
    """Without the bracket, or with one that is not narrowed, it was up to 7 V off."""
    rising, falling = (RationalBezier(0.0, 8.0, handles, weights) for handles in (rising_n, falling_n))
    model = Bsfm(Branches(rising, falling), LinearBlend(6.0))
    found = [model.voltage_v(model.settled_n(volts, branch_share), branch_share)[0] for volts in VOLTS]
    assert found == pytest.approx(VOLTS, abs=1e-9)
