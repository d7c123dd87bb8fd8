"""Replay's rows, grid and drives: uneven rows, delays between rows, what is known of repeats, spikes and clocks."""

import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gateway.twin import Contact, Drive, Friction, LoadCell, Plant, Regulator, Replay, Surroundings
from gateway.twin.experiment import Floats
from gateway.twin.plant import with_value

ROWS = 1200
TIME_S = np.arange(ROWS) * 0.005
PLANT = Plant(
    regulator=Regulator(lag_s=0.05, second_lag_s=0.03, delay_s=0.03, hysteresis_pa=900.0, dead_band_pa=450.0),
    friction=Friction(coulomb_n=1.0, load_dependent_n_per_n=0.03, presliding_m=2.0e-4, viscous_n_s_per_m=50.0),
    contact=Contact(creep_share=0.02),
    cell=LoadCell(filter_s=0.005),
)


def command_at(time_s: Floats) -> Floats:
    """Steps of half a second between 1 and 6 V."""
    levels = np.random.default_rng(7).uniform(1.0, 6.0, 40)
    return levels[np.minimum((time_s / 0.5 + 1.0e-9).astype(int), 39)]


def drive(**changes: Any) -> Drive:
    columns: dict[str, Any] = {"time_s": TIME_S, "command_v": command_at(TIME_S)}
    return Drive(**(columns | changes))


def reading(plant: Plant, step_s: float | None = None, **changes: Any) -> Floats:
    return Replay(drive(**changes), step_s).run([plant]).reading_n[0]


def test_rows_in_other_places_see_the_same_force() -> None:
    """The same commands, recorded at jittered times and with rows missing: a finer grid agrees at the same rows."""
    random = np.random.default_rng(1)
    kept = np.sort(random.choice(np.arange(1, ROWS), ROWS - 200, replace=False))
    wander = random.uniform(-0.002, 0.002, kept.size)
    changes_s = np.arange(0.5, TIME_S[-1], 0.5)  # a row stands where the command changes, as a recorder writes it
    time_s = np.unique(np.concatenate([[0.0], changes_s, TIME_S[kept] + wander]))
    found = reading(PLANT, time_s=time_s, command_v=command_at(time_s))
    fine = reading(PLANT, 0.0005, time_s=time_s, command_v=command_at(time_s))
    even = np.interp(time_s, TIME_S, reading(PLANT, 0.0005))
    assert np.sqrt(np.mean((found - fine) ** 2)) < 0.01
    assert np.abs(found - fine).max() < 0.15  # drag in steps of 5 ms
    assert np.sqrt(np.mean((fine - even) ** 2)) < 0.02


def test_the_delay_acts_smoothly_between_rows() -> None:
    """Even increments of the delay give even changes of the force: no stairs at whole rows."""
    plants = [with_value(PLANT, "regulator", "delay_s", 0.02 + 0.0005 * k) for k in range(31)]
    change = np.diff(Replay(drive()).run(plants).pressure_pa, axis=0)
    size = np.sqrt(np.mean(change**2, axis=1))
    assert size.max() / size.min() < 1.02
    shifted = Replay(drive()).run([with_value(PLANT, "regulator", "delay_s", delay) for delay in (0.0213, 0.0214)])
    assert np.abs(np.diff(shifted.pressure_pa, axis=0)).max() > 1.0


def test_a_delay_of_whole_rows_is_a_shift_of_the_rows() -> None:
    prompt, late = (
        Replay(drive()).run([with_value(PLANT, "regulator", "delay_s", delay_s)]).pressure_pa[0]
        for delay_s in (0.0, 0.05)
    )
    np.testing.assert_allclose(late[10:], prompt[:-10], atol=1.0e-3)


def test_what_is_known_from_before_changes_nothing() -> None:
    replay = Replay(drive())
    others = [with_value(PLANT, "friction", "coulomb_n", 1.0 + 0.1 * k) for k in range(20)]
    replay.run(others)
    first = replay.run([PLANT, *others[3:6]])
    again = replay.run([*others[3:6], PLANT])
    fresh = Replay(drive()).run([PLANT])
    np.testing.assert_allclose(first.reading_n[0], fresh.reading_n[0], atol=1.0e-8)
    np.testing.assert_array_equal(first.reading_n[0], again.reading_n[3])
    np.testing.assert_array_equal(first.reading_n[1:], again.reading_n[:3])


