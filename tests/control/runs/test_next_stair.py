"""What a ladder takes along to its next stair and what it leaves behind; what counts as rest; what is left out of it."""

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.control.runs.blind_time import UNKNOWN_BLIND_S, Trace
from gateway.control.runs.ladder_run import WINDOW_S, LadderRun
from gateway.control.sample_conditioning import Reading
from tests.control.runs.test_ladder_by_hand import CHECK, feed, run_of, stair


@pytest.mark.parametrize(
    ("swing_n", "drift_n", "is_still"), [(0.5, 0.26, True), (0.5, 0.31, False), (0.0, 0.029, True), (0.0, 0.031, False)]
)
def test_rest_is_where_the_halves_differ_by_no_more_than_neighbours_do(
    swing_n: float, drift_n: float, is_still: bool
) -> None:
    """Neighbours that differ by 1 N are noise of 0.71 N: of 100 readings it makes the halves differ by 0.28 N at two sigmas.
    Of a quiet cell 0.03 N are no drift."""
    run = run_of(stair(4.0))
    run._window.extend((0.01 * k, swing_n * (-1) ** k + drift_n * (k >= 50)) for k in range(100))
    assert run._is_still() is is_still


class Paced:
    """A pace that is known from the third stair on, and keeps what it was told of each."""

    def __init__(self) -> None:
        self.told: list[tuple[Trace, float, float]] = []

    @property
    def is_known(self) -> bool:
        return len(self.told) >= 3

    def observe(self, trace: Trace, from_n: float, to_n: float, _noise_n: float) -> None:
        self.told.append((list(trace), from_n, to_n))

    def blind_s(self, _step_n: float, _noise_n: float) -> float:
        return UNKNOWN_BLIND_S


def paced(*stairs_v: float, ramp_s: float = 0.0) -> tuple[LadderRun, Paced]:
    """A check of these stairs at known rest. ramp_s: along which a stair is gone to, as on a plant that rings."""
    run = run_of(*(stair(voltage_v, CHECK) for voltage_v in stairs_v))
    feed(run, 0.0, 0.61, 0.0)
    assert not run.is_waiting
    told, approach = (
        Paced(),
        SimpleNamespace(ramp_s=ramp_s, share=lambda s: min(1.0, s / ramp_s), observe=lambda *_: None),
    )
    changed: Any = run
    changed._pace, changed._approach, changed._check_against_model = told, approach, lambda row: None
    return run, told


def test_of_each_stair_of_the_check_its_own_readings_are_told_from_the_force_before_it() -> None:
    run, told = paced(4.0, 5.0, 6.0, 7.0)
    now_s = 0.7
    for force_n in (20.0, 30.0, 40.0, 50.0):
        done = run.done
        while run.done == done:
            now_s, _ = feed(run, now_s, 0.01, force_n)
    assert [(from_n, to_n) for _, from_n, to_n in told.told] == [(0.0, 20.0), (20.0, 30.0), (30.0, 40.0)]
    for trace, _, to_n in told.told:
        assert [at_s for at_s, _ in trace] == sorted(at_s for at_s, _ in trace)
        assert trace[0][0] < 0.11 and {force_n for _, force_n in trace} == {to_n}


@pytest.mark.parametrize("voltage_v", [4.0, 5.0])
def test_a_stair_has_its_whole_time_though_another_was_left_out_before_it(voltage_v: float) -> None:
    """Time and readings of the one that was too much are none of the next one's."""
    run, told = paced(4.0, 2.0)
    now_s, rows = feed(run, 0.7, 0.5, 30.0)
    assert not rows and run.leave_out(now_s, 4.0, 4.0, was_there=True)
    _, rows = feed(run, now_s, UNKNOWN_BLIND_S + 0.5 * WINDOW_S, voltage_v)
    assert not rows, "its transient may not be over"
    _, rows = feed(run, now_s + UNKNOWN_BLIND_S + 0.5 * WINDOW_S, WINDOW_S, voltage_v)
    assert [row.force_n for row in rows] == [pytest.approx(voltage_v)]
    ((trace, _, _),) = told.told
    assert [at_s for at_s, _ in trace] == sorted(at_s for at_s, _ in trace) and trace[0][1] == voltage_v


