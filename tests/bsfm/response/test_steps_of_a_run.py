"""How the rows of a run become steps: where one begins and has settled, how it was put out, and what the model makes of it."""

from dataclasses import replace
from math import exp, inf
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gateway.bsfm.ladder.settled_points import SAME_V
from gateway.bsfm.response.response_model import JoinedSteps, Lags, StepResponse, missing_share
from gateway.bsfm.response.step_responses import (
    LEAST_STEP_N,
    RecordedRun,
    _changes,
    _correct_ends,
    _is_ramp,
    _linearize,
    _mean_settled_n,
    _Plateau,
    _plateaus,
    _row_changes,
    _stands_out,
    _way,
    step_responses_of,
    tail_rows,
)
from gateway.defaults import TICK_S
from tests.bsfm.response.test_identification import model

ROW_S = 0.05


def run_of(*held: tuple[float, int], slew_v_per_s: float = inf) -> RecordedRun:
    """Rows of these voltages, each for so many."""
    command_v = np.concatenate([np.full(rows, volts) for volts, rows in held])
    time_s = 10.0 + ROW_S * np.arange(command_v.size)
    return RecordedRun(time_s, command_v, 7.0 * command_v, slew_v_per_s)


def plateaus_of(run: RecordedRun) -> list[tuple[int, int, int]]:
    return [(one.first, one.last, one.end) for one in _plateaus(run.time_s, run.command_v)]


def test_a_voltage_that_is_held_is_a_plateau_whose_last_force_is_read_with_the_next_command() -> None:
    assert plateaus_of(run_of((1.0, 5), (2.0, 4), (3.0, 6))) == [(0, 4, 5), (5, 8, 9), (9, 14, 14)]
    assert plateaus_of(run_of((1.0, 5), (1.0 + SAME_V / 2, 5))) == [(0, 9, 9)], "the same voltage"


def test_a_way_up_belongs_to_where_it_leads_and_the_last_row_to_itself() -> None:
    assert plateaus_of(run_of((0.0, 5), (1.0, 1), (2.0, 2), (3.0, 4))) == [(0, 4, 5), (5, 11, 11)]
    assert plateaus_of(run_of((0.0, 5), (1.0, 4), (2.0, 1))) == [(0, 4, 5), (5, 8, 9), (9, 9, 9)]


def test_the_settled_force_is_that_of_its_tail_one_row_behind_the_command() -> None:
    force_n = np.arange(20.0)
    assert tail_rows(2) == tail_rows(3) == 2
    rows = force_n[6:16]
    assert _mean_settled_n(force_n, _Plateau(5, 14, 15)) == np.mean(rows[-tail_rows(10) :])
    assert _mean_settled_n(force_n, _Plateau(19, 19, 19)) == 19.0


@pytest.mark.parametrize(("way_v", "slew_v_per_s"), [(2.0, 40.0), (0.33, 7.0), (1.0, 1.0), (5e-3, 1.0)])
def test_a_slow_rise_is_put_out_tick_by_tick_and_in_all_the_whole_step(way_v: float, slew_v_per_s: float) -> None:
    changes = _changes(3.0, 1.0, 1.0 + way_v, slew_v_per_s)
    times_s, moves_v = np.array(changes).T
    assert np.sum(moves_v) == pytest.approx(way_v, abs=SAME_V)
    assert times_s == pytest.approx(3.0 + TICK_S * np.arange(len(changes)))
    assert np.all(moves_v > 0.0) and np.max(moves_v) <= slew_v_per_s * TICK_S * (1.0 + 1e-9)
    assert len(changes) == int(np.ceil(way_v / (slew_v_per_s * TICK_S) - 1e-9))


@pytest.mark.parametrize(
    ("from_v", "to_v", "slew_v_per_s"), [(3.0, 1.0, 1.0), (1.0, 3.0, inf), (1.0, 1.0 + TICK_S, 1.0)]
)
def test_a_fall_and_what_fits_into_one_tick_are_put_out_at_once(
    from_v: float, to_v: float, slew_v_per_s: float
) -> None:
    assert _changes(3.0, from_v, to_v, slew_v_per_s) == ((3.0, pytest.approx(to_v - from_v)),)


