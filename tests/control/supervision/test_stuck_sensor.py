"""A load cell that repeats one value while its frames go on: found within 2 s where its noise says that it should move, and
no cell that lives is called dead. Noise in counts: the standard deviation over the quantum."""

from math import erf, inf, sqrt
from random import Random

import pytest

from gateway.codes.faults import FaultCode
from gateway.control import Supervision
from gateway.control.sample_conditioning import Reading
from gateway.control.supervision.plausibility import ExpectedForce
from gateway.control.supervision.repeated_readings import RepeatedReadings, power
from gateway.control.supervision.stuck_sensor import StuckSensorCheck
from gateway.registers.words import State
from tests.control.bench import Bench, bsfm, has_fault

QUANTUM_N = 0.098
HOURS = 10_000.0
COUNTS = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0)


def within(low: float, high: float, counts: float) -> float:
    """Share of normal noise between two bounds."""
    return 0.5 * (erf(high / counts / sqrt(2.0)) - erf(low / counts / sqrt(2.0)))


class Cell:
    """A converter: noise about a force that wanders by a count and more, or holds its last value."""

    def __init__(self, counts: float, seed: int, rate_hz: float = 100.0, filtered: float = 0.0, sent: int = 1) -> None:
        self.counts, self.rate_hz, self.frozen = counts, rate_hz, False
        self._rng, self._filtered, self._sent = Random(seed), filtered, sent
        self._at, self._noise, self._value, self._k = 100.0 + self._rng.random(), 0.0, 0.0, 0

    def value_n(self) -> float:
        self._k += 1
        if not self.frozen and self._k % self._sent == 0:
            self._at += self._rng.gauss(0.0, 0.1 / sqrt(self.rate_hz))
            fresh = self._rng.gauss(0.0, sqrt(1.0 - self._filtered**2))
            self._noise = self._filtered * self._noise + fresh
            self._value = round(self._at + self.counts * self._noise) * QUANTUM_N
        return self._value


class Watched:
    """A watch of its own under a force that does not change."""

    def __init__(self, **supervision: object) -> None:
        self.watch = StuckSensorCheck(Supervision(**supervision))  # type: ignore[arg-type]
        self._response = ExpectedForce(bsfm(), 0.1, 0.0)

    def after(self, cell: Cell, seconds: float, touching: bool = True) -> float:
        """Seconds until the cell is called frozen, inf where it is not."""
        interval_s = 1.0 / cell.rate_hz
        for k in range(round(seconds * cell.rate_hz)):
            value_n = cell.value_n()
            reading = Reading(value_n, value_n, 0.0, interval_s, True, True, True, False, value_n)
            self.watch.observe(reading, self._response, touching)
            if self.watch.is_frozen:
                return (k + 1) * interval_s
        return inf


@pytest.mark.parametrize("counts", [0.2 + 0.02 * k for k in range(400)][::13])
def test_normal_noise_stays_in_one_count_less_often_than_the_bound_says(counts: float) -> None:
    stays = within(-0.5, 0.5, counts)
    for k in range(11):
        share = within(-1.5 + 0.1 * k, 0.5 + 0.1 * k, counts)  # the two counts of a window, wherever the force lies
        if share >= within(-1.0, 1.0, counts) - 1e-9 or k == 0 or k == 10:
            assert stays <= share ** power(share) + 2e-3, (counts, k)


def test_a_frozen_cell_is_found_within_2_s_while_holding() -> None:
    bench = Bench(seed=3, noise_n=0.12)
    bench.run(1.0)
    bench.enable(12.0)
    bench.run(6.0)
    assert bench.last.state is State.HOLDING
    bench.cell_frozen = True
    assert 0.45 <= bench.seconds_until(has_fault(FaultCode.SAMPLE_FROZEN), 3.0) <= 2.0
    assert bench.voltage_v == 0.0
    (sentence,) = (event for event in bench.events if event.startswith("A312"))
    assert "bit for bit, while its noise has left at most" in sentence
    assert "N repeated for 0." in sentence


@pytest.mark.parametrize(
    ("rate_hz", "counts"),  # 20 samples of less noise are equal more often than once in 10 000 h
    [(100.0, 0.7), (100.0, 1.0), (100.0, 2.0), (100.0, 30.0), (10.0, 2.0), (10.0, 3.0), (10.0, 30.0)],
)
def test_where_the_noise_says_so_2_s_of_equal_samples_are_enough(counts: float, rate_hz: float) -> None:
    watched, cell = Watched(), Cell(counts, seed=5, rate_hz=rate_hz)
    assert watched.after(cell, 1500.0 / rate_hz) == inf
    cell.frozen = True
    assert 0.45 <= watched.after(cell, 5.0) <= 2.0


@pytest.mark.parametrize("counts", [0.01, 0.05, 0.1, 0.2])
def test_noise_far_below_a_count_tells_nothing(counts: float) -> None:
    watched, cell = Watched(), Cell(counts, seed=6)
    assert watched.after(cell, 60.0) == inf
    cell.frozen = True
    assert watched.after(cell, 60.0) == inf


@pytest.mark.parametrize("rate_hz", [100.0, 10.0])
def test_less_than_one_false_alarm_in_10_000_hours(rate_hz: float, budget: int) -> None:
    """The limits are learned from a seeded cell; how often normal noise reaches them, at its worst place, is exact."""
    alarms = 0.0
    for counts in COUNTS:
        noise, cell = RepeatedReadings(), Cell(counts, seed=round(100 * counts), rate_hz=rate_hz)
        for _ in range(round(40 * budget) * 100):
            noise.observe(cell.value_n(), 1.0 / rate_hz, True)
        stays = within(-0.5, 0.5, counts)
        if noise.limit < inf:
            alarms = max(alarms, HOURS * 3600.0 * rate_hz * (1.0 - stays) * stays ** (noise.limit - 1.0))
    assert alarms < 1.0


@pytest.mark.parametrize(("filtered", "sent"), [(0.9, 1), (0.99, 1), (0.0, 2), (0.0, 10)])
@pytest.mark.parametrize("counts", [0.3, 1.0, 3.0])
def test_filtered_and_repeated_samples_are_no_sign_of_death(counts: float, filtered: float, sent: int) -> None:
    assert Watched().after(Cell(counts, 7, filtered=filtered, sent=sent), 60.0) == inf


def test_a_spindle_that_stops_is_not_a_cell_that_dies() -> None:
    watched, quiet, noisy = Watched(), Cell(0.05, seed=8), Cell(3.0, seed=9)
    assert watched.after(quiet, 10.0, touching=False) == inf
    quiet._at += 0.45  # the force wanders over an edge at last: the cell lives
    assert watched.after(quiet, 10.0, touching=False) == inf
    assert watched.after(noisy, 30.0) == inf
    assert watched.after(quiet, 30.0) == inf


def test_the_rigs_own_number_rules() -> None:
    watched, cell = Watched(frozen_equal_samples=150), Cell(2.0, seed=10)
    assert watched.after(cell, 10.0) == inf
    cell.frozen = True
    assert watched.after(cell, 5.0) == pytest.approx(1.5, abs=0.02)


def test_what_was_frozen_teaches_nothing() -> None:
    watched, cell = Watched(), Cell(1.0, seed=11)
    watched.after(cell, 20.0)
    for _ in range(3):
        cell.frozen = True
        assert watched.after(cell, 3.0) <= 2.0
        watched.watch.tripped()
        assert watched.watch.is_frozen
        for _ in range(1000):
            watched.after(cell, 0.01)
        cell.frozen = False
        cell.value_n()
        watched.watch.start()
        assert watched.after(cell, 10.0) == inf
