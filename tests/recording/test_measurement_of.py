"""From a table to a measurement: what is repaired is told, and what only the user can know is refused by row."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gateway.diagnosis.measurement import Measurement
from gateway.recording import Recording, RecordingError, read_table
from gateway.recording.measurement import measurement_of
from gateway.recording.tables.column_names import DERIVED
from gateway.recording.tables.mapping_file import column_mapping
from gateway.recording.tables.row_validity import flag_repeated, valid_by_quality

N = 1000
TIME_S = np.arange(N) / 200.0


def columns(**changed: Any) -> dict[str, NDArray[np.float64]]:
    """5 s at 200 Hz with noise; None takes a column away."""
    noise = np.random.default_rng(3).normal(0.0, 0.05, N)
    command_v = 2.0 + np.round(np.sin(TIME_S), 3)
    found = {"time_s": TIME_S + 7.0, "command_v": command_v, "force_n": 8.0 * command_v + noise} | changed
    return {name: np.array(values, dtype=float) for name, values in found.items() if values is not None}


def recording(header: Mapping[str, Any] | None = None, **changed: Any) -> Recording:
    table = columns(**changed)
    return Recording(Path("run.csv"), dict(header or {}), table, len(table["time_s"]), False)


def measured(**changed: Any) -> Measurement:
    return measurement_of(recording(**changed))


def noted(measurement: Measurement, words: str) -> bool:
    return any(words in note for note in measurement.notes)


def spoiled(name: str, rows: Any, value: float = np.nan) -> dict[str, NDArray[np.float64]]:
    values = columns()[name].copy()
    values[rows] = value
    return {name: values}


def test_a_clean_table_is_taken_as_it_is() -> None:
    found = measured()
    np.testing.assert_allclose(found.time_s, TIME_S, atol=1e-12)
    np.testing.assert_array_equal(found.force_n, columns()["force_n"])
    assert found.usable.all()
    assert not found.repeated.any()
    assert (found.pressure_pa, found.position_m, found.covariates, found.notes) == (None, None, {}, ())


def test_a_command_beyond_any_regulator_is_asked_for_its_unit() -> None:
    found = measured(command_v=1000.0 * columns()["command_v"])
    assert noted(found, "command_v goes to 3000: is it in mV? then --columns command_v=...:mv")
    assert not noted(measured(), "in mV")


def test_units_are_si() -> None:
    found = measured(pressure_kpa=TIME_S + 100.0, position_mm=TIME_S + 0.5)
    assert found.pressure_pa is not None and found.position_m is not None
    np.testing.assert_allclose(found.pressure_pa, (TIME_S + 100.0) * 1e3)
    np.testing.assert_allclose(found.position_m, (TIME_S + 0.5) * 1e-3)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"force_n": None}, "no column force_n; there: time_s, command_v"),
        ({"command_v": None}, "no column command_v (or pressure_kpa)"),
        ({"force_n": None}, "Say which is which: --columns time_s=1:s,"),
        (spoiled("time_s", 500, 7.1), "run.csv, row 501, column time_s: 7.1 after 9.495: time runs backwards"),
        (spoiled("time_s", slice(300, 700)), "row 301, column time_s: no number; so in 400 of 1000 rows"),
        (spoiled("force_n", slice(30, None)), "30 usable rows in 4.995 s: at least 50 usable rows over 1 s"),
        ({"time_s": TIME_S * (0.99996 / TIME_S[-1])}, "1000 usable rows in 0.99996 s: at least 50 usable rows"),
        (spoiled("command_v", slice(None)), "0 usable rows"),
        ({"time_s": np.zeros(N)}, "1 usable rows in 0 s"),
        ({"time_s": TIME_S * 1e3}, "one row every 5 s"),
    ],
)
def test_what_only_the_user_can_know_is_refused(changed: dict[str, Any], words: str) -> None:
    with pytest.raises(RecordingError) as caught:
        measured(**changed)
    assert words in str(caught.value)


def test_three_samples_are_told_what_is_needed() -> None:
    few = Recording(Path("x.csv"), {}, {name: values[:3] for name, values in columns().items()}, 3, False)
    with pytest.raises(RecordingError, match="3 rows: at least 50 usable rows over 1 s are needed"):
        measurement_of(few)


def test_a_constant_force_is_a_measurement() -> None:
    found = measured(force_n=np.full(N, 3.0), command_v=np.full(N, 2.0))
    assert found.usable.all()
    assert not found.repeated.any()


def test_a_constant_force_is_said_to_be_one() -> None:
    assert noted(measured(force_n=np.full(N, 5.0)), "force_n is 5 in every row")
    assert not noted(measured(), "in every row")


def test_a_force_against_its_command_asks_for_the_sign() -> None:
    assert noted(measured(force_n=-columns()["force_n"]), "force_n falls as command_v rises (correlation -")
    assert not noted(measured(), "falls as")
    assert not noted(measured(force_n=-columns()["force_n"], command_v=np.full(N, 2.0)), "falls as")


@pytest.mark.parametrize("name", ["force_n", "command_v", "temperature_c"])
def test_what_overflows_in_a_square_is_a_missing_value(name: str) -> None:
    table = columns(temperature_c=20.0 + TIME_S**2)
    table[name][500] = 1.0e300
    found = measured(**table)
    assert noted(found, f"1 values of {name} are beyond 1e+60 (the first: run.csv, row 501): taken as missing")
    assert bool(found.usable[500]) == (name != "force_n")
    assert found.command_v is not None and float(found.command_v.max()) < 4.0
    assert float(found.covariates["temperature_c"].max()) < 100.0


def test_of_rows_with_one_time_the_last_stays() -> None:
    found = measured(**spoiled("time_s", 500, 9.495))
    assert found.rows == N - 1
    assert found.force_n[499] == columns()["force_n"][500]
    assert noted(found, "1 rows repeat the time stamp before (the first: run.csv, row 501)")


def test_a_time_that_runs_backwards_is_told_by_its_own_row() -> None:
    """And not by one before it that stands still, which is repaired."""
    time_s = columns()["time_s"]
    time_s[100], time_s[500] = time_s[99], time_s[499] - 1.0
    with pytest.raises(
        RecordingError, match=r"run\.csv, row 501, column time_s: .* time runs backwards \(1 time in the file"
    ):
        measured(time_s=time_s)


def test_blank_rows_are_left_out() -> None:
    found = measured(**{name: spoiled(name, 9)[name] for name in ("time_s", "command_v", "force_n")})
    assert found.rows == N - 1
    assert noted(found, "1 rows without a time (the first: run.csv, row 10)")


def test_a_force_that_is_not_there_is_not_judged() -> None:
    found = measured(**spoiled("force_n", slice(100, 110)))
    assert np.flatnonzero(~found.usable).tolist() == list(range(100, 110))


def test_a_command_stands_until_the_next_one() -> None:
    found = measured(**spoiled("command_v", [0, 1, 500]))
    command_v = columns()["command_v"]
    assert found.command_v is not None
    assert found.command_v[[0, 1, 500]].tolist() == [command_v[2], command_v[2], command_v[499]]
    assert np.flatnonzero(~found.usable).tolist() == [0, 1]
    assert noted(found, "3 rows without a command keep the one before")
    assert not noted(measured(), "without a command")


def test_rows_after_a_gap_wait_until_it_is_forgotten() -> None:
    found = measured(time_s=TIME_S + np.where(TIME_S >= 2.0, 0.2, 0.0))
    assert np.flatnonzero(~found.usable).tolist() == list(range(400, 500))
    assert noted(found, "1 gap in time (the longest 0.205 s, at 1.995 s the first): 100 rows")


def test_uneven_sampling_is_no_gap() -> None:
    steps = np.random.default_rng(5).exponential(0.005, N)
    assert measured(time_s=np.cumsum(steps)).usable.all()


def test_pressure_alone_drives_and_its_holes_are_not_judged() -> None:
    pressure_kpa = 100.0 + TIME_S
    pressure_kpa[5] = np.nan
    found = measured(command_v=None, pressure_kpa=pressure_kpa)
    assert found.command_v is None and found.pressure_pa is not None
    assert np.flatnonzero(~found.usable).tolist() == [5]
    assert found.pressure_pa[5] == pytest.approx(1e3 * (100.0 + TIME_S[5]))
    assert measured(pressure_kpa=pressure_kpa).usable.all()


def test_a_column_without_a_value_is_as_good_as_none() -> None:
    found = measured(pressure_kpa=np.full(N, np.nan), position_mm=np.full(N, np.nan), oil=np.full(N, np.nan))
    assert (found.pressure_pa, found.position_m, found.covariates) == (None, None, {})
    assert len(found.notes) == 3


def test_a_position_that_never_changes_says_no_direction() -> None:
    assert measured(position_mm=np.full(N, 4.0)).position_m is None


def test_covariates_come_without_holes_and_without_constants() -> None:
    temperature_c = np.where(np.arange(N) % 200 == 0, 20.0 + TIME_S, np.nan)  # one value a second
    found = measured(temperature_c=temperature_c, humidity=np.sin(TIME_S), dial=np.full(N, 4.0), unit=np.ones(N))
    assert sorted(found.covariates) == ["humidity", "temperature_c"]
    np.testing.assert_allclose(found.covariates["temperature_c"][:801], 20.0 + TIME_S[:801])
    assert noted(found, "constant, so nothing can be seen to depend on it: dial, unit")
    assert noted(found, "drawn straight from the ones around: temperature_c (995)")


def test_a_spindle_that_turns_steadily_still_turns() -> None:
    assert "spindle_rpm" in measured(spindle_rpm=np.full(N, 3000.0)).covariates
    assert "spindle_rpm" not in measured(spindle_rpm=np.zeros(N)).covariates


def test_the_force_in_another_unit_is_no_covariate() -> None:
    force_n = columns()["force_n"]
    found = measured(
        bridge_mv=np.round(force_n / 46.0 + 0.2, 4), row=np.arange(N), pressure_like=columns()["command_v"]
    )
    assert list(found.covariates) == ["pressure_like"]
    assert noted(found, "a copy of the measured force: bridge_mv")
    assert noted(found, "it only counts time: row")


def test_what_our_recorder_derives_from_the_force_is_no_covariate() -> None:
    derived = {name: np.random.default_rng(k).normal(size=N) for k, name in enumerate(DERIVED)}
    assert measured(**derived).covariates == {}
    assert "state" in measured(state=derived["state"]).covariates


def test_rows_of_a_pull_are_told_and_not_judged_by_a_plant_that_pushes() -> None:
    """They were taken for a push whose cell's sign had turned."""
    derived, pulling = {name: np.zeros(N) for name in DERIVED}, np.where(TIME_S < 2.0, 1.0, 0.0)
    found = measured(pulling=pulling, force_n=np.where(pulling, -1.0, 1.0) * columns()["force_n"], **derived)
    highest = 400 + int(np.argmax(columns()["command_v"][400:]))
    assert not found.usable[: highest + 1].any() and found.usable[highest + 1 :].all()
    assert noted(
        found, f"400 rows in which the tool pulled, and {highest - 399} right before or behind, are not judged"
    )
    assert not noted(found, "sign turned") and "pulling" not in found.covariates
    with pytest.raises(RecordingError, match=r"0 usable rows .*1000 rows in which the tool pulled"):
        measured(pulling=np.ones(N), **derived)
    foreign = measured(pulling=pulling)
    assert "pulling" in foreign.covariates and foreign.usable.all(), "whatever another table means by it"