def test_a_command_that_took_longer_than_its_slew_is_a_ramp_and_its_rows_are_the_way() -> None:
    ramp = run_of((0.0, 5), (1.0, 1), (2.0, 1), (3.0, 1), (4.0, 1), (5.0, 6))
    step = run_of((0.0, 5), (5.0, 6))
    plateau = _Plateau(5, 14, 14)
    assert _is_ramp(ramp, plateau)
    assert not _is_ramp(step, _Plateau(5, 10, 10))
    slewed = RecordedRun(ramp.time_s, ramp.command_v, ramp.force_n, slew_v_per_s=1.0 / ROW_S)
    assert not _is_ramp(slewed, plateau), "as fast as it may rise"
    changes = _row_changes(ramp, plateau)
    assert changes == tuple((pytest.approx(10.0 + ROW_S * row), 1.0) for row in range(5, 10))
    falls = run_of((5.0, 5), (4.0, 1), (3.0, 1), (2.0, 1), (1.0, 1), (0.0, 6), slew_v_per_s=1.0)
    assert _is_ramp(falls, plateau), "a fall has no slew"


def test_an_end_that_had_not_settled_is_corrected_by_what_was_missing() -> None:
    lag_s = 0.2
    time_s = ROW_S * np.arange(40)
    plateaus = [_Plateau(0, 9, 10), _Plateau(10, 19, 20), _Plateau(20, 39, 39)]
    since_s = time_s[11:21] - time_s[10] - 0.05
    share = np.mean(np.exp(-since_s[-tail_rows(10) :] / lag_s))
    reached_n = 10.0 + 20.0 * (1.0 - share)
    ends_n = _correct_ends([10.0, reached_n, 30.0], plateaus, time_s, Lags(0.05, lag_s))
    assert ends_n == pytest.approx([10.0, 30.0, 30.0], abs=1e-9)
    slow = _correct_ends([10.0, 20.0, 20.0], plateaus, time_s, Lags(0.05, 50.0))
    assert slow[1] == pytest.approx(10.0 + 10.0 / 0.8), "more than a fifth is not believed to come"


@pytest.mark.parametrize(
    ("rows", "noise_n", "step_n", "stands_out"),
    [
        (20, 0.0, LEAST_STEP_N, True),
        (20, 0.0, LEAST_STEP_N - 0.1, False),
        (3, 0.0, 20.0, False),
        (20, 2.0, 10.0, False),
        (20, 0.2, 10.0, True),
    ],
)
def test_a_step_needs_readings_and_more_force_than_their_noise(
    rows: int, noise_n: float, step_n: float, stands_out: bool
) -> None:
    force_n = 30.0 + noise_n * np.where(np.arange(rows) % 2, 1.0, -1.0)
    for from_n, to_n in ((30.0 - step_n, 30.0), (30.0 + step_n, 30.0)):
        assert _stands_out(force_n, from_n, to_n) is stands_out


@pytest.mark.parametrize(("volts", "forces_n"), [((2.0, 5.0), (13.0, 36.0)), ((5.0, 2.0), (38.0, 15.0))])
def test_the_models_way_leads_through_both_readings_and_back_from_the_end(
    volts: tuple[float, float], forces_n: tuple[float, float]
) -> None:
    bsfm = model()
    way = _way(bsfm, bsfm.reversal.start(), volts, forces_n)
    assert way is not None
    path_v, path_n, back_v, back_n = way
    assert (path_v[0], path_v[-1]) == pytest.approx(sorted(volts))
    assert (path_n[0], path_n[-1]) == pytest.approx(sorted(forces_n))
    assert np.all(np.diff(path_v) >= 0.0) and np.all(np.diff(path_n) > 0.0)
    assert back_n[0] == 0.0 and np.all(np.diff(back_n) > 0.0)
    way_up = 1.0 if volts[1] > volts[0] else -1.0
    assert back_v[0] == pytest.approx(volts[1]) and np.all(way_up * np.diff(back_v) <= 0.0)
    assert way_up * (back_v[-1] - back_v[0]) < -0.3


@pytest.mark.parametrize(
    ("volts", "forces_n"), [((2.0, 5.0), (20.0, 22.9)), ((2.0, 5.0), (36.0, 13.0)), ((5.0, 2.0), (13.0, 36.0))]
)
def test_a_force_that_hardly_moves_or_goes_the_other_way_is_no_response(
    volts: tuple[float, float], forces_n: tuple[float, float]
) -> None:
    bsfm = model()
    assert _way(bsfm, bsfm.reversal.start(), volts, forces_n) is None


def test_what_came_shortly_before_a_step_may_last_into_it_and_what_is_long_ago_does_not() -> None:
    run = run_of((2.0, 60), (5.0, 19), (2.0, 19), (5.0, 60), (2.0, 60))
    steps = step_responses_of(
        RecordedRun(run.time_s, run.command_v, 7.0 * np.interp(run.time_s - ROW_S, run.time_s, run.command_v)), model()
    )
    assert [step.way for step in steps] == [1.0, -1.0, 1.0, -1.0]
    assert [len(step.changes) for step in steps] == [1, 2, 3, 1]
    assert all(step.time_s[0] > step.changes[-1][0] for step in steps)


