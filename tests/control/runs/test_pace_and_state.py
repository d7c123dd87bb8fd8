"""How long a stair takes, by numbers; what the run that is conducted says of itself from its beginning to behind its end."""

from dataclasses import replace
from math import log
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.codes.faults import FaultCode
from gateway.control import LineStatus
from gateway.control.runs.active_run import ActiveRun
from gateway.control.runs.blind_time import (
    FOLD,
    LONGEST_BLIND_S,
    SHORTEST_BLIND_S,
    UNKNOWN_BLIND_S,
    BlindTime,
    Trace,
)
from gateway.control.runs.ladder_run import GUESSED_DWELL_S, ZERO_S, LadderRun
from gateway.control.runs.stair_approach import PEAKS, StairApproach
from gateway.control.sample_conditioning import Reading
from gateway.control.self_test.items import SelfTestPlan
from gateway.control.settings import SelfTestSettings
from gateway.registers.words import CalibrationPhase, SelfTestResult
from tests.control.bench import bsfm, settings
from tests.control.runs.test_experiment import SHORT as EXPERIMENT
from tests.control.runs.test_ladder_run import SHORT

RIG = replace(settings(), self_test=SelfTestSettings())
READING = Reading(1.5, 1.5, 0.0, 0.01, True, True, True)


def straight(way_n: float, seconds: float = 1.0, from_n: float = 0.0) -> Trace:
    return [(seconds * k / 10.0, from_n + way_n * k / 10.0) for k in range(11)]


def paced(*seconds: float, way_n: float = 10.0) -> BlindTime:
    pace = BlindTime()
    for one in seconds:
        pace.observe(straight(way_n, one, 5.0), 5.0, 5.0 + way_n, 0.0)
    return pace


@pytest.mark.parametrize("way_n", [10.0, -10.0])
def test_a_pace_is_known_from_three_stairs_and_is_that_of_the_middle_one(way_n: float) -> None:
    assert not paced(1.0, 1.0, way_n=way_n).is_known and paced(1.0, 1.0).blind_s(7.0, 0.0) == UNKNOWN_BLIND_S
    pace = paced(0.5, 9.0, 1.0, way_n=way_n)
    assert pace.is_known
    assert pace.blind_s(7.0, 0.0) == pytest.approx(0.1 + 0.8 * (1.0 + FOLD * log(10.0)))
    assert pace.blind_s(-7.0, 0.0) == pace.blind_s(7.0, 0.0)
    assert pace.blind_s(7.0, 0.35) == pytest.approx(0.1 + 0.8 * (1.0 + FOLD * log(5.0))), "noise hides what is left"
    assert pace.blind_s(0.5, 0.0) == pytest.approx(0.9), "a tenth of so small a step is nothing"


def test_no_pace_is_shorter_or_longer_than_is_believed() -> None:
    assert paced(0.01, 0.01, 0.01).blind_s(1.0, 0.0) == SHORTEST_BLIND_S
    assert paced(9.0, 9.0, 9.0).blind_s(1.0, 0.0) == LONGEST_BLIND_S


@pytest.mark.parametrize(
    ("way_n", "noise_n", "counts"), [(3.0, 0.0, True), (2.9, 0.0, False), (4.0, 0.4, True), (4.0, 0.41, False)]
)
def test_only_a_step_that_stands_out_tells_a_pace(way_n: float, noise_n: float, counts: bool) -> None:
    pace = BlindTime()
    for _ in range(3):
        pace.observe(straight(way_n), 0.0, way_n, noise_n)
    assert pace.is_known is counts


def test_a_level_is_passed_between_two_readings_and_one_that_never_is_at_the_end() -> None:
    pace = BlindTime()
    for _ in range(3):
        pace.observe([(0.0, 0.0), (1.0, 4.0), (2.0, 4.0), (3.0, 8.0)], 0.0, 10.0, 0.0)
    assert pace.blind_s(0.5, 0.0) == pytest.approx(LONGEST_BLIND_S), "0.25 s, and 2.75 s to the end"
    flat = BlindTime()
    for _ in range(3):
        flat.observe([(0.5, 10.0), (1.0, 10.0)], 0.0, 10.0, 0.0)
    assert flat.blind_s(0.5, 0.0) == 0.5, "passed at the first reading"


def rung(*peaks_n: float, noise_n: float = 0.0) -> StairApproach:
    approach = StairApproach()
    for peak_n in peaks_n:
        trace = [(0.1 * k, min(10.0, 2.0 * k)) for k in range(6)]
        trace += [(0.6, 10.0 + peak_n), (0.7, 10.0 + peak_n), (0.8, 10.0 + peak_n), (0.9, 10.0), (1.0, 10.0)]
        approach.observe(trace, 0.0, 10.0, noise_n)
    return approach