def test_a_thousand_covariates_are_taken_and_told() -> None:
    noise = np.random.default_rng(2).normal(size=(1000, N))
    found = measured(**{f"c{k}": noise[k] for k in range(1000)})
    assert len(found.covariates) == 1000
    assert noted(found, "1000 covariates")


def test_overload_is_no_reading_and_unsteady_is_one() -> None:
    quality = np.where(np.arange(N) % 2 == 0, 1.0, 0.0)
    quality[:3] = 2.0
    derived = {name: np.random.default_rng(k).normal(size=N) for k, name in enumerate(DERIVED)}
    assert np.flatnonzero(~measured(quality=quality, **derived).usable).tolist() == [0, 1, 2]
    assert np.flatnonzero(~measured(quality=quality).usable).tolist() == [0, 1, 2]
    seldom = np.where(np.arange(N) == 4, 1.0, 0.0)
    assert measured(quality=seldom, **derived).usable.all(), "of our own recorder it is one, however seldom"


@pytest.mark.parametrize("good", [0.0, 1.0, 192.0])
def test_the_frequent_quality_of_a_foreign_table_is_the_good_one(good: float) -> None:
    quality = np.full(N, good)
    quality[[4, 9]] = 1.0 if good == 0.0 else 0.0
    assert np.flatnonzero(~valid_by_quality(quality, is_ours=False)[0]).tolist() == [4, 9]


