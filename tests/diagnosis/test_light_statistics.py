"""The few statistics of the search against scipy's, which it does without."""

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import chi2

from gateway.diagnosis.light_statistics import chi2_tail, follow_exponentially, log_chi2_tail


@pytest.mark.parametrize(("value", "dof"), [(0.0, 1), (3.0, 2), (80.0, 5), (1400.0, 3), (3000.0, 3)])
def test_tails_of_chi_square_are_those_of_scipy(value, dof):
    assert chi2_tail(value, dof) == chi2.sf(value, dof)
    with np.errstate(divide="ignore"):
        assert log_chi2_tail(value, dof) == pytest.approx(chi2.logsf(value, dof), rel=1e-12)


@pytest.mark.parametrize("shape", [(300,), (300, 5)])
def test_the_lag_is_the_recursive_filter_of_first_order(shape):
    series, share = np.random.default_rng(1).normal(size=shape), 0.03
    filtered = lfilter([share], [1.0, share - 1.0], series, axis=0)
    assert follow_exponentially(series, share) == pytest.approx(filtered, abs=1e-15)
