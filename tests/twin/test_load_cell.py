"""Laws of the load cell."""

import numpy as np
import pytest

from gateway.twin import LoadCell, Plant, Twin
from gateway.twin.load_cell import History


def pressed(cell: LoadCell, seed: int = 1, voltage_v: float = 2.0) -> Twin:
    """A twin that has been pressing with 9 N per volt for a second."""
    twin = Twin(Plant(cell=cell), seed)
    twin.command(voltage_v)
    twin.advance(1.0)
    return twin


def test_noise_has_the_named_deviation_and_no_mean() -> None:
    twin = pressed(LoadCell(noise_n=0.2))
    readings = np.array([twin.read() for _ in range(4000)])
    assert readings.std() == pytest.approx(0.2, rel=0.05)
    assert readings.mean() == pytest.approx(18.0, abs=0.02)
    assert twin.force_n == pytest.approx(18.0, abs=1.0e-12)


def test_readings_are_whole_quanta() -> None:
    twin = pressed(LoadCell(noise_n=0.2, quantum_n=0.05))
    counts = np.array([twin.read() for _ in range(200)]) / 0.05
    np.testing.assert_allclose(counts, np.round(counts), atol=1.0e-9)


@pytest.mark.parametrize("sign", [1, -1])
def test_readings_stop_at_the_range_whatever_the_quantum(sign: int) -> None:
    twin = pressed(LoadCell(range_n=20.0, quantum_n=0.3, noise_n=0.1), voltage_v=8.0)
    twin.set_sign(sign)
    assert twin.read() == sign * 20.0


def test_swapped_wires_turn_the_sign_and_leave_the_force() -> None:
    twin = pressed(LoadCell(zero_n=0.5))
    twin.set_sign(-1)
    assert twin.read() == pytest.approx(-18.5)
    assert twin.force_n == pytest.approx(18.0)
    with pytest.raises(ValueError, match="sign"):
        twin.set_sign(0)


def test_the_filter_lags_and_ends_at_the_force() -> None:
    twin = Twin(Plant(cell=LoadCell(filter_s=0.02)), 1)
    twin.command(2.0)
    twin.advance(0.02)
    # the jump of the force is taken for a slope over its first millisecond
    assert twin.measured_n == pytest.approx(18.0 * (1.0 - np.exp(-0.975)), rel=2.0e-4)
    twin.advance(1.0)
    assert twin.measured_n == pytest.approx(18.0)


def test_the_reading_of_a_moment_stays_until_time_passes_or_a_new_one_is_taken() -> None:
    twin = pressed(LoadCell(noise_n=0.2))
    first = twin.measured_n
    assert twin.measured_n == first
    assert twin.read() != first
    second = twin.measured_n
    twin.advance(0.001)
    assert twin.measured_n != second


@pytest.mark.parametrize("first", [0, 700])
def test_a_late_reading_shows_its_moment_after_any_time(first: int) -> None:
    """What lies further back than any reading looks is dropped on the way."""
    history = History(0.001, float(first), first)
    for step in range(first + 1, first + 15_000):
        history.put(float(step))
        shown = max(step - 100.25, first)
        assert history.at(shown * 0.001) == pytest.approx(shown)
    assert len(history._values) < 10_000


@pytest.mark.parametrize("sign", [1, -1])
def test_an_amplifier_that_loses_the_sign_shows_a_push_as_one_however_its_cell_is_wired(sign: int) -> None:
    twin = pressed(LoadCell(sign_lost=1.0))
    twin.set_sign(sign)
    assert twin.read() == pytest.approx(18.0)
