"""A ladder run fed by hand: which readings count, what a settled stair is, what of the check stops it, what is left out."""

import pytest

from gateway.codes.faults import FaultCode
from gateway.control.inputs import LineStatus
from gateway.control.runs.ladder_run import LadderRow, LadderRun
from gateway.control.runs.ladder_stairs import CalibrationPlan, PlannedStair
from gateway.control.sample_conditioning import Reading, at_time
from gateway.control.supervision.fault_detection import line_words
from gateway.registers.words import CalibrationPhase
from tests.control.bench import bsfm, settings

CHECK, LADDER = CalibrationPhase.CHECK, CalibrationPhase.LADDER


def stair(voltage_v: float, phase: CalibrationPhase = LADDER, direction: int = 1) -> PlannedStair:
    return PlannedStair(voltage_v=voltage_v, direction=direction, phase=phase, group=0)


def run_of(*stairs: PlannedStair) -> LadderRun:
    return LadderRun(CalibrationPlan(), settings(), bsfm(), stairs)


def feed(
    run: LadderRun, begin_s: float, duration_s: float, force_n: float, **reading: bool
) -> tuple[float, list[LadderRow]]:
    """A hundred readings a second of this force; the time behind them, and the rows that ended meanwhile."""
    told = {"is_new": True, "is_usable": True} | reading
    rows: list[LadderRow] = []
    for number in range(round(duration_s * 100)):
        if run.is_done:
            break
        step = run.step(begin_s + 0.01 * number, Reading(cell_n=force_n, contact_n=force_n, **told))
        rows += [step.row] if step.row else []
    return begin_s + duration_s, rows


@pytest.mark.parametrize("reading", [{"is_new": False}, {"is_usable": False}])
def test_a_reading_that_is_old_or_none_counts_for_nothing(reading: dict[str, bool]) -> None:
    run = run_of(stair(4.0))
    now_s, _ = feed(run, 10.0, 2.0, 1.0, **reading)
    assert run.is_waiting
    feed(run, now_s, 2.0, 1.0)
    assert not run.is_waiting and run.rest_n == pytest.approx(1.0)


@pytest.mark.parametrize(("rate_hz", "count"), [(100.0, 21), (50.0, 11), (10.0, 6)])
def test_a_stair_is_judged_by_a_fifth_of_a_second_and_by_six_readings_at_least(rate_hz: float, count: int) -> None:
    """A mean of fewer is more of its noise. A force that climbs on and on never settles."""
    run = run_of(stair(4.0), stair(6.0))
    now_s, _ = feed(run, 10.0, 2.0, 1.0)
    for number in range(round(1.5 * rate_hz)):
        force_n = 1.0 + 6.0 * number / rate_hz
        run.step(now_s + number / rate_hz, Reading(cell_n=force_n, contact_n=force_n, is_new=True, is_usable=True))
    assert run.done == 1 and abs(len(run._window) - count) <= 1


def test_behind_its_last_stair_a_ladder_stands_at_rest() -> None:
    run = run_of(stair(4.0))
    now_s, _ = feed(run, 10.0, 1.0, 0.0)
    _, rows = feed(run, now_s, 4.0, 21.0)
    assert [(row.force_n, row.settled) for row in rows] == [(pytest.approx(21.0), True)]
    step = run.step(20.0, Reading())
    assert run.is_done and step.voltage_v == step.highest_v == 0.0


def test_a_drift_is_the_difference_of_the_means_of_two_halves() -> None:
    run = run_of(stair(4.0))
    run._window.extend((0.01 * number, force_n) for number, force_n in enumerate((1.0, 1.0, 1.0, 3.0, 3.0, 3.0)))
    assert run._drift_n() == 2.0
    run.noise_n = 0.3
    assert run._drift_limit_n() == pytest.approx(2.0 * 0.3 * (4.0 / 6.0) ** 0.5)


def test_a_step_is_as_large_as_the_model_says_from_the_stair_before() -> None:
    run, model = run_of(stair(4.0), stair(6.0), stair(2.0, direction=-1)), bsfm()
    for done, before_v, at_v, way in ((0, 0.0, 4.0, 1.0), (1, 4.0, 6.0, 1.0), (2, 6.0, 2.0, -1.0)):
        run.done = done
        assert run._step_n() == pytest.approx(model.force_n(at_v, way) - model.force_n(before_v, way))