@pytest.mark.parametrize("share", [0.02, 0.3])
@pytest.mark.parametrize("digits", [1, 2, 4, 12])
def test_repeated_readings_are_found_among_quantised_ones(share: float, digits: int) -> None:
    rng = np.random.default_rng(11)
    force_n = np.round(20.0 + 5.0 * np.sin(np.arange(12000) / 300.0) + rng.normal(0.0, 0.2, 12000), digits)
    assert not flag_repeated(force_n)[0].any()
    again = np.append(False, rng.random(11999) < share)
    force_n = force_n[np.maximum.accumulate(np.where(again, 0, np.arange(12000)))]
    found = flag_repeated(force_n)[0]
    if share > 0.1 or digits > 1:  # a resolution of half the noise hides one repetition in fifty
        assert found.sum() >= 0.9 * again.sum()
        assert found[again].mean() > 0.95


def test_a_coarse_resolution_or_a_force_at_rest_repeats_nothing() -> None:
    rng = np.random.default_rng(4)
    assert not flag_repeated(np.round(10.0 + rng.normal(0.0, 0.02, 4000), 1))[0].any()
    clipped = np.clip(20.0 + 15.0 * np.sin(np.arange(4000) / 100.0) + rng.normal(0.0, 0.1, 4000), 0.0, 30.0)
    assert not flag_repeated(clipped)[0].any()


ZILLEN = Path(os.environ.get("FORCE_GATEWAY_DATA", "../shared/data")) / "zillen-cylinder-friction"


@pytest.mark.skipif(not ZILLEN.is_dir(), reason=f"the recordings of a real cylinder are not here ({ZILLEN})")
@pytest.mark.parametrize(("name", "rows"), [("O-ring257_1bar", 5828), ("PK_1bar", 6907), ("PK_3bar", 7680)])
def test_a_real_cylinder_is_read_by_its_mapping(name: str, rows: int) -> None:
    mapping = column_mapping("time_s=1:ms,position_mm=5:mm,pressure_kpa=6:bar,force_n=7:n")
    found = measurement_of(read_table(ZILLEN / f"friction_{name}.csv", mapping))
    assert found.rows == rows
    assert found.pressure_pa is not None and found.position_m is not None
    judged = found.usable
    newton_per_bar = found.force_n[judged].mean() / found.pressure_pa[judged].mean() * 1e5
    assert newton_per_bar == pytest.approx(52.4 if name.startswith("O") else 50.1, rel=0.02)
    assert found.usable.mean() > 0.95
