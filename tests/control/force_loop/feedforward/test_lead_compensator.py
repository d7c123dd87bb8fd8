"""The lead: off is absent, a push within the limits, sooner at the target, nothing wound up."""

from dataclasses import replace
from math import exp
from random import Random

import pytest

from gateway.control import ControlSettings, LeadSettings, Limits, Trim
from gateway.control.force_loop.lead_compensator import LeadCompensator
from gateway.control.limits import VoltageLimiter
from gateway.control.settings import ResponseSource
from gateway.registers.words import LimitedBy
from tests.control.bench import Bench, settings
from tests.service.rigs import demo
from tests.service.wired import ENABLE, Wired

LIMITS = Limits(force_max_n=50.0, over_force_n=60.0, voltage_max_v=8.0, voltage_slew_v_per_s=100.0)
TWO = LeadSettings(lag_s=0.072, second_lag_s=0.072)
FORMS = [TWO, LeadSettings(lag_s=0.1), LeadSettings(lag_s=0.05, second_lag_s=0.09), LeadSettings(second_lag_s=0.08)]
TICK_S = 0.01


class Loop:
    """LeadCompensator and output stage, and two real lags behind them."""

    def __init__(self, lead: LeadSettings, limits: Limits = LIMITS) -> None:
        self.lead, self.stage = LeadCompensator(lead, limits), VoltageLimiter(limits)
        self.first_v = self.second_v = 0.0
        self.limited_by = LimitedBy.NONE

    def step(self, wanted_v: float, dt_s: float = TICK_S) -> float:
        """The voltage until now acts for dt_s, then the wish is obeyed; returns what the second lag has reached."""
        share, voltage_v = dt_s / 100, self.stage.voltage_v
        for _ in range(100):
            self.first_v += (voltage_v - self.first_v) * share / TWO.lag_s
            self.second_v += (self.first_v - self.second_v) * share / TWO.second_lag_s
        self.stage.earn(dt_s)
        self.lead.advance(voltage_v, dt_s)
        self.limited_by = self.stage.drive(self.lead.compensated_v(wanted_v))
        return self.second_v

    def settled_ticks(self, wanted_v: float, within_v: float = 0.1) -> int:
        outside = [tick for tick in range(200) if abs(self.step(wanted_v) - wanted_v) > within_v]
        return max(outside, default=-1) + 1


def with_lead(**lags: float) -> ControlSettings:
    return replace(settings(), lead=LeadSettings(**lags))


def test_off_equals_absent():
    lead, rng = LeadCompensator(LeadSettings(), LIMITS), Random(1)
    for _ in range(100):
        wanted_v = rng.uniform(-1.0, 10.0)
        lead.advance(rng.uniform(0.0, 8.0), rng.uniform(0.0, 0.02))
        assert lead.compensated_v(wanted_v) == wanted_v
    assert lead.gained_s == 0.0


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("target_v", [0.5, 3.0, 7.9])
def test_a_push_beyond_the_wish_ends_on_the_wish_exactly(form, target_v):
    loop, given = Loop(form), []
    for _ in range(300):
        loop.step(target_v)
        given.append(loop.stage.voltage_v)
    assert target_v < max(given) <= LIMITS.voltage_max_v
    assert given[-1] == target_v
    assert loop.limited_by is LimitedBy.NONE


@pytest.mark.parametrize("seed", range(10))
def test_whatever_is_wished_range_and_slew_hold_and_the_model_knows_what_was_given(seed):
    rng, loop = Random(seed), Loop(TWO)
    for _ in range(60):
        wanted_v = rng.uniform(0.0, 8.0)
        for _ in range(rng.randrange(1, 20)):
            dt_s, last_v = rng.choice([1e-6, 0.001, 0.005, 0.01, 0.02]), loop.stage.voltage_v
            loop.step(wanted_v, dt_s)
            assert 0.0 <= loop.stage.voltage_v <= LIMITS.voltage_max_v
            assert loop.stage.voltage_v - last_v <= LIMITS.voltage_slew_v_per_s * (dt_s + TICK_S) + 1e-9
    assert loop.lead.second_v == pytest.approx(loop.second_v, abs=0.02)


@pytest.mark.parametrize(("from_v", "to_v"), [(0.0, 3.0), (3.0, 5.0), (5.0, 3.0), (7.0, 1.0)])
def test_two_lags_settle_in_less_than_seven_tenths_of_the_time(from_v, to_v):
    took = []
    for form in (LeadSettings(), TWO):
        loop = Loop(form)
        loop.settled_ticks(from_v)
        took.append(loop.settled_ticks(to_v))
    assert took[1] < 0.7 * took[0]


def test_the_response_neither_passes_the_target_nor_depends_on_how_the_lags_are_named():
    loop = Loop(TWO)
    assert max(loop.step(3.0) for _ in range(200)) < 3.06
    one, other = (
        LeadCompensator(LeadSettings(lag_s=a, second_lag_s=b), LIMITS) for a, b in ((0.05, 0.09), (0.09, 0.05))
    )
    assert (one.compensated_v(2.0), one.gained_s) == (other.compensated_v(2.0), other.gained_s)