@pytest.mark.parametrize(
    ("peaks_n", "noise_n", "rings"),
    [((1.0,), 0.0, False), ((1.0, 1.0), 0.0, True), ((1.0, 1.0, 0.0, 0.0), 0.0, False), ((1.0, 1.0, 0.0), 0.0, True),
     ((0.29, 0.29), 0.0, False), ((0.31, 0.31), 0.0, True), ((1.0, 1.0), 0.26, False), ((1.0, 1.0), 0.24, True)],
)  # fmt: skip
def test_a_plant_rings_where_most_stairs_do_by_more_than_noise(
    peaks_n: tuple[float, ...], noise_n: float, rings: bool
) -> None:
    assert rung(*peaks_n, noise_n=noise_n).ramp_s == (pytest.approx(PEAKS * 0.6) if rings else 0.0)


def test_a_ramp_is_a_parabola_that_ends_flat() -> None:
    approach = rung(1.0, 1.0)
    shares = [approach.share(part * approach.ramp_s) for part in (0.0, 0.25, 0.5, 1.0, 2.0)]
    assert shares == pytest.approx([0.0, 1.0 - 0.75**2, 0.75, 1.0, 1.0])


def begun(plan: Any = SHORT, *, is_local: bool = False) -> ActiveRun:
    active = ActiveRun(RIG, bsfm())
    active.begin(plan, is_local=is_local)
    return active


def test_a_run_begins_with_its_zero_and_nothing_of_the_one_before() -> None:
    active = begun(is_local=True)
    active.last_row, active.progress, active.target_n = "row", 0.7, 9.0  # type: ignore[assignment]
    active.ask_stop("gone")
    active.begin(SHORT, is_local=False)
    assert (active.phase, active.progress, active.last_row, active.target_n) == (CalibrationPhase.ZERO, 0.0, None, 0.0)
    assert not active.is_local and active.running and active.eta_s > ZERO_S
    loop = SimpleNamespace(voltage_v=0.0, drive_run=lambda *_: None)
    assert active.step(1.0, READING, loop, LineStatus()) is None, "the stop was for the other one"  # type: ignore[arg-type]
    assert active.cell_n == 1.5


def test_the_force_that_a_run_goes_for_is_told_by_the_model_that_it_began_with() -> None:
    active, loop = begun(), SimpleNamespace(voltage_v=0.0, drive_run=lambda *_: None)
    active.use(bsfm(2.0))
    for k in range(200):
        active.step(0.01 * k, READING, loop, LineStatus())  # type: ignore[arg-type]
        if active.has_risen:
            break
    assert active.run is not None
    volts = active.run.stairs[0].voltage_v  # type: ignore[union-attr]
    assert active.target_n == pytest.approx(bsfm().force_n(volts, 1.0))


def test_a_run_that_is_asked_for_is_taken_once_and_forgets_a_refusal() -> None:
    active = ActiveRun(RIG, bsfm())
    active.refused, active.phase = "W305 no", CalibrationPhase.STOPPED
    assert isinstance(active.ask(SHORT), LadderRun)
    assert (active.refused, active.phase) == ("", CalibrationPhase.IDLE)
    assert active.take_asked() is SHORT and active.take_asked() is None
    active.refused, active.message = "W305 no", "A350"
    assert (active.take_refused(), active.take_refused()) == ("W305 no", "")
    assert (active.take_message(), active.take_message()) == ("A350", "")


def test_behind_its_end_a_run_has_nothing_left_and_is_local_until_the_output_is_off() -> None:
    active = begun(is_local=True)
    active.target_n = 12.0
    active.end()
    assert (active.run, active.eta_s, active.target_n, active.phase) == (None, 0.0, 0.0, CalibrationPhase.STOPPED)
    assert active.is_local
    active.rest()
    assert not active.is_local


def test_each_self_test_has_its_number_and_its_report_is_told_once() -> None:
    active = ActiveRun(RIG, bsfm())
    for number in (1, 2):
        active.begin(SelfTestPlan(), is_local=False)
        assert (active.self_test.number, active.self_test.result) == (number, SelfTestResult.RUNNING)
        assert active.phase is CalibrationPhase.SELF_TEST and active.recorded is None and active.kind == "self-test"
        active.end(FaultCode.CELL_LOST)
        assert active.self_test.number == number and active.self_test.result is not SelfTestResult.RUNNING
        assert active.take_report() and active.take_report() == ()


def test_what_has_the_output_is_named_with_how_far_it_is() -> None:
    assert begun().what == "a calibration (zero, 0%)" and begun().kind == "calibration"
    assert begun(EXPERIMENT).what == "experiment a plan (zero, 0%)"
    assert begun(SelfTestPlan()).what == "a self-test (0%)"
    assert begun().recorded is not None


def test_the_fit_of_a_ladder_keeps_the_next_run_waiting() -> None:
    active = ActiveRun(RIG, bsfm())
    assert not active.is_busy
    active.phase = CalibrationPhase.FITTING
    assert active.is_busy and not active.running and begun().is_busy


def test_the_time_left_is_that_of_the_stairs_so_far() -> None:
    run = LadderRun(SHORT, RIG, bsfm())
    count = len(run.stairs)
    assert run.eta_s == pytest.approx(ZERO_S + GUESSED_DWELL_S * count)
    run._stair_s, run.done, run._dwelt_s = 5.0, 4, 8.0
    assert run.eta_s == pytest.approx(2.0 * (count - 4))
