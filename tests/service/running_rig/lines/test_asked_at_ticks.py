"""A load cell that is asked at the loop's ticks, which seldom come to the microsecond."""

from dataclasses import replace

import pytest

from tests.service.running_rig.lines.test_load_cell_line import POLLED, READING, Wire


@pytest.mark.parametrize(("rate_hz", "ticks"), [(100.0, 1), (50.0, 2), (10.0, 10), (80.0, 2), (1.0, 100)])
def test_a_cell_is_asked_at_the_tick_at_which_it_is_due_though_that_comes_early(rate_hz: float, ticks: int) -> None:
    """By microseconds: a fifth of the readings of a 100 Hz cell were missing, and every other gap was twice as long."""
    wire = Wire(replace(POLLED, read_force=replace(READING, rate_hz=rate_hz)))
    for tick in range(10 * ticks):
        wire.exchange.tick(100.0 + 0.01 * tick + (200e-6, 20e-6, 90e-6)[tick % 3])
        if len(wire.asked) > len(wire.samples):
            wire.now_s = 100.0 + 0.01 * tick + 4e-3
            wire.hear(wire.device.frame(1.0))
    assert len(wire.asked) == 10
