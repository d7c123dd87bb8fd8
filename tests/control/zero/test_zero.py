"""What a zero is made of, by number."""

from dataclasses import replace
from math import nan

import pytest

from gateway.bsfm.model import Response
from gateway.codes.warning_bits import WarningBit
from gateway.control import CalibrationInUse, Controller
from gateway.control.tare import LEAVING_LAGS, Zero
from gateway.registers.words import ControlBit
from tests.control.bench import Bench, bsfm, settings


@pytest.mark.parametrize(("readings", "why"), [(4, "4 usable samples, at least 5 are needed"), (5, "")])
def test_a_zero_is_the_mean_of_five_readings_at_least(readings, why):
    zero = Zero(settings().supervision)
    for _ in range(readings):
        zero.observe(0.1, 0.01)
    assert zero.unsteady(0.0) == why


@pytest.mark.parametrize("share", [0.49, 0.51, -0.51])
def test_a_zero_beyond_half_of_the_saturation_leaves_no_range_to_measure(share):
    supervision = settings().supervision
    zero = Zero(supervision)
    for _ in range(20):
        zero.observe(share * supervision.saturation_n, 0.01)
    assert ("stuck in contact or wrong cell" in zero.unsteady(0.0)) is (abs(share) > 0.5)


@pytest.mark.parametrize(("quantum_n", "allowed_n"), [(0.001, 0.5), (0.1, 0.5), (0.4, 2.0)])
def test_a_zero_may_wander_by_half_a_newton_or_by_five_counts_of_a_coarse_cell(quantum_n, allowed_n):
    """Of a fine cell five counts are less than what warms up or swings on any machine: it could never be tared."""
    for share, why in ((0.95, ""), (1.05, f"allowed {allowed_n:.2f} N")):
        zero = Zero(replace(settings().supervision, sample_quantum_n=quantum_n))
        for reading in range(20):
            zero.observe(share * allowed_n * reading / 19, 0.01)
        assert why in zero.unsteady(0.0) and bool(why) is bool(zero.unsteady(0.0))


def test_of_a_fast_cell_no_sample_of_before_a_gap_is_in_the_zero_behind_it() -> None:
    zero = Zero(settings().supervision)
    zero.observe(20.0, 0.004)
    zero.forget()
    for _ in range(2 * 5):
        zero.observe(1.0, 0.004)
    assert zero.unsteady(0.0) == ""
    zero.take(0.0)
    assert zero.zero_n == 1.0


FAST, SLOW = CalibrationInUse(bsfm(), 1), CalibrationInUse(bsfm(), 2, Response(dead_time_s=1.0, lag_s=0.3))


@pytest.mark.parametrize("swapped_s", [nan, 0.1, 0.5], ids=["at the start", "before it is heard", "behind that"])
def test_what_an_unheard_output_has_pressed_is_waited_for_at_the_pace_of_the_calibration_in_use(swapped_s):
    """A slower one is put to use meanwhile: for a second of dead time 20 N stand as steady as a zero."""
    bench = Bench(delay_s=1.0, lag_s=0.3, noise_n=0.02, force_n=20.0, _pressure=20.0 / 7.4, _cell_n=20.0)
    bench.plant._waiting.extend([20.0 / 7.4] * 1000)
    bench.controller = Controller(bench.settings, FAST if swapped_s > 0.0 else SLOW)
    bench.line = bench.line._replace(acknowledged_v=None)
    for tenth in range(80):
        bench.run(0.1)
        if tenth == 1:
            bench.line = bench.line._replace(acknowledged_v=0.0)
        if tenth == round(10.0 * swapped_s) if swapped_s > 0.0 else False:
            bench.controller.use(SLOW)
        bench.write(control_word=ControlBit.TARE)
        if bench.refused is None:
            break
    assert 2.0 < 0.1 * tenth < 1.0 + LEAVING_LAGS * 1.3 and abs(bench.controller.zero_n) < 1.0


@pytest.mark.parametrize(
    ("silent_s", "is_tared", "lost"),
    [
        (0.4, True, "silent"),
        (0.6, True, "silent"),
        (0.6, True, "saturated"),
        (0.6, True, "under force"),
        (0.6, False, "silent"),
    ],
)
def test_a_tare_of_before_a_silence_of_the_cell_is_doubted_once(silent_s: float, is_tared: bool, lost: str) -> None:
    """It came back with its own zero at 4 N less, an enable was taken, and nobody had been told."""
    bench, cell_n = Bench(), 4.0
    bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n + cell_n)
    bench.run(0.5)
    if is_tared:
        bench.write(control_word=ControlBit.TARE)
    if lost == "under force":
        bench.enable(20.0)
        bench.run(1.0)
    bench.cell_silent = lost != "saturated"
    cell_n = 99.0
    bench.run(silent_s)
    bench.cell_silent, cell_n = False, 0.0
    bench.run(1.0)
    assert bench.last.force_measured_n == pytest.approx(-4.0 if is_tared else 0.0, abs=0.5)
    told = [line for line in bench.events if line.startswith("W253")]
    assert len(told) == (1 if is_tared and silent_s > 0.5 else 0)
    assert all("4.0" in line and f"{silent_s:.1f} s" in line for line in told)
    assert (WarningBit.ZERO_DOUBTED in bench.last.warnings) is bool(told), "a master reads no log"
    if lost != "under force":
        bench.write(control_word=ControlBit.TARE)
        assert bench.last.warnings == WarningBit(0), "the next tare ends it"


def test_a_fast_cell_s_zero_is_the_mean_of_its_readings_and_not_one_of_each_few() -> None:
    """1000 readings a second that swing by 2 N to either side."""
    zero = Zero(settings().supervision)
    for number in range(200):
        zero.observe(10.0 + (-1) ** number * 2.0, 0.001)
    assert zero.unsteady(0.0) == ""
    assert zero.take(0.0) == pytest.approx(10.0)
