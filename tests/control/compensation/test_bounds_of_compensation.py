"""What a compensation may not make of a rig: a harder trim, a lag below 0, volts of one kind taken for those of the other."""

from dataclasses import replace

import pytest

from gateway.bsfm.drive_map import DriveMap
from gateway.bsfm.model import Response
from gateway.control import CalibrationInUse, Controller
from gateway.control.compensation.command_map import CommandMap, apply_command_map
from gateway.control.compensation.compensation import TimingCompensation
from gateway.control.force_loop.feedforward import Feedforward
from tests.control.bench import Bench, SmallPlant, bsfm, settings

BOWED = CommandMap(bow=0.05, s=0.02)


def test_a_rig_that_is_quicker_than_it_was_said_gets_no_harder_trim() -> None:
    quicker = TimingCompensation(delay_s=0.01, lags_s=0.02, more_s=-0.08)
    assert quicker.settings(settings()).trim == settings().trim
    nothing_left = TimingCompensation(delay_s=0.0, lags_s=0.0, more_s=-0.5)
    assert 0.0 < nothing_left.settings(settings()).supervision.response_lag_s <= 0.01
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


@pytest.mark.parametrize("bow", [-0.1, 0.05, 0.1])
def test_the_thrust_of_a_voltage_is_that_which_arrives(bow: float) -> None:
    """What lags and trim reckon with: a bend that is compensated is in the volts that are sent."""
    command = CommandMap(bow=bow, s=0.0)
    straight, sent = DriveMap(bsfm()), DriveMap(apply_command_map(bsfm(), command))
    for from_v, to_v in ((1.0, 3.0), (3.0, 5.0), (4.0, 7.0)):
        arrives_n = straight.n_per_v * (straight.linear_v(to_v) - straight.linear_v(from_v))
        from_sent_v, to_sent_v = command.sent_v(from_v), command.sent_v(to_v)
        assert sent.n_per_v * (sent.linear_v(to_sent_v) - sent.linear_v(from_sent_v)) == pytest.approx(
            arrives_n, rel=0.04
        )


@pytest.mark.parametrize("force_n", [4.0, 20.0, 45.0])
def test_the_limit_of_the_trim_is_one_in_volts_that_are_sent(force_n: float) -> None:
    model = apply_command_map(bsfm(), CommandMap(bow=-0.1, s=0.0))
    law = Feedforward(model, settings().limits, 0.1)
    law.take_over(force_n)
    volts = [model.voltage_v(force_n + part_n, 1.0)[0] for part_n in (-0.01, 0.01)]
    assert law.slope_n_per_v(0.0) == pytest.approx(0.02 / (volts[1] - volts[0]), rel=0.01)


class _BentPlant(SmallPlant):
    def advance(self, voltage_v: float, steps: int = 1) -> None:
        super().advance(CommandMap(bow=-0.1, s=0.0).straight_v(voltage_v), steps)


def test_a_step_goes_no_further_beyond_its_end_where_a_bend_is_compensated() -> None:
    bench = Bench()
    bench.plant = _BentPlant(bench.rng, lag_s=0.12, delay_s=0.03)
    model = apply_command_map(bsfm(), CommandMap(bow=-0.1, s=0.0))
    response = Response(dead_time_s=0.035, lag_s=0.12, second_lag_s=0.015)
    bench.controller = Controller(bench.settings, CalibrationInUse(model, 1, response))
    bench.run(0.3)
    bench.enable(5.0, force_ramp_n_per_s=2000.0)
    bench.run(1.0)
    bench.history.clear()
    bench.force(30.0)
    bench.run(1.0)
    assert max(one.force_n for one in bench.history) < 31.0
    assert all(abs(one.force_n - 30.0) < 1.0 for one in bench.history if one.time_s > bench.history[0].time_s + 0.25)
