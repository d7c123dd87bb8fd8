"""What a study says of its runs: over all seeds, by the true force, and no better than it is."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gateway.codes.faults import FaultCode
from gateway.control import NO_COMPENSATION
from gateway.defaults import TICK_S
from gateway.service.closed_loop.simulated_run import SimulatedLoop, SimulatedRun, _settling_time_s
from gateway.service.closed_loop.study import _ratios, _reach_n, _summarize, answer_sentence, format_gain
from gateway.twin.surroundings import Surroundings

BEFORE = [
    SimulatedRun(np.array([3.0, -3.0]), (0.4, 0.8), ""),
    SimulatedRun(np.array([1.0, -5.0]), (0.8, 0.8), "over_force"),
]
AFTER = [SimulatedRun(0.5 * run.error_n, (0.1, 0.3), fault) for run, fault in zip(BEFORE, ("", "stale"), strict=True)]


def test_a_summary_is_of_all_runs_of_both_kinds() -> None:
    gain = _summarize(BEFORE, AFTER, (0, 1), NO_COMPENSATION, ("noted",))
    assert (gain.before_rms_n, gain.after_rms_n) == (pytest.approx(np.sqrt(11.0)), pytest.approx(np.sqrt(11.0) / 2.0))
    assert (gain.before_max_n, gain.after_max_n) == (5.0, 2.5), "a force that is short is an error, too"
    assert (gain.before_settled_s, gain.after_settled_s) == (pytest.approx(0.7), pytest.approx(0.2))
    assert gain.rms_ratio == pytest.approx(0.5) and gain.rms_ratio_ci95 == (pytest.approx(0.5), pytest.approx(0.5))
    assert (gain.before_faults, gain.after_faults) == (("over_force",), ("stale",))
    lines = format_gain(gain)
    assert "makes it better" in lines[0] and lines[-1] == "noted"
    assert "stopped by supervision: 1 of 2 runs before (over_force)" in lines
    assert "stopped by supervision: 1 of 2 runs after (stale)" in lines


def test_what_may_as_well_be_nothing_is_called_nothing_certain() -> None:
    mixed = [AFTER[0], SimulatedRun(3.0 * BEFORE[1].error_n, (0.1,), "")]
    gain = _summarize(BEFORE, mixed, (0, 1), NO_COMPENSATION, ())
    low, high = gain.rms_ratio_ci95
    assert low < 1.0 < high and "gains nothing certain" in answer_sentence(gain)
    assert "makes it worse" in answer_sentence(_summarize(AFTER, BEFORE, (0, 1), NO_COMPENSATION, ()))


def test_a_ratio_is_one_of_forces_and_both_runs_of_a_seed_stay_together() -> None:
    squares = np.array([[1.0, 100.0], [4.0, 400.0]])
    assert _ratios(squares) == pytest.approx(np.full(4000, 2.0))


@pytest.mark.parametrize(
    ("away_n", "ticks"),
    [([0.5, -0.5], 0), ([3.0, 0.5, 0.5], 1), ([3.0, 0.5, -2.0, 0.5], 3), ([3.0, 0.5, 0.5, -2.0], 4)],
)
def test_a_step_has_settled_when_it_leaves_the_band_no_more(away_n: list[float], ticks: int) -> None:
    assert _settling_time_s(away_n) == pytest.approx(ticks * TICK_S)


def test_a_schedule_goes_no_further_than_the_rig_and_each_model() -> None:
    settings: Any = SimpleNamespace(limits=SimpleNamespace(force_max_n=30.0))
    large: Any = SimpleNamespace(force_range_n=(0.0, 100.0))
    small: Any = SimpleNamespace(force_range_n=(0.0, 20.0))
    assert _reach_n(settings, [large, large]) == 30.0
    assert _reach_n(settings, [large, small]) == _reach_n(settings, [small, large]) == pytest.approx(0.92 * 20.0)


def test_the_first_fault_is_the_one_that_stopped_a_run() -> None:
    outputs = iter([FaultCode.NONE, FaultCode.SAMPLE_STALE, FaultCode.OVER_FORCE, FaultCode.NONE])
    loop: Any = SimulatedLoop.__new__(SimulatedLoop)
    loop.fault, loop._voltage_v, loop._command, loop._sample, loop._line = "", 0.0, None, None, None
    loop._controller = SimpleNamespace(step=lambda *_: SimpleNamespace(voltage_v=0.0, fault=next(outputs)))
    for _ in range(4):
        loop._step(0.0)
    assert loop.fault == "sample_stale"


def test_control_is_told_what_it_has_an_input_for_and_the_plant_feels_all() -> None:
    around, felt = Surroundings(temperature_c=31.0, feed_mm_s=5.0, tilt_deg=90.0), list[Surroundings]()
    for inputs in (frozenset[str](), frozenset({"temperature_c", "tilt_deg"})):
        loop: Any = SimulatedLoop.__new__(SimulatedLoop)
        loop._inputs, loop._twin = inputs, SimpleNamespace(set_surroundings=felt.append)
        tilt_rad = loop._surround(around)
        assert tilt_rad == (pytest.approx(0.5 * np.pi) if inputs else 0.0)
        assert np.isnan(loop._line.feed_mm_s) and np.isnan(loop._line.temperature_c) == (not inputs)
    assert felt == [around, around]
