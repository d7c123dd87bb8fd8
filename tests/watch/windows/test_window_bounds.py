"""Where a window begins and ends, and where its replay does: to the row."""

from collections.abc import Callable

import numpy as np
import pytest

from gateway.watch.window import Window
from tests.watch.windows.test_window import HZ, judged_s, run_of, window_from

LAST_S = 120.0
PEAK_S = (95.0, 97.0)


def resting(*rests_s: tuple[float, float], at_v: float = 0.0) -> Callable[[float], float]:
    """2 V but for these rests, and a peak within the lead, where a replay without a rest begins."""

    def command_v(time_s: float) -> float:
        if any(begin <= time_s < end for begin, end in rests_s):
            return at_v
        return 6.0 if PEAK_S[0] <= time_s < PEAK_S[1] else 2.0

    return command_v


def replayed_s(command_v: Callable[[float], float]) -> float:
    window = window_from(run_of(LAST_S, command_v))
    assert isinstance(window, Window)
    return window.measurement.duration_s


FROM_PEAK_S = LAST_S - PEAK_S[0]


@pytest.mark.parametrize(
    ("rest_s", "replay_s"),
    [
        ((88.5, 90.0), 30.0),
        ((85.0, 87.9), FROM_PEAK_S),  # more than 12 s before the window
        ((98.0, 98.7), FROM_PEAK_S),  # a dip
        ((97.2, 98.3), 21.7),
        ((97.0, 103.0), 21.0),  # so that all of the window can be judged
    ],
)
def test_a_rest_is_one_of_a_second_within_the_lead(rest_s: tuple[float, float], replay_s: float) -> None:
    assert replayed_s(resting(rest_s)) == pytest.approx(replay_s, abs=0.03)


def test_a_rest_that_reaches_into_the_window_costs_nothing_of_it() -> None:
    assert judged_s(window_from(run_of(LAST_S, resting((97.0, 103.0))))) == pytest.approx((-20.0, 0.0), abs=0.011)


def test_a_hundredth_of_a_volt_is_still_rest_and_more_is_a_command() -> None:
    assert replayed_s(resting((91.0, 93.0), at_v=0.005)) == pytest.approx(27.0, abs=0.03)
    assert replayed_s(resting((91.0, 93.0), at_v=0.05)) == pytest.approx(FROM_PEAK_S, abs=0.03)
    assert isinstance(window_from(run_of(LAST_S, lambda _: 0.05)), Window)
    assert window_from(run_of(LAST_S, lambda _: 0.005)) == "nothing was commanded"


def test_a_spike_of_the_command_is_no_highest_command() -> None:
    peaks = resting()
    assert replayed_s(lambda time_s: 9.0 if 92.0 <= time_s < 92.05 else peaks(time_s)) == pytest.approx(
        FROM_PEAK_S, abs=0.03
    )


def test_a_run_is_old_enough_with_nine_tenths_of_a_window_behind_its_first_second() -> None:
    assert "younger" in window_from(run_of(18.5, resting()))
    window = window_from(run_of(19.2, resting()))
    assert judged_s(window) == pytest.approx((-18.19, 0.0), abs=0.011)


@pytest.mark.parametrize(
    ("steps", "is_judged"),
    [([(500, 0.3)], True), ([(500, 0.6)], False), ([(8000, 60.0), (500, 0.6)], False), ([(8000, 60.0)], True)],
)
def test_half_a_second_without_a_row_is_a_gap_and_the_last_one_counts(
    steps: list[tuple[int, float]], is_judged: bool
) -> None:
    rows = run_of(LAST_S, resting())
    for rows_from_end, gap_s in steps:
        rows["time_s"][-rows_from_end:] += gap_s
    assert isinstance(window_from(rows), Window) is is_judged


def test_what_is_told_of_a_window_is_what_is_judged_of_it() -> None:
    """Its own command and turns, not the lead's, and the time of its newest row; its pressure is no channel."""
    rows = run_of(LAST_S, resting())
    rows["pressure_kpa"][:] = 100.0
    window = window_from(rows)
    assert (window.excitation_v, window.moves) == (0.0, 0)
    assert window.end_s == rows["time_s"][-1] == pytest.approx(1000.0 + LAST_S - 1.0 / HZ)
    assert window.measurement.pressure_pa is None or np.isnan(window.measurement.pressure_pa).all()
    levels = run_of(
        LAST_S, lambda time_s: (1.0, 2.0, 3.0, 2.0, 1.0)[int(time_s - 100.0) // 4] if time_s >= 100.0 else 1.0
    )
    window = window_from(levels)
    assert window.moves == 1 and window.excitation_v == pytest.approx(np.std([1, 2, 3, 2, 1]), abs=0.01)
