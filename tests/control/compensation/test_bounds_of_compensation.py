"""What a compensation may not make of a rig: a harder trim, a lag below 0, volts of one kind taken for those of the other."""

from dataclasses import replace

import pytest

from gateway.control.compensation.command_map import CommandMap, apply_command_map
from gateway.control.compensation.compensation import TimingCompensation
from tests.control.bench import bsfm, settings

BOWED = CommandMap(bow=0.05, s=0.02)


def test_a_rig_that_is_quicker_than_it_was_said_gets_no_harder_trim() -> None:
    quicker = TimingCompensation(delay_s=0.01, lags_s=0.02, more_s=-0.08)
    assert quicker.settings(settings()).trim == settings().trim
    slower = TimingCompensation(delay_s=0.1, lags_s=0.2, more_s=0.12)
    assert slower.settings(settings()).trim.gain_v_per_n_s == pytest.approx(0.5 * settings().trim.gain_v_per_n_s)


@pytest.mark.parametrize(("more_s", "lag_s"), [(-0.5, 0.0), (0.0, 0.1), (9.0, 2.0)])
def test_a_lag_that_is_led_is_between_nothing_and_two_seconds(more_s: float, lag_s: float) -> None:
    led = replace(settings(), lead=replace(settings().lead, lag_s=0.1))
    timing = TimingCompensation(delay_s=0.0, lags_s=0.1, more_lag_s=more_s)
    assert timing.settings(led).lead.lag_s == pytest.approx(lag_s)


@pytest.mark.parametrize("voltage_v", [0.5, 3.0, 6.0])
def test_both_branches_are_told_at_the_volts_that_are_sent(voltage_v: float) -> None:
    model = apply_command_map(bsfm(), BOWED)
    assert model.branch_forces_n(voltage_v) == pytest.approx(
        (model.force_n(voltage_v, 1.0), model.force_n(voltage_v, -1.0))
    )
    assert model.branch_forces_n(voltage_v) != bsfm().branch_forces_n(voltage_v)


@pytest.mark.parametrize(
    ("sent_v", "straight_v"),
    [(5.0, 5.5), (2.5, 2.5 + 0.375 - 0.15), (7.5, 7.5 + 0.375 + 0.15), (9.0, 9.0 + 0.18 + 0.1152)],
)
def test_a_bow_is_widest_in_the_middle_and_an_s_turns_round_there(sent_v: float, straight_v: float) -> None:
    """Shares of 10 V, worked out by hand from the parabola and its product with the way from the middle."""
    assert BOWED.straight_v(sent_v) == pytest.approx(straight_v)


@pytest.mark.parametrize("voltage_v", [-0.5, 0.0, 10.0, 10.5])
def test_outside_of_its_range_nothing_is_bent(voltage_v: float) -> None:
    assert BOWED.sent_v(voltage_v) == BOWED.straight_v(voltage_v) == voltage_v