def ringing(way: float, bend: float = 2.0) -> StepResponse:
    """From 10 to 30 N over 2 V on a way that gets steeper towards its end, or its mirror."""
    time_s = np.concatenate([np.linspace(0.0, 3.0, 60), [30.0]])
    share = np.linspace(0.0, 1.0, 25)
    path_v, path_n = 2.0 + 2.0 * share, 10.0 + 20.0 * share**bend
    if way < 0.0:
        path_n = 40.0 - path_n[::-1]
    back_n = np.array([0.0, 1.0, 2.0, 6.0])
    end_v = 4.0 if way > 0.0 else 2.0
    return StepResponse(time_s, time_s, ((0.0, 2.0 * way),), end_v, path_v, path_n, back_n / 20.0, back_n)


def test_down_is_the_mirror_of_up_beyond_the_end_and_back_too() -> None:
    lags = Lags(0.05, 0.1, 0.1, 0.3)
    up_n, down_n = ringing(1.0).expected_n(lags), ringing(-1.0).expected_n(lags)
    assert up_n + down_n == pytest.approx(np.full(61, 40.0))
    assert up_n[0] == pytest.approx(10.0) and np.max(up_n) > 30.5
    assert up_n[-1] == pytest.approx(30.0, abs=1e-3), "what is settled is what has stayed"


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_beyond_the_end_the_way_goes_on_as_steep_as_there_and_no_more_than_twice_as_steep_as_the_whole(
    way: float,
) -> None:
    assert ringing(way, 1.0)._slope_at_end == pytest.approx(10.0)
    assert 15.0 < ringing(way, 2.0)._slope_at_end < 18.0
    assert ringing(way, 6.0)._slope_at_end == pytest.approx(20.0)


def test_several_steps_at_once_are_each_by_itself() -> None:
    for lags in (Lags(0.05, 0.1), Lags(0.02, 0.2, 0.05), Lags(0.05, 0.1, 0.1, 0.3)):
        alone = [ringing(way).expected_n(lags) for way in (1.0, -1.0, 1.0)]
        together = JoinedSteps([ringing(1.0), ringing(-1.0), ringing(1.0)])
        assert together.expected_n(lags) == pytest.approx(np.concatenate(alone))
        assert len(together.force_n) == 3 * 61


@pytest.mark.parametrize(
    "lags", [(0.1, 0.0), (0.1, 0.05), (0.1, 0.1), (0.1, 0.1 + 1e-6), (0.05, 0.05, 0.4), (0.1, 0.02, 0.9)]
)
def test_nothing_has_arrived_before_the_dead_time_and_all_in_the_end(lags: Any) -> None:
    since_s = np.linspace(-1.0, 5.0, 601)
    share = missing_share(since_s, *lags)
    assert np.all(share[since_s <= 0.0] == 1.0)
    assert abs(share[-1]) < 1e-6
    assert np.max(np.abs(np.diff(share))) < 0.2, "no jump"


def test_lags_that_are_nearly_equal_or_nearly_none_are_those_that_are() -> None:
    since_s = np.linspace(0.0, 1.0, 101)
    for near, exact in (
        ((0.1, 0.1 * (1 + 2e-4)), (0.1, 0.1)),
        ((0.1, 1.001e-3), (0.1, 0.0)),
        ((0.1, 0.05), (0.05, 0.1)),
    ):
        assert missing_share(since_s, *near) == pytest.approx(missing_share(since_s, *exact), abs=0.011)
    assert missing_share(np.array([0.1]), 0.1, 0.0)[0] == pytest.approx(exp(-1.0))
    assert missing_share(np.array([0.1]), 0.1, 0.1)[0] == pytest.approx(2.0 * exp(-1.0))


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_bent_command_map_is_taken_out_of_every_voltage_of_a_step(way: float) -> None:
    """All in volts that the lags are linear in: what is left of one step before, its way, its end and the way back."""
    scale: Any = SimpleNamespace(linear_v=lambda volts: volts**2 / 4.0)
    bent = ringing(way)
    before_v = 2.0 if way > 0.0 else 4.0
    bent = replace(
        bent, changes=((-0.5, before_v - 1.0), (0.0, bent.end_v - before_v)), back_v=-way * bent.back_v + bent.end_v
    )
    straight = _linearize(bent, scale)
    assert straight.changes == ((-0.5, before_v**2 / 4.0 - 0.25), (0.0, (bent.end_v**2 - before_v**2) / 4.0))
    assert straight.end_v == bent.end_v**2 / 4.0
    assert straight.path_v == pytest.approx(bent.path_v**2 / 4.0)
    assert straight.back_v == pytest.approx(np.abs(bent.back_v**2 - bent.end_v**2) / 4.0)
