"""`--columns`: which column is which, in which unit; and what is told when it cannot be so."""

from pathlib import Path

import pyarrow as pa
import pytest
from pyarrow import csv, parquet

from gateway.recording import ColumnMapping, ColumnSource, RecordingError, read_table
from gateway.recording.foreign.unit_names import unit_of
from gateway.recording.tables.column_mapping import join_names, quantity_of, select_columns
from gateway.recording.tables.column_names import CONTRACT, DERIVED
from gateway.recording.tables.mapping_file import column_mapping, read_mapping
from gateway.twin.surroundings import COLUMNS
from gateway.units import LINEAR, NEWTON_PER_UNIT, linear_conversion


def test_text_names_number_header_and_unit() -> None:
    assert ColumnMapping.parse("time_s=1:ms, force_n=Kraft:kN,humidity=7").sources == (
        ColumnSource("time_s", 1, "ms"),
        ColumnSource("force_n", "Kraft", "kn"),
        ColumnSource("humidity", 7),
    )


def test_a_file_says_the_same_as_the_text(tmp_path: Path) -> None:
    path = tmp_path / "zillen.yaml"
    path.write_text("time_s: 1:ms\nforce_n: {column: 7, unit: n}\nposition_mm: 5\ntilt_deg: Angle of tool\n")
    text = "time_s=1:ms,force_n=7:n,position_mm=5,tilt_deg=Angle of tool"
    assert column_mapping(str(path)) == column_mapping(text)
    assert column_mapping(None) is None
    assert column_mapping(str(path.rename(tmp_path / "ZILLEN.YAML"))) == column_mapping(text)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time_s", "'time_s' is not NAME=COLUMN"),
        ("", "no column is named"),
        ("time_s=1,time_s=2", "time_s stands twice"),
        ("time_s=1:fortnight", "'fortnight' is no unit for time_s; allowed: s, ms, us, ns, min, h"),
        ("force_n=2:bar", "'bar' is no unit for force_n; allowed: n, mn, kn, kgf, gf, lbf"),
        ("humidity=2:percent", "humidity ends with no unit"),
        ("time_s=:ms", "names no column"),
    ],
)
def test_a_wrong_text_is_told_with_what_is_allowed(text: str, words: str) -> None:
    with pytest.raises(RecordingError, match=r"^--columns: ") as caught:
        ColumnMapping.parse(text)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time_s: [1, 2]\n", "map.yaml:1:9"),
        ("time_s: 1\ntime_s: 2\n", "map.yaml:2:1"),
        ("force_n: {column: 2, units: n}\n", "is no column"),
        ("force_n: 2:bar\n", "map.yaml: 'bar' is no unit"),
        ("force_n: {column: 2, unit: ''}\n", "map.yaml: '' is no unit"),
    ],
)
def test_a_wrong_file_is_told_with_its_place(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "map.yaml").write_text(text)
    with pytest.raises(RecordingError) as caught:
        read_mapping(tmp_path / "map.yaml")
    assert words in str(caught.value)


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="cannot be read: No such file"):
        column_mapping(str(tmp_path / "none.yml"))


def test_unnamed_columns_stay_away_and_others_keep_their_names() -> None:
    names = ("t", "", "humidity", "F")
    found = select_columns(names, ColumnMapping.parse("time_s=t:ms,force_n=4"), "x.csv")
    assert [(pick.index, pick.name) for pick in found] == [(0, "time_s"), (3, "force_n"), (2, "humidity")]


def test_a_mapped_name_wins_over_the_same_header() -> None:
    found = select_columns(("time_s", "force_n", "better"), ColumnMapping.parse("force_n=better"), "x.csv")
    assert [(pick.index, pick.name) for pick in found] == [(2, "force_n"), (0, "time_s")]


