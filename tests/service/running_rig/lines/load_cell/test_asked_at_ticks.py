"""A load cell that is asked at the loop's ticks, which seldom come to the microsecond."""

from dataclasses import replace

import pytest

from gateway.devices.device_checks.identity import Identity
from tests.service.running_rig.lines.load_cell.test_load_cell_line import POLLED, READING, Wire


@pytest.mark.parametrize(("rate_hz", "ticks"), [(100.0, 1), (50.0, 2), (10.0, 10), (1.0, 100)])
def test_a_cell_is_asked_at_the_tick_at_which_it_is_due_though_that_comes_early(rate_hz: float, ticks: int) -> None:
    """By microseconds: a fifth of the readings of a 100 Hz cell were missing, and every other gap was twice as long."""
    wire = Wire(replace(POLLED, read_force=replace(READING, rate_hz=rate_hz)))
    for tick in range(10 * ticks):
        wire.exchange.tick(100.0 + 0.01 * tick + (200e-6, 20e-6, 90e-6)[tick % 3])
        if len(wire.asked) > len(wire.samples):
            wire.now_s = 100.0 + 0.01 * tick + 4e-3
            wire.hear(wire.device.frame(1.0))
    assert len(wire.asked) == 10


@pytest.mark.parametrize(("rate_hz", "expected"), [(80.0, 80), (70.0, 70), (30.0, 30), (60.0, 60)])
def test_a_rate_that_is_no_part_of_the_loops_is_met_on_the_average_and_never_passed(
    rate_hz: float, expected: int
) -> None:
    """80 Hz in a loop of 100 Hz were 50 readings a second: due 12.5 ms behind each question, so at every other tick."""
    wire = Wire(replace(POLLED, read_force=replace(READING, rate_hz=rate_hz)))
    asked: list[float] = []
    for tick in range(100):
        now_s = 100.0 + 0.01 * tick + (200e-6, 20e-6, 90e-6)[tick % 3]
        wire.exchange.tick(now_s)
        if len(wire.asked) > len(wire.samples):
            asked.append(now_s)
            wire.now_s = 100.0 + 0.01 * tick + 4e-3
            wire.hear(wire.device.frame(1.0))
    assert abs(len(asked) - expected) <= 1
    for first, after in zip(asked, asked[2:], strict=False):
        assert after - first >= 1.0 / rate_hz, "at most one comes sooner, for one that came late"


def test_a_question_that_came_much_too_late_is_not_made_up_for() -> None:
    """A wire that was silent for seconds brings no row of questions faster than the device's own rate."""
    wire = Wire(replace(POLLED, read_force=replace(READING, rate_hz=10.0)))
    wire.tick()
    wire.answer(after_s=0.001)
    wire.tick(5.0)
    wire.answer(after_s=0.001)
    asked = len(wire.asked)
    wire.tick(0.05)
    assert (asked, len(wire.asked)) == (2, 2)


def test_one_lost_answer_of_a_slow_cell_is_no_silence_behind_which_another_may_be() -> None:
    """Of one reading a second each lost one would cost a question what it is, and readings meanwhile."""
    identity = Identity(ask="ID?", answer="ID {model:s}", models=("A1",))
    wire = Wire(replace(POLLED, identity=identity, read_force=replace(READING, rate_hz=1.0)))
    wire.tick()
    wire.exchange.receive(b"ID A1\r\n", wire.now_s)
    wire.answer()
    for _ in range(145):
        wire.tick()
    assert set(wire.asked[1:]) == {b"W?\r\n"}
    for _ in range(20):
        wire.tick()
    assert wire.asked[-1] == b"ID?\r\n", "half a second beyond its period is one"