@pytest.mark.parametrize("count", [2, 9, 40])
def test_many_plants_together_are_single_runs(count: int) -> None:
    for friction in (PLANT.friction, Friction(coulomb_n=1.0), Friction(coulomb_n=1.0, stribeck_n=0.5)):
        base = replace(PLANT, friction=friction)
        plants = [with_value(base, "friction", "coulomb_n", 1.0 + 0.02 * k) for k in range(count)]
        together = Replay(drive()).run(plants).reading_n
        for lane in (0, count // 2, count - 1):
            alone = Replay(drive()).run([plants[lane]]).reading_n[0]
            np.testing.assert_allclose(together[lane], alone, rtol=0.0, atol=1.0e-7)


def test_numpy_numbers_and_whole_numbers_are_taken_for_floats() -> None:
    odd = with_value(with_value(PLANT, "regulator", "lag_s", np.float64(0.05)), "contact", "mass_kg", 0)
    np.testing.assert_array_equal(reading(odd), reading(PLANT))


def test_the_grid_is_as_fine_as_the_rows_and_at_most_5_ms() -> None:
    assert Replay(drive()).grid.step_s == pytest.approx(0.005)
    time_s = np.arange(100) * 0.02
    assert Replay(Drive(time_s=time_s, command_v=command_at(time_s))).grid.step_s == pytest.approx(0.005)
    time_s = np.arange(300_000) * 1.0e-3
    replay = Replay(Drive(time_s=time_s, command_v=command_at(time_s)))
    assert replay.grid.step_s == pytest.approx(3.75e-3, rel=1.0e-3)
    assert replay.notes == ("simulated in steps of 3.75 ms, coarser than the rows",)
    whole = Replay(Drive(time_s=time_s, command_v=command_at(time_s)), most_steps=300_000)
    assert whole.grid.step_s == pytest.approx(1.0e-3)
    assert whole.notes == ()


def test_before_the_first_row_the_command_was_nothing_or_what_is_said() -> None:
    held, plant = np.full(ROWS, 4.0), with_value(PLANT, "contact", "creep_share", 0.0)
    rising = reading(plant, command_v=held)
    standing = reading(plant, command_v=held, before_v=None)
    assert rising[0] == 0.0
    assert rising[-1] > 30.0
    np.testing.assert_allclose(standing, standing[0], atol=1.0e-9)
    assert standing[0] == pytest.approx(rising[-1], abs=0.02)


def test_repeated_rows_show_the_reading_before_only_where_the_effect_is_on() -> None:
    repeated = np.zeros(ROWS, dtype=bool)
    repeated[[300, 301, 700]] = True
    plain = reading(PLANT)
    found = reading(with_value(PLANT, "cell", "repeated_share", 0.01), repeated=repeated)
    assert found[300] == found[301] == plain[299]
    np.testing.assert_array_equal(found[~repeated], plain[~repeated])
    np.testing.assert_array_equal(reading(PLANT, repeated=repeated), plain)


def test_outliers_are_given_rows_times_their_size() -> None:
    spikes = np.zeros(ROWS)
    spikes[[10, 600]] = 1.0, -0.5
    found = reading(with_value(PLANT, "cell", "outlier_n", 8.0), outliers=spikes)
    np.testing.assert_allclose(found - reading(PLANT), 8.0 * spikes, atol=1.0e-12)
    np.testing.assert_array_equal(reading(PLANT, outliers=spikes), reading(PLANT))


def test_a_clock_may_run_ahead_in_replay() -> None:
    ahead = reading(with_value(PLANT, "cell", "clock_offset_s", -0.05))
    np.testing.assert_allclose(ahead[:-10], reading(PLANT)[10:], atol=1.0e-9)
    skewed = reading(with_value(PLANT, "cell", "clock_skew", -0.01))
    np.testing.assert_allclose(skewed[500], reading(PLANT)[505], atol=1.0e-9)


def test_a_measured_pressure_drives_the_cylinder_where_there_is_no_command() -> None:
    ideal = Replay(drive()).run([PLANT])
    found = Replay(drive(command_v=None, pressure_pa=ideal.pressure_pa[0])).run(
        [PLANT, with_value(PLANT, "regulator", "lag_s", 1.0)]
    )
    np.testing.assert_allclose(found.reading_n[0], ideal.reading_n[0], atol=1.0e-9)
    np.testing.assert_array_equal(found.reading_n[0], found.reading_n[1])
    np.testing.assert_array_equal(found.pressure_pa[0], ideal.pressure_pa[0])


def test_the_spindle_passes_the_filter_by_its_response() -> None:
    """Faster than the rows: 100 Hz seen every 5 ms would be nothing but its samples."""
    around = replace(drive().surroundings, spindle_rpm=np.full(ROWS, 4200.0))
    shaking = with_value(PLANT, "contact", "spindle_n", 1.0)
    found = reading(shaking, surroundings=around) - reading(PLANT)
    turn = 2.0 * np.pi * 70.0
    expected = np.sin(turn * TIME_S - np.arctan(turn * 0.005)) / np.hypot(1.0, turn * 0.005)
    np.testing.assert_allclose(found, expected, atol=1.0e-9)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"time_s": TIME_S + 1.0}, "start at 0"),
        ({"time_s": np.where(TIME_S[5] == TIME_S, TIME_S[4], TIME_S)}, "rise"),
        ({"command_v": None}, "driven by"),
        ({"motion": "measured"}, "needs position_m"),
        ({"command_v": np.ones(3)}, "shape"),
        ({"command_v": np.where(TIME_S[7] == TIME_S, np.nan, 1.0)}, "command_v is not finite in row 7"),
    ],
)
def test_a_drive_that_does_not_fit_is_refused(changes: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        drive(**changes)


def test_a_replay_takes_plants_one_by_one() -> None:
    with pytest.raises(ValueError, match="at least one"):
        Replay(drive()).run([])


def test_the_real_time_twin_loads_neither_replay_nor_scipy_nor_numba() -> None:
    code = (
        "import sys, gateway.twin; print(sorted({'scipy', 'numba', 'gateway.twin.replay.replay'} & set(sys.modules)))"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_the_middle_of_a_path_is_that_of_its_rows_and_a_reading_sees_the_command_before_it() -> None:
    """Rows that lie closer on one side have points of the grid between them: there, and at the rows, it is one middle."""
    time_s = np.concatenate([np.arange(100) * 0.005, 0.5 + np.arange(1, 50) * 0.05])
    position_mm = 20.0 * time_s
    around = Surroundings(position_mm=position_mm)
    grid = Replay(drive(time_s=time_s, command_v=command_at(time_s), surroundings=around, before_v=7.0)).grid
    assert grid.points > grid.rows
    assert grid.row_conditions.aside_mm == pytest.approx(position_mm - position_mm.mean())
    assert grid.at_rows(grid.conditions.aside_mm) == pytest.approx(grid.row_conditions.aside_mm)
    assert grid.row_conditions.command_v.tolist() == [7.0, *command_at(time_s)[:-1]]
