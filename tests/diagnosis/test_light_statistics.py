"""The few statistics of the search against scipy's, which it does without."""

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import chi2

from gateway.diagnosis.light_statistics import chi2_tail, follow_exponentially, log_chi2_tail


@pytest.mark.parametrize("dof", [1, 2, 3, 4, 7, 12, 19])
@pytest.mark.parametrize("value", [0.0, 1.0e-6, 0.3, 2.0, 11.0, 90.0, 590.0, 610.0, 1300.0])
def test_tails_of_chi_square_are_those_of_scipy(value, dof):
    assert chi2_tail(value, dof) == pytest.approx(chi2.sf(value, dof), rel=1e-8)
    assert log_chi2_tail(value, dof) == pytest.approx(chi2.logsf(value, dof), rel=1e-8, abs=1e-13)


def test_a_chance_smaller_than_any_float_has_a_logarithm():
    far, further = (log_chi2_tail(value, 3) for value in (1.0e5, 1.0e5 + 2.0))
    assert further - far == pytest.approx(-1.0, abs=1e-4)


def test_the_lag_is_the_recursive_filter_of_first_order():
    series, share = np.random.default_rng(1).normal(size=300), 0.03
    assert follow_exponentially(series, share) == pytest.approx(lfilter([share], [1.0, share - 1.0], series), abs=1e-15)
