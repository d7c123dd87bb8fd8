"""What a logger writes for no value is no reading, however often it stands there in a row; what was pressed is one."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from gateway.diagnosis.measurement import Floats
from gateway.recording import Recording
from gateway.recording.measurement import measurement_of
from gateway.recording.tables.row_validity import flag_dropouts

TIME_S = np.arange(3000) / 100.0
VOLTS = 2.0 + np.round(1.5 * np.sin(TIME_S), 2)
FORCE_N = 8.0 * VOLTS + np.random.default_rng(2).normal(0.0, 0.1, TIME_S.size)


def dropped(force_n: Floats, *drives: Floats) -> Sequence[int]:
    rows, notes = flag_dropouts(force_n, TIME_S, drives or (VOLTS,))
    assert bool(notes) == rows.any()
    return np.flatnonzero(rows).tolist()


@pytest.mark.parametrize("value", [-9999.0, -999.0, 32767.0, 1.0e9])
def test_a_stretch_of_what_stands_for_no_value_is_missing(value: float) -> None:
    spoiled = FORCE_N.copy()
    spoiled[1200:1220] = value
    assert dropped(spoiled) == list(range(1200, 1220))
    table = {"time_s": TIME_S, "command_v": VOLTS, "force_n": spoiled}
    found = measurement_of(Recording(Path("run.csv"), {}, table, TIME_S.size, False))
    assert int(found.usable.sum()) == TIME_S.size - 20
    assert found.repeated.sum() == 0
    assert "20 readings are far beyond all others" in found.notes[0]


def test_a_single_one_is_left_to_the_diagnosis() -> None:
    spoiled = FORCE_N.copy()
    spoiled[[100, 2000]] = -9999.0
    assert dropped(spoiled) == []


def test_what_was_pressed_once_in_a_long_rest_is_no_dropout() -> None:
    volts = np.where((TIME_S > 20.0) & (TIME_S < 20.8), 4.0, 0.0)
    force_n = 8.0 * np.roll(volts, 12) + np.random.default_rng(3).normal(0.0, 0.1, TIME_S.size)
    assert dropped(force_n, volts) == []
    assert dropped(force_n, np.zeros(TIME_S.size), 5.0e-3 * volts) == [], "driven by the position"


@pytest.mark.parametrize("name", ["temperature_c", "supply_kpa", "pressure_kpa"])
def test_a_temperature_or_a_pressure_that_is_none_is_missing(name: str) -> None:
    values = 20.0 + np.sin(TIME_S)
    table = {"time_s": TIME_S, "command_v": VOLTS, "force_n": FORCE_N, name: values.copy()}
    table[name][::40] = -9999.0
    found = measurement_of(Recording(Path("run.csv"), {}, table, TIME_S.size, False))
    kept = found.covariates.get(name) if found.pressure_pa is None else found.pressure_pa / 1000.0
    np.testing.assert_allclose(kept, values, atol=0.02)
    assert f"75 values of {name} are below" in found.notes[0]
    turned = measurement_of(Recording(Path("run.csv"), {}, table | {name: -1000.0 * values}, TIME_S.size, False))
    assert not any("are below" in note for note in turned.notes), "all of them: that is another thing"


@pytest.mark.parametrize(
    ("name", "usual", "seldom"),
    [
        ("supply_kpa", 700.0, 1500.0),
        ("pressure_kpa", 300.0, 1500.0),
        ("pressure_kpa", 300.0, -90.0),
        ("temperature_c", 20.0, 900.0),
    ],
)
def test_what_a_machine_may_have_now_and_then_is_no_dropout(name: str, usual: float, seldom: float) -> None:
    """A line of 16 bar, a vacuum, a hot workpiece: they are what a force may depend on."""
    values = usual + np.sin(TIME_S)
    values[::40] = seldom
    table = {"time_s": TIME_S, "command_v": VOLTS, "force_n": FORCE_N, name: values}
    found = measurement_of(Recording(Path("run.csv"), {}, table, TIME_S.size, False))
    kept = found.covariates.get(name) if found.pressure_pa is None else found.pressure_pa / 1000.0
    np.testing.assert_allclose(kept, values)
    assert not any(f"values of {name}" in note for note in found.notes)


def test_what_is_clean_stays_as_it_is() -> None:
    for clean in (FORCE_N, np.zeros(TIME_S.size), np.full(TIME_S.size, np.nan), np.where(VOLTS > 2.0, 10.0, 0.0)):
        assert dropped(clean) == []


@pytest.mark.parametrize("value", [-9999.0, 9999.0, 32767.0, 1.0e30])
@pytest.mark.parametrize("name", ["command_v", "pressure_kpa"])
def test_what_drives_is_missing_where_a_logger_wrote_no_value(name: str, value: float) -> None:
    """It was simulated as a command: causes were found for it, and the note asked whether it is in mV."""
    drive = VOLTS if name == "command_v" else 100.0 * VOLTS
    spoiled = drive.copy()
    spoiled[1200:1220] = value
    table = {"time_s": TIME_S, "force_n": FORCE_N, name: spoiled}
    found = measurement_of(Recording(Path("run.csv"), {}, table, TIME_S.size, False))
    kept = found.command_v if found.pressure_pa is None else found.pressure_pa / 1000.0
    assert kept is not None and float(np.abs(kept - drive).max()) < 0.5 * float(np.ptp(drive))
    assert f"20 values of {name} are below" in found.notes[0] and "(the first: run.csv, row 1201)" in found.notes[0]
    assert not any("in mV" in note for note in found.notes)
    millivolts = measurement_of(Recording(Path("run.csv"), {}, table | {name: 1.0e3 * drive}, TIME_S.size, False))
    assert not any("are below" in note for note in millivolts.notes), "all of them: that is another unit"


def test_readings_at_the_end_of_the_range_are_in_the_measurement_and_not_judged() -> None:
    force_n = np.minimum(FORCE_N, 26.0)
    found = measurement_of(
        Recording(Path("run.csv"), {}, {"time_s": TIME_S, "command_v": VOLTS, "force_n": force_n}, TIME_S.size, False)
    )
    assert np.array_equal(found.usable, force_n < 26.0)


def test_what_is_missing_is_told_by_the_row_of_the_table_although_others_before_it_are_left_out() -> None:
    table = {
        "time_s": TIME_S.copy(),
        "command_v": VOLTS,
        "force_n": FORCE_N,
        "temperature_c": np.full(TIME_S.size, 20.0),
    }
    table["time_s"][[3, 4]] = np.nan
    table["temperature_c"][1000] = -300.0
    found = measurement_of(Recording(Path("run.csv"), {}, table, TIME_S.size, False))
    assert any("(the first: run.csv, row 1001)" in note for note in found.notes)
