"""A measured response goes where it was measured, and nowhere else; a rig file may rule instead."""

from dataclasses import replace

from gateway.control.settings import ResponseSource
from tests.service.rigs import demo
from tests.service.wired import ENABLE, Wired

TARGETS_N = (10.0, 25.0, 15.0, 35.0)


def settled_s(wired: Wired) -> list[float]:
    """Of each step: until the true force stays within 0.5 N."""
    times_s = []
    wired.pressing(5.0)
    for target_n in TARGETS_N:
        began_s = last_s = wired.now_s
        wired.write(0, ENABLE, round(100 * target_n))
        for now in wired.samples(1.0):
            if abs(now.twin.force_n - target_n) > 0.5:
                last_s = now.now_s
        times_s.append(last_s - began_s)
    wired.observer.check(wired.rig)
    assert not wired.fault_code
    return times_s


def test_a_response_is_used_on_the_rig_that_it_was_measured_on_and_on_no_other() -> None:
    rig, shipped = demo(), demo().calibration
    assert shipped.response
    assert rig.response_of(shipped) is shipped.response
    assert replace(rig, simulated=False).response_of(shipped) is None
    assert replace(rig, name="other").response_of(replace(shipped, rig="demo")) is None
    assert replace(rig, name="other").response_of(replace(shipped, rig="other")) is shipped.response


def test_the_noise_that_a_calibration_measured_counts_on_its_own_rig() -> None:
    rig = demo()
    shipped = replace(rig.calibration, noise_n=0.12)
    assert rig.calibration_in_use(shipped).noise_n == 0.12
    assert replace(rig, simulated=False).calibration_in_use(shipped).noise_n == 0.0


def test_the_shipped_response_is_that_of_the_twin_and_the_wires() -> None:
    response, plant = demo().calibration.response, demo().plant
    assert response
    assert plant
    late_s = response.dead_time_s - plant.regulator.delay_s - plant.cell.filter_s
    assert 0.0 < late_s < 0.02
    assert abs(response.lag_s - plant.regulator.lag_s) < 0.003
    assert abs(response.second_lag_s - plant.regulator.second_lag_s) < 0.003


def test_by_the_measured_response_steps_settle_no_later_than_by_the_rig_file() -> None:
    """Over three machines: one step in ten ends so near the band's edge that noise takes it over once more."""
    rig = demo()
    by_file = replace(rig, control=replace(rig.control, response=ResponseSource.RIG))
    measured, filed = (
        [step for seed in (7, 8, 9) for step in settled_s(Wired(one, seed=seed))] for one in (rig, by_file)
    )
    assert max(measured) < 0.45
    assert sum(step > 0.3 for step in measured) <= 2
    assert sum(measured) <= 0.85 * sum(filed)
