"""The picture of a recording: what was asked for and what was measured, on the same side."""

import re
from pathlib import Path

import numpy as np
import pytest

from gateway.recording import Recording
from gateway.recording.tables.column_names import DERIVED
from gateway.reports.axis import spread
from gateway.reports.recording_plot import recording_svg

N = 100


def drawn(pulling: np.ndarray, **more: np.ndarray) -> list[str]:
    """The points of the two curves of the first panel, of 12 N that are held exactly."""
    columns = {name: np.zeros(N) for name in DERIVED} | {
        "time_s": np.arange(N) / 10.0,
        "setpoint_n": np.full(N, 12.0),
        "force_n": np.where(pulling == 1.0, -12.0, 12.0),
        "pulling": pulling,
    }
    svg = recording_svg(Recording(Path("0001.fgr"), {"rig": "paper-pull"}, columns | more, N, False))
    return re.findall(r'<polyline class="line (?:before|after)" points="([^"]+)"', svg)


def test_the_setpoint_of_a_pull_is_drawn_beside_its_force() -> None:
    """12 N that were pulled exactly stood 24 N below what was asked for."""
    for pulling in (np.zeros(N), np.ones(N), np.where(np.arange(N) < 50, 0.0, 1.0)):
        asked, measured = drawn(pulling)
        assert asked == measured


def test_whoever_measures_the_wrong_way_without_a_pull_sees_it() -> None:
    asked, measured = drawn(np.zeros(N), force_n=np.full(N, -12.0))
    assert asked != measured


@pytest.mark.parametrize("value", [0.0, 5.0, 5.0 + 1e-13])
def test_a_value_that_stands_still_is_drawn_among_values_of_its_size(value: float) -> None:
    """The voltage of a recording at rest had an axis from -6e-11 to 6e-11 V."""
    for around in (None, 5.0):
        low, high = spread([value, 5.0 if value else 0.0], around=around)
        assert low < value < high and high - low > 0.1
    assert spread([0.0, 2.0], margin=0.0) == (0.0, 2.0) and spread([1e-6, 3e-6], margin=0.0) == (1e-6, 3e-6)