def output_v(run: LadderRun, now_s: float) -> float:
    return run.step(now_s, Reading(cell_n=20.0, contact_n=20.0, is_new=True, is_usable=True)).voltage_v


def test_a_ramp_begins_at_the_stair_before() -> None:
    run, _ = paced(4.0, 5.0, ramp_s=0.5)
    now_s, climb_v = 0.61, [0.0]
    while run.done < 2:
        climb_v.append(output_v(run, now_s))
        now_s += 0.01
    assert climb_v.pop() == 0.0 and climb_v == sorted(climb_v) and climb_v[-1] == 5.0
    assert max(later - earlier for earlier, later in pairwise(climb_v)) < 0.2


def test_a_ramp_to_the_next_stair_begins_where_the_one_that_is_left_out_was_ended() -> None:
    run, _ = paced(4.0, 3.0, ramp_s=1.0)
    half_way_v = [output_v(run, 0.6 + 0.01 * k) for k in range(50)][-1]
    assert 1.0 < half_way_v < 3.0
    assert run.leave_out(1.1, 4.0, half_way_v, was_there=False)
    assert output_v(run, 1.1) == pytest.approx(half_way_v)


@pytest.mark.parametrize(("was_there", "left_v"), [(True, [2.0, 1.0]), (False, [1.0, 6.0])])
def test_a_falling_stair_that_nobody_would_fall_to_is_left_out_with_those_above(
    was_there: bool, left_v: list[float]
) -> None:
    """At the beginning the output is at rest: 2 V are climbed to then, and would be measured on the wrong branch."""
    run = run_of(stair(4.0, CHECK), stair(2.0, CHECK, -1), stair(1.0, CHECK), stair(6.0))
    assert run.leave_out(1.0, 4.0, 0.0, was_there=was_there)
    assert [one.voltage_v for one in run.stairs] == left_v


def test_behind_its_last_stair_a_ladder_asks_for_rest_however_often_it_is_asked() -> None:
    run, _ = paced(4.0)
    now_s, _ = feed(run, 0.7, 3.0, 20.0)
    assert run.is_done
    for k in range(3):
        step = run.step(now_s + 0.01 * k, Reading(cell_n=20.0, contact_n=20.0, is_new=True, is_usable=True))
        assert (step.voltage_v, step.stair_v, step.progress, step.eta_s) == (0.0, 0.0, 1.0, 0.0)
        assert step.phase is CHECK


def test_a_ladder_without_stairs_is_done_once_it_knows_rest_and_has_no_branch() -> None:
    """As before an experiment that wants no check."""
    run = run_of()
    now_s, seen_v = 0.0, set[float]()
    while run.is_waiting:
        seen_v.add(output_v(run, now_s))
        now_s += 0.01
    assert seen_v == {0.0} and run.is_done
    assert (run.rest_n, run.branch_share, run.eta_s) == (20.0, 1.0, 0.0)


def test_a_step_that_tells_the_response_is_made_at_once_where_other_stairs_are_ramped_to() -> None:
    for is_step, out_v in ((False, 0.0), (True, 5.0)):
        run, _ = paced(5.0, ramp_s=1e9)
        run.stairs = tuple(replace(one, is_step=is_step) for one in run.stairs)
        feed(run, 1.0, 0.1, 0.0)
        assert run.step(1.2, Reading()).voltage_v == pytest.approx(out_v, abs=1e-6)


def test_of_a_slow_cell_no_reading_of_the_transient_is_in_its_stair() -> None:
    """Six readings a window, of 10 a second: what noise would pass for rest had the force of before in its mean."""
    run = run_of(stair(4.0))
    begin_s, _ = feed(run, 0.0, 0.61, 0.0)
    run.noise_n = 50.0
    for k in range(1, 20):
        force_n = 0.0 if 0.1 * k < UNKNOWN_BLIND_S - 0.05 else 21.0
        if (row := run.step(begin_s + 0.1 * k, Reading(force_n, force_n, is_new=True, is_usable=True)).row) is not None:
            break
    assert row is not None and row.settled and row.force_n == pytest.approx(21.0)