@pytest.mark.parametrize(("most", "words"), [(3, "a, b, c"), (2, "a, b and 1 more"), (1, "a and 2 more")])
def test_of_many_names_the_first_are_told_and_how_many_more(most: int, words: str) -> None:
    assert join_names(["a", "b", "c"], most) == words
    assert join_names([]) == "none"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time_s=4", "x.csv: time_s=4: the table has the columns 1 .. 3"),
        ("time_s=0", "the table has the columns 1 .. 3"),
        ("force_n=forze", "no such header; did you mean force?"),
        ("force_n=zzz", "no such header; there: t, force"),
    ],
)
def test_a_column_that_is_not_there_is_told(text: str, words: str) -> None:
    with pytest.raises(RecordingError) as caught:
        select_columns(("t", "force", ""), ColumnMapping.parse(text), "x.csv")
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("quantity", "given", "wanted", "value", "expected"),
    [
        ("time", "ms", "s", 1500.0, 1.5),
        ("time", "min", "s", 2.0, 120.0),
        ("force", "kgf", "n", 1.0, 9.80665),
        ("force", "lbf", "n", 1.0, 4.4482216152605),
        ("pressure", "bar", "kpa", 1.0, 100.0),
        ("pressure", "psi", "kpa", 1.0, 6.894757293168361),
        ("pressure", "mbar", "kpa", 1013.25, 101.325),
        ("length", "um", "mm", 250.0, 0.25),
        ("length", "cm", "mm", 1.0, 10.0),
        ("temperature", "f", "c", 212.0, 100.0),
        ("temperature", "k", "c", 273.15, 0.0),
        ("turning", "hz", "rpm", 200.0, 12000.0),
        ("speed", "m_min", "mm_s", 6.0, 100.0),
        ("angle", "rad", "deg", 3.141592653589793, 180.0),
        ("time", "h", "s", 0.5, 1800.0),
        ("time", "us", "ms", 250.0, 0.25),
        ("force", "gf", "n", 1000.0, 9.80665),
        ("force", "kn", "mn", 1.0, 1.0e6),
        ("voltage", "percent", "v", 50.0, 5.0),
        ("voltage", "mv", "v", 2500.0, 2.5),
        ("pressure", "mpa", "pa", 0.6, 6.0e5),
        ("speed", "mm_min", "mm_s", 60.0, 1.0),
    ],
)
def test_units_by_their_definitions(quantity: str, given: str, wanted: str, value: float, expected: float) -> None:
    factor, offset = linear_conversion(quantity, given, wanted)
    assert factor * value + offset == pytest.approx(expected, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(("unit", "newton"), [("N", 1.0), ("kg", 9.80665), ("g", 0.00980665), ("lb", 4.4482216152605)])
def test_units_of_amplifiers_by_their_definitions(unit: str, newton: float) -> None:
    assert NEWTON_PER_UNIT[unit] == pytest.approx(newton, rel=1e-12)


@pytest.mark.parametrize(
    ("written", "quantity", "unit"), [("hPa", "pressure", "mbar"), ("U/min", "turning", "rpm"), ("Sek", "time", "s")]
)
def test_a_unit_by_another_name_is_that_unit(written: str, quantity: str, unit: str) -> None:
    assert unit_of(written, quantity) == unit


@pytest.mark.parametrize(
    ("written", "quantity"), [("MPA", "pressure"), ("MN", "force"), ("MV", "voltage"), ("MS", "time")]
)
def test_capitals_that_may_be_two_units_are_none(written: str, quantity: str) -> None:
    """A thousand millionths, or a million: 6 MPA are 60 bar, or nothing."""
    assert unit_of(written, quantity) is None


def test_the_same_unit_changes_no_bit() -> None:
    assert {linear_conversion(quantity, unit, unit) for quantity, units in LINEAR.items() for unit in units} == {
        (1.0, 0.0)
    }


def test_the_longest_ending_is_the_unit() -> None:
    assert quantity_of("feed_mm_s") == ("speed", "mm_s")
    assert quantity_of("time_s") == ("time", "s")
    assert quantity_of("oil_temperature_c") == ("temperature", "c")
    assert quantity_of("quality") is None


def test_what_the_twin_knows_of_its_surroundings_stands_in_the_contract_under_the_same_names() -> None:
    assert set(COLUMNS) <= set(CONTRACT)
    assert not set(DERIVED) & set(CONTRACT)


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_a_table_says_the_same_in_either_form_whatever_its_units(tmp_path: Path, suffix: str) -> None:
    """Not a factor alone: a thermometer's zero is elsewhere, and so is a sensor's of 4 to 20 mA; and a sign may be turned."""
    table = pa.table({"t": [0.0, 10.0], "f": [-1.0, -2.0], "p": [4.0, 20.0], "oil": [300.0, 310.0], "c": [32.0, 50.0]})
    path = tmp_path / f"table.{suffix}"
    (csv.write_csv if suffix == "csv" else parquet.write_table)(table, path)
    text = "time_s=t:ms,force_n=f:-n,pressure_kpa=p:4..20=0..10bar,temperature_c=oil:k,cooling_c=c:-f"
    found = read_table(path, ColumnMapping.parse(text)).columns
    assert {name: values.tolist() for name, values in found.items()} == {
        "time_s": pytest.approx([0.0, 0.01]),
        "force_n": [1.0, 2.0],
        "pressure_kpa": pytest.approx([0.0, 1000.0]),
        "temperature_c": pytest.approx([26.85, 36.85]),
        "cooling_c": pytest.approx([0.0, -10.0]),
    }
