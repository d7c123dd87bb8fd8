"""A machine that answers late, and a load cell without noise: it repeats itself until the force comes, and from then on again.
No such cell is called frozen, and one that is frozen is found."""

from collections.abc import Iterable

import pytest

from gateway.bsfm.model import Response
from gateway.codes.faults import FaultCode
from gateway.control import CalibrationInUse
from gateway.control.sample_conditioning import Reading
from gateway.control.supervision.plausibility import ExpectedForce
from gateway.control.supervision.stuck_sensor import StuckSensorCheck
from tests.control.bench import Bench, bsfm, has_fault, settings

STEPS_N = (12.0, 40.0, 10.0, 35.0, 15.0, 45.0)
LATE = [(0.08, 0.09), (0.2, 0.09), (0.3, 0.09), (0.4, 0.05), (0.4, 0.2)]


def late_machine(delay_s: float, lag_s: float) -> Bench:
    """The bench with this dead time; its calibration has measured both."""
    bench = Bench(noise_n=0.0, delay_s=delay_s)
    bench.controller.use(CalibrationInUse(bsfm(), 2, Response(dead_time_s=delay_s + 0.01, lag_s=lag_s)))
    bench.run(0.3)
    bench.enable(STEPS_N[0])
    return bench


@pytest.mark.sampled
@pytest.mark.parametrize(("delay_s", "lag_s"), LATE)
@pytest.mark.parametrize("hold_s", [1.5, 4.0])
def test_no_cell_of_a_late_machine_is_called_frozen(delay_s: float, lag_s: float, hold_s: float) -> None:
    """The model, one lag as long as dead time and lags together, moved on when the machine had long arrived: A312 in a step."""
    bench = late_machine(delay_s, lag_s)
    for force_n in STEPS_N:
        bench.force(force_n)
        bench.run(hold_s)
        assert bench.last.fault is FaultCode.NONE, force_n
    assert bench.last.force_measured_n > 40.0


@pytest.mark.parametrize(("delay_s", "lag_s"), LATE)
def test_a_cell_of_a_late_machine_that_freezes_is_found_in_the_next_step(delay_s: float, lag_s: float) -> None:
    bench = late_machine(delay_s, lag_s)
    bench.run(4.0)
    bench.cell_frozen = True
    bench.force(40.0)
    found_s = bench.seconds_until(has_fault(FaultCode.SAMPLE_FROZEN), 3.0)
    assert found_s < 1.0 + 2.0 * (delay_s + lag_s)


def watched(volts: Iterable[float], lag_s: float, *, lacks_air: bool = False) -> list[str]:
    """What the check says of a cell that repeats 12 N in contact, while these voltages stand for a sample each."""
    check, response = StuckSensorCheck(settings().supervision), ExpectedForce(bsfm(), lag_s, 0.0, stands_v=2.0)
    response.note_around(0.0, lacks_air=lacks_air)
    reading, words = Reading(12.0, 12.0, 0.0, 0.01, True, True, True, False, 12.0), []
    for voltage_v in volts:
        response.advance(voltage_v, 0.01)
        check.observe(reading, response, True)
        words.append(check.words)
    return words


@pytest.mark.parametrize("lag_s", [0.02, 0.5])
def test_a_cell_has_the_time_of_its_machine_to_move_and_never_less_than_0_3_s(lag_s: float) -> None:
    words = watched([2.0] * 150 + [6.0] * 150, lag_s)
    found_s = 0.01 * (words.index(next(filter(None, words))) - 149)
    assert max(0.3, lag_s) - 1e-9 <= found_s < max(0.3, lag_s) + 0.3


def test_a_value_that_has_only_just_come_may_stay_for_half_a_second_whatever_the_voltage_does() -> None:
    words = watched([2.0] * 10 + [6.0] * 150, 0.02)
    assert settings().supervision.frozen_s == 0.5
    assert 49 <= words.index(next(filter(None, words))) <= 52


def test_a_push_that_is_over_before_the_machine_answers_need_not_move_it() -> None:
    assert not any(watched([2.0] * 150 + [6.0] * 3 + [2.0] * 150, 0.5))


def test_without_air_a_cell_may_repeat_itself_however_high_the_voltage_is() -> None:
    assert not any(watched([2.0] * 150 + [6.0] * 150, 0.02, lacks_air=True))