EXPECTED_N = bsfm().force_n(4.0, 1.0) - bsfm().force_n(0.0, 1.0)


@pytest.mark.parametrize("rest_n", [0.0, 100.0, -3.0])
@pytest.mark.parametrize(
    ("rise_n", "fault"),
    [
        (EXPECTED_N, None),
        (0.3 * (EXPECTED_N - 5.0) + 0.1, None),  # of what is beyond friction a third has come
        (0.3 * (EXPECTED_N - 5.0) - 0.1, FaultCode.GAIN_WRONG),
        (2.99 * EXPECTED_N, None),
        (3.01 * EXPECTED_N, FaultCode.GAIN_WRONG),
        (0.05 * EXPECTED_N, FaultCode.NONE),  # no answer at all
        (-0.2 * EXPECTED_N, FaultCode.NONE),
        (-0.31 * EXPECTED_N, FaultCode.SIGN_INVERTED),
    ],
)
def test_a_stair_of_the_check_is_judged_by_its_rise_from_rest(
    rest_n: float, rise_n: float, fault: FaultCode | None
) -> None:
    """Of a rising stair of the check; of any other only that nothing answers it."""
    for judged in (stair(4.0, CHECK), stair(4.0, LADDER), stair(4.0, CHECK, -1)):
        run = run_of(judged)
        run.rest_n = rest_n
        run._check_against_model(LadderRow(judged, rest_n + rise_n, 1.0, True))
        cause = run.stop_cause
        later = FaultCode.NONE if rise_n < 0.1 * EXPECTED_N else None
        assert (cause.fault if cause else None) == (fault if judged == stair(4.0, CHECK) else later)


@pytest.mark.parametrize(
    ("share", "fault"),
    [
        (0.0, None),
        (0.29, None),
        (-0.29, None),
        (-0.31, FaultCode.SIGN_INVERTED),
        (2.99, None),
        (3.01, FaultCode.GAIN_WRONG),
    ],
)
def test_of_a_stair_that_friction_may_hold_whole_only_a_clear_answer_is_judged(
    share: float, fault: FaultCode | None
) -> None:
    volts, _ = bsfm().voltage_v(4.0, 1.0)
    run = run_of(stair(volts, CHECK))
    run._check_against_model(LadderRow(stair(volts, CHECK), share * 4.0, 1.0, True))
    assert (run.stop_cause and run.stop_cause.fault) == fault


@pytest.mark.parametrize(("expected_n", "is_judged"), [(14.9, False), (15.1, True)])
def test_behind_the_check_a_stair_of_little_force_is_not_judged(expected_n: float, is_judged: bool) -> None:
    """A machine of much friction, which has passed the check, gives next to nothing there."""
    volts, _ = bsfm().voltage_v(expected_n, 1.0)
    run = run_of(stair(volts))
    run._check_against_model(LadderRow(stair(volts), 0.0, 1.0, True))
    assert (run.stop_cause is not None) is is_judged


@pytest.mark.parametrize(("was_there", "left_v"), [(True, [2.0]), (False, [2.0, 5.0])])
def test_what_was_too_much_once_is_left_out_and_tried_again_where_it_was_not_reached(
    was_there: bool, left_v: list[float]
) -> None:
    run = run_of(stair(4.0, CHECK), stair(6.0, CHECK), stair(2.0), stair(5.0))
    assert run.leave_out(10.0, 4.0, 0.0, was_there=was_there)
    assert [one.voltage_v for one in run.stairs] == left_v


def test_a_reading_that_is_looked_at_again_is_older_and_not_new() -> None:
    reading = Reading(1.0, 1.0, 0.02, 0.01, True, True, True)
    later = at_time(reading, 0.03, settings().supervision)
    assert later == reading._replace(age_s=pytest.approx(0.05), interval_s=0.0, is_new=False)
    assert not at_time(reading, 100.0, settings().supervision).is_fresh
    assert at_time(reading, -5.0, settings().supervision).age_s == 0.02


def test_a_device_s_own_words_are_told_with_its_fault() -> None:
    line = LineStatus(fault=FaultCode.OUTPUT_REFUSED, said="ERR 7")
    assert line_words(line).endswith("(it says: ERR 7)") and "it says" not in line_words(line._replace(said=""))