def test_nothing_winds_up_behind_a_clip_or_a_slow_slew():
    """After long at the limit a step down goes as from rest."""
    slow = replace(LIMITS, voltage_slew_v_per_s=5.0)
    for limits in (LIMITS, slow):
        pushed, rested = Loop(TWO, limits), Loop(TWO, limits)
        pushed.settled_ticks(9.0)  # beyond the range
        rested.settled_ticks(8.0)
        assert pushed.limited_by is LimitedBy.VOLTAGE_RANGE
        assert rested.limited_by is LimitedBy.NONE
        for _ in range(50):
            assert pushed.step(4.0) == pytest.approx(rested.step(4.0), abs=1e-3)


def test_calls_microseconds_apart_change_nothing():
    often, seldom = LeadCompensator(TWO, LIMITS), LeadCompensator(TWO, LIMITS)
    for _ in range(1000):
        often.advance(4.0, 1e-6)
    seldom.advance(4.0, 1e-3)
    assert often.compensated_v(2.0) == pytest.approx(seldom.compensated_v(2.0), abs=1e-9)
    assert often.compensated_v(2.0) == often.compensated_v(2.0)


@pytest.mark.parametrize("second_lag_s", [0.072 * (1 - 1e-5), 0.072 * (1 - 1e-7), 0.0])
def test_the_model_is_exact_for_lags_that_are_nearly_equal_and_for_one(second_lag_s):
    lead = LeadCompensator(LeadSettings(lag_s=0.072, second_lag_s=second_lag_s), LIMITS)
    lead.advance(1.0, 0.072)
    assert lead.second_v == pytest.approx(1.0 - 2.0 / exp(1.0) if second_lag_s else 1.0 - 1.0 / exp(1.0), abs=1e-4)


def test_direct_voltage_and_a_force_of_nothing_are_not_led():
    bench = Bench(with_lead(lag_s=0.08))
    bench.run(0.1)
    bench.voltage(3.0)
    bench.run(1.0)
    assert max(voltage_v for _, voltage_v in bench.voltages()) == 3.0
    bench.voltage(2.0)
    assert bench.last.voltage_v == 2.0
    bench = Bench(with_lead(lag_s=0.08))
    bench.run(0.1)
    bench.enable(0.1)  # below the smallest force
    assert bench.run(0.2).voltage_v == 0.0
    bench.disable()
    assert bench.last.voltage_v == 0.0


def test_on_another_plant_steps_settle_sooner_without_a_fault_and_feedforward_is_reached():
    def bench_with(lag_s: float) -> Bench:
        bench = Bench(replace(with_lead(lag_s=lag_s), trim=Trim()), friction_n=0.0)
        bench.run(0.1)
        bench.enable(20.0)
        bench.run(1.5)
        return bench

    def late_n(bench: Bench) -> float:
        return sum(record.output.force_applied_n - record.force_n for record in bench.history)

    led, plain = bench_with(0.08), bench_with(0.0)
    assert late_n(led) < 0.8 * late_n(plain)
    assert led.last.voltage_v == led.last.feedforward_v
    assert max(voltage_v for _, voltage_v in led.voltages()) > led.last.feedforward_v


# -- the demo rig, with every wire and the twin


TARGETS_N = (10.0, 20.0, 30.0, 40.0, 25.0, 12.0, 5.0, 20.0, 12.0, 15.0, 13.0, 26.0, 24.0)


def course(lead: LeadSettings, seed: int) -> tuple[list[float], float]:
    """(settling times, largest trim) over TARGETS_N; asserts the last 0.3 s of each within 1 N, and no fault."""
    rig = demo()
    by_file = replace(rig.control, lead=lead, response=ResponseSource.RIG)
    wired = Wired(replace(rig, control=by_file), seed=seed).pressing(5.0)
    times_s, trim_v = [], 0.0
    for target_n in TARGETS_N:
        began_s = settled_s = wired.now_s
        wired.write(0, ENABLE, round(100 * target_n))
        for now in wired.samples(1.2):
            trim_v = max(trim_v, abs(now.value("trim")) / 1000.0)
            if abs(now.twin.force_n - target_n) > 1.0:
                settled_s = now.now_s
        times_s.append(settled_s - began_s)
        assert wired.now_s - settled_s > 0.3, target_n
    wired.observer.check(rig)
    assert not wired.fault_code
    return times_s, trim_v


@pytest.mark.sampled
@pytest.mark.parametrize("seed", [1, 2, 7])
def test_the_demo_rig_settles_sooner_and_the_trim_learns_nothing_of_the_push(seed):
    led_s, led_v = course(demo().control.lead, seed)
    plain_s, plain_v = course(LeadSettings(), seed)
    assert sum(led_s) < 0.7 * sum(plain_s)
    assert all(led <= plain + 0.02 for led, plain in zip(led_s, plain_s, strict=True))
    assert led_v < plain_v + 0.05  # less than half a newton
