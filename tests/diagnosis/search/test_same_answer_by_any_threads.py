"""An answer does not depend on how many threads computed it."""

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from gateway.diagnosis import diagnose
from gateway.one_blas_thread import _thread_count, one_blas_thread
from gateway.reports.diagnosis.document import diagnosis_document
from gateway.side_by_side import one_after_another
from tests.diagnosis.machine import command_v, measurement, plant, readings_n, times_s


@pytest.fixture
def threads() -> Iterator[Callable[[], int]]:
    """Two, as numpy takes them on a machine of two cores that nobody told otherwise; how many there are."""
    count, choose = _thread_count()
    before = count()
    choose(2)
    if count() != 2:
        pytest.skip(f"numpy's OpenBLAS stays at {count()} threads here")
    yield count
    choose(before)


def answer() -> dict[str, object]:
    time_s = times_s(20.0)
    volts = command_v(time_s)
    machine = plant({"contact.creep_share": 0.05})
    noise_n = np.random.default_rng(7).normal(0.0, 0.1, time_s.size)
    found = diagnose([measurement(time_s, volts, readings_n(machine, time_s, volts, {}) + noise_n, {})])
    return diagnosis_document(found, 0.0)


@pytest.mark.long
def test_neither_threads_of_products_nor_lanes_change_a_digit(threads: Callable[[], int]) -> None:
    """The gain on unseen blocks was another in its fifth digit: sums were added in another order."""
    by_two = answer()
    assert threads() == 2, "what others had is as it was"
    with one_blas_thread(), one_after_another():
        by_one = answer()
    assert by_two["causes"], "something is found, or nothing is proved"
    assert by_two == by_one
