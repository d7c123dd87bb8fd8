"""What the search needs of scipy's statistics and filters, without scipy.stats and scipy.signal.

Those two take half a second and 60 MB of whoever imports them, in a command that answers in seconds and in a watch that
stays for ever.
"""

import numpy as np

from gateway.compiled import loop
from gateway.diagnosis.measurement import Floats


def chi2_tail(value: float, dof: int) -> float:
    """Return the probability that chi-square with `dof` degrees of freedom is above a value."""
    from scipy.special import chdtrc  # here, so that the catalogue costs no scipy

    return float(chdtrc(dof, value))


def log_chi2_tail(value: float, dof: int) -> float:
    """Return the natural logarithm of `chi2_tail`; -inf where that is too small for a float."""
    tail = chi2_tail(value, dof)
    return float(np.log(tail)) if tail > 0.0 else -np.inf


def follow_exponentially(series: Floats, share: float) -> Floats:
    """Return series (rows,) or (rows, columns) behind a first-order lag that begins at 0.

    share: what a row takes of the way to its new value, 1 - exp(-row / lag).
    """
    columns = np.ascontiguousarray(series, dtype=np.float64).reshape(len(series), -1)
    late = np.empty_like(columns)
    _follow(columns, float(share), late)
    return late.reshape(np.shape(series))


@loop
def _follow(series: Floats, share: float, late: Floats) -> None:
    """Fill in each column behind its lag."""
    for column in range(series.shape[1]):
        late[0, column] = share * series[0, column]
    for row in range(1, series.shape[0]):
        for column in range(series.shape[1]):
            late[row, column] = share * series[row, column] + (1.0 - share) * late[row - 1, column]
