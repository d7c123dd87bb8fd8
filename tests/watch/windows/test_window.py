"""Which rows of the ring the residual watch judges, and from where it replays."""

import numpy as np
import pytest

from gateway.service.running_rig.recording.recorded_row import COLUMNS
from gateway.watch.window import Window, window_of

HZ = 100


def run_of(duration_s: float, command_v, **columns) -> dict[str, np.ndarray]:
    """A run's rows: command_v is a function of time; the force follows it, with noise."""
    time_s = 1000.0 + np.arange(round(duration_s * HZ)) / HZ
    rows = {name: np.zeros(time_s.size) for name in COLUMNS} | {"time_s": time_s}
    rows["command_v"] = np.array([command_v(each - 1000.0) for each in time_s], dtype=float)
    rows["force_n"] = 8.0 * rows["command_v"] + np.random.default_rng(1).normal(0.0, 0.1, time_s.size)
    for name, values in columns.items():
        rows[name] = np.array([values(each - 1000.0) for each in time_s], dtype=float)
    return rows


def window_from(rows: dict[str, np.ndarray], window_s: float = 20.0) -> Window | str:
    return window_of(np.column_stack([rows[name] for name in COLUMNS]).astype("<f8").tobytes(), COLUMNS, window_s)


def steps(time_s: float) -> float:
    return 2.0 + float(np.sin(2.5 * np.floor(time_s / 2.0)))


def judged_s(window: Window) -> tuple[float, float]:
    """The judged rows, counted back from the newest row."""
    measurement = window.measurement
    at_s = measurement.time_s[measurement.usable] - measurement.time_s[-1]
    return float(at_s[0]), float(at_s[-1])


def test_the_newest_seconds_are_judged_and_the_lead_is_not():
    window = window_from(run_of(120.0, steps))
    assert judged_s(window) == pytest.approx((-20.0, 0.0), abs=0.011)
    assert window.excitation_v > 0.3
    assert window.moves >= 4


def test_a_replay_begins_at_the_last_rest():
    window = window_from(run_of(120.0, lambda t: 0.0 if 90.0 <= t < 94.0 else steps(t)))
    assert window.measurement.duration_s == pytest.approx(26.0, abs=0.1)


def test_a_dip_of_the_command_is_no_rest():
    """The lead of the force law lets a falling command touch 0 V while the pressure is still there."""
    window = window_from(run_of(120.0, lambda t: 0.0 if 95.0 <= t < 95.3 else steps(t)))
    assert window.measurement.duration_s != pytest.approx(24.7, abs=0.5)


def test_without_a_rest_it_begins_at_the_highest_command():
    window = window_from(run_of(120.0, lambda t: 6.0 if 92.0 <= t < 94.0 else steps(t)))
    assert window.measurement.duration_s == pytest.approx(28.0, abs=0.1)


def test_a_young_run_is_not_judged():
    assert "younger" in window_from(run_of(15.0, steps))


def test_a_gap_ends_what_can_be_replayed():
    rows = run_of(120.0, steps)
    rows["time_s"][-1000:] += 60.0
    assert "younger" in window_from(rows)
    rows = run_of(120.0, steps)
    rows["time_s"][-1000:] -= 60.0
    assert "younger" in window_from(rows)


def standing_still(every_s: float, for_s: float = 0.07) -> dict[str, np.ndarray]:
    """A run whose machine stands still so often, and makes no rows meanwhile."""
    rows = run_of(120.0, steps)
    lives = (rows["time_s"] - 1000.0) % every_s >= for_s
    return {name: values[lives] for name, values in rows.items()}


def test_behind_a_standstill_of_this_machine_nothing_is_judged():
    """What was sent meanwhile came late: a busy machine was told as a gain that has changed."""
    window = window_from(standing_still(100.0 + 10.0 / 3.0), 60.0)
    aside = window_from(run_of(120.0, steps), 60.0).measurement.usable.sum() - window.measurement.usable.sum()
    assert 48 <= aside <= 60, "half a second, and the standstill itself"
    assert "stood still" in window_from(standing_still(2.0), 60.0)
    assert isinstance(window_from(standing_still(2.0, for_s=0.03), 60.0), Window), "a reading that is late is none"


def test_an_idle_machine_is_not_judged():
    assert window_from(run_of(120.0, lambda t: steps(t) if t < 60.0 else 0.0)) == "nothing was commanded"


def test_rows_in_and_after_a_fault_are_no_witness():
    window = window_from(run_of(120.0, steps, fault_code=lambda t: 1.0 if 104.0 <= t < 104.01 else 0.0), 60.0)
    measurement = window.measurement
    away = ~measurement.usable & (measurement.time_s > measurement.time_s[-1] - 59.9)
    assert away.sum() == pytest.approx(200, abs=5)
    assert window_from(run_of(120.0, steps, fault_code=lambda t: float(t > 100.0))) == "a fault stood"


def test_a_sample_that_is_missing_spoils_nothing():
    rows = run_of(120.0, steps)
    rows["force_n"][-500:-480] = np.nan
    window = window_from(rows)
    assert np.isfinite(window.measurement.force_n).all()
    assert window.measurement.usable.sum() == pytest.approx(1980, abs=5)


def test_an_empty_ring_is_not_judged():
    assert isinstance(window_of(b"", COLUMNS, 20.0), str)
