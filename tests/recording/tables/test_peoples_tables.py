"""Tables as other programs write them: the same numbers whatever the dialect, or a refusal with the option that works."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import openpyxl
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gateway.recording import Recording, RecordingError, read_table
from gateway.recording.measurement import measurement_of
from gateway.recording.tables import csv_dialect
from gateway.recording.tables.mapping_file import column_mapping
from tests.gate.budgets import examples

NEWTON = {"N": 1.0, "kgf": 9.80665, "mN": 1e-3, "lbf": 4.4482216152605, "kN": 1e3, "g": 9.80665e-3}
SECOND = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "min": 60.0}
KILOPASCAL = {"bar": 100.0, "Pa": 1e-3, "kPa": 1.0, "MPa": 1e3, "mbar": 0.1, "psi": 6.894757293168361}
VOLT = {"V": 1.0, "mV": 1e-3, "%": 0.1}
BEGIN = datetime(2026, 10, 25, 23, 59, 58, tzinfo=UTC)
Rows = list[tuple[float, float, float, float]]


def header(name: str, unit: str, shape: str) -> str:
    return {"()": f"{name} ({unit})", "[]": f"{name} [{unit}]", "/": f"{name} / {unit}", "_": f"{name}_{unit}"}[shape]


def stamp(time_s: float, form: str) -> str:
    at = BEGIN + timedelta(milliseconds=round(time_s * 1e3))
    text = at.isoformat(timespec="milliseconds").removesuffix("+00:00")
    return {
        "iso": text + "Z",
        "zone": (at + timedelta(hours=2)).replace(tzinfo=None).isoformat(timespec="milliseconds") + "+02:00",
        "space": text.replace("T", " "),
        "comma": text.replace("T", " ").replace(".", ","),
        "german": f"{at:%d.%m.%Y %H:%M:%S},{at.microsecond // 1000:03d}",
        "clock": f"{at:%H:%M:%S}.{at.microsecond // 1000:03d}",
    }[form]


@st.composite
def dialects(draw: st.DrawFn) -> dict[str, str]:
    separator, decimal = draw(
        st.sampled_from([(";", ","), ("\t", ","), (",", "."), (";", "."), ("\t", "."), (",", ",")])
    )
    return {
        "separator": separator,
        "decimal": decimal,
        "force": draw(st.sampled_from(list(NEWTON))),
        "time": draw(st.sampled_from([*SECOND, "iso", "zone", "space", "comma", "german", "clock"])),
        "pressure": draw(st.sampled_from(list(KILOPASCAL))),
        "voltage": draw(st.sampled_from(list(VOLT))),
        "shape": draw(st.sampled_from(["()", "[]", "/", "_", "below"])),
        "encoding": draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252"])),
        "end": draw(st.sampled_from(["\n", "\r\n"])),
        "first": draw(st.sampled_from(["", "sep", "title"])),
        "quote": draw(st.sampled_from(["", '"'])),
        "words": draw(
            st.sampled_from(["Time Force Voltage Pressure", "Zeit Kraft Spannung Druck", "ZEIT Force_Ist U p"])
        ),
    }


def write(path: Path, rows: Rows, how: dict[str, str]) -> None:
    """The same rows, in SI, as somebody's logger has them."""
    units = [how["time"], how["force"], how["voltage"], how["pressure"]]
    shape, words = how["shape"], how["words"].split()
    stamped = how["time"] not in SECOND
    heads = (
        words
        if shape == "below"
        else [
            word if stamped and k == 0 else header(word, unit, shape)
            for k, (word, unit) in enumerate(zip(words, units, strict=True))
        ]
    )
    table = [heads, *([["" if stamped else units[0], *units[1:]]] if shape == "below" else [])]
    for time_s, force_n, voltage_v, pressure_kpa in rows:
        table.append(
            [
                stamp(time_s, how["time"])
                if stamped
                else repr(time_s / SECOND[how["time"]]).replace(".", how["decimal"]),
                *(
                    repr(value / factor).replace(".", how["decimal"])
                    for value, factor in (
                        (force_n, NEWTON[how["force"]]),
                        (voltage_v, VOLT[how["voltage"]]),
                        (pressure_kpa, KILOPASCAL[how["pressure"]]),
                    )
                ),
            ]
        )
    separator, quote = how["separator"], how["quote"] or ('"' if how["separator"] == "," == how["decimal"] else "")
    if separator == "," and how["time"] in ("comma", "german"):
        quote = '"'
    lines = [separator.join(f"{quote}{cell}{quote}" if cell else "" for cell in cells) for cells in table]
    lines = {"": [], "sep": [f"sep={separator}"], "title": ["Messung an Zelle 4", "Ann"]}[how["first"]] + lines
    path.write_bytes((how["end"].join(lines) + how["end"]).encode(how["encoding"]))


def assert_rows(recording: Recording, rows: Rows) -> None:
    expected = np.array(rows)
    for k, name in enumerate(("time_s", "force_n", "command_v", "pressure_kpa")):
        values = recording.columns[name] - (recording.columns[name][0] if k == 0 else 0.0)
        wanted = expected[:, k] - (expected[0, 0] if k == 0 else 0.0)
        np.testing.assert_allclose(values, wanted, rtol=1e-12, atol=1e-9, err_msg=name)


values = st.integers(-40_000, 40_000).map(lambda value: value / 512 + 1 / 3)
tables = st.lists(st.tuples(st.integers(1, 2000), values, values, values), min_size=2, max_size=6).map(
    lambda rows: [(sum(row[0] for row in rows[: k + 1]) / 1000, *row[1:]) for k, row in enumerate(rows)]
)


@given(rows=tables, how=dialects())
@settings(max_examples=examples(80), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_the_same_table_in_any_dialect_gives_the_same_numbers(rows: Rows, how: dict[str, str], tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    write(path, rows, how)
    assert_rows(read_table(path), rows)


def test_columns_taken_by_their_headers_are_told(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("Zeit [ms];Kraft [kgf];Spannung [V]\n0;1,0;2,5\n5;2,0;2,5\n")
    recording = read_table(path)
    np.testing.assert_allclose(recording.columns["force_n"], [9.80665, 19.6133])
    (note,) = recording.notes
    assert "'Zeit [ms]' as time_s, 'Kraft [kgf]' as force_n, 'Spannung [V]' as command_v; --columns says" in note
    assert recording.header["force_unit"] == "N"


@pytest.mark.parametrize(
    ("head", "option"),
    [
        (
            "Time,Force,Voltage",
            "--columns time_s=1:s,force_n=2:n,command_v=3:v (the unit of column 1 is nowhere: s, ms, us, ns",
        ),
        ("Time [min],Force 1 [kgf],Voltage (V)", "--columns force_n=2:kgf"),
        (
            "Zeit (s),Kraft [mV],Druck [mA]",
            "--columns force_n=2:0..10=0..100n,pressure_kpa=3:4..20=0..100kpa (column 2",
        ),
        ("Zeit (s),Kraft [MN],Spannung (V)", "force_n=2:0..10=0..100n (column 2 is in MN"),
        ("a,b,c", "Say which is which: --columns time_s=1:s,command_v=2:v,force_n=3:n, or :ms, :mv, :kgf"),
    ],
)
def test_what_is_not_understood_is_refused_with_the_option_that_works(head: str, option: str, tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text(head + "\n" + "".join(f"{k / 100},{k % 7},{k % 5}\n" for k in range(400)))
    with pytest.raises(RecordingError) as caught:
        measurement_of(read_table(path))
    assert option in str(caught.value)
    if "Meant" in str(caught.value):
        said = str(caught.value).partition("--columns ")[2].split(" ")[0]
        measurement = measurement_of(read_table(path, column_mapping(said)))
        assert measurement.force_n.size == 400
        assert measurement.command_v is not None or measurement.pressure_pa is not None


def test_two_columns_that_may_both_be_the_force_are_a_question(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("time_s,Force (N),Load (kg)\n0,1,2\n1,2,3\n")
    recording = read_table(path)
    assert "force_n" not in recording.columns
    assert "force_n=2:n" in recording.suggestion


def test_a_mapping_takes_the_unit_from_the_header_and_refuses_one_that_cannot_be(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("t [ms];Last 1 [kgf];Last 2 [mV]\n0;1;4\n5;2;8\n")
    np.testing.assert_allclose(read_table(path, column_mapping("force_n=2")).columns["force_n"], [9.80665, 19.6133])
    assert read_table(path, column_mapping("force_n=2:n")).columns["force_n"].tolist() == [1.0, 2.0]
    with pytest.raises(
        RecordingError, match=r"its header says mV; say what a range of it means, such as force_n=3:0..10"
    ):
        read_table(path, column_mapping("force_n=3"))
    scaled = read_table(path, column_mapping("force_n=3:4..20=0..2kgf"))
    np.testing.assert_allclose(scaled.columns["force_n"], [0.0, 0.5 * 9.80665])


@pytest.mark.parametrize("text", ["4..4=0..1", "4..20", "a..b=0..1", "4..20=0..1fortnight", "4..20=5..5"])
def test_a_range_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(RecordingError, match=r"^--columns: "):
        column_mapping(f"pressure_kpa=3:{text}")


def test_a_clock_goes_on_through_midnight_and_slashes_are_a_question(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("Time,force_n\n23:59:59.5,1\n0:00:00.5,2\n")
    assert read_table(path).columns["time_s"].tolist() == [0.0, 1.0]
    path.write_text("time_s,force_n\n11/12/2026 10:00:00,1\n11/12/2026 10:00:01,2\n")
    with pytest.raises(RecordingError, match="may be two days: write dates as 2026-11-22T10"):
        read_table(path)


def test_spaces_separate_where_nothing_else_does(tmp_path: Path) -> None:
    path = tmp_path / "table.txt"
    path.write_text("time_s force_n\n  0.0   1.5\n 0.1 2.5\n")
    assert read_table(path).columns["force_n"].tolist() == [1.5, 2.5]
    path.write_text("  0.0   1.5\n 0.1 2.5\n")
    assert read_table(path, column_mapping("time_s=1,force_n=2")).columns["force_n"].tolist() == [1.5, 2.5]


def test_thousands_are_not_taken_for_decimals(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text('time_s,force_n\n0.5,"1,234"\n1.5,"1,235"\n')
    with pytest.raises(RecordingError, match="'1,234' is no number"):
        read_table(path)


def test_a_million_columns_or_one_endless_line_are_refused_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "table.csv"
    path.write_text(",".join(["a"] * 5000) + "\n" + ",".join(["1"] * 5000) + "\n")
    with pytest.raises(RecordingError, match="5000 columns: at most 4096 are read"):
        read_table(path)
    monkeypatch.setattr(csv_dialect, "LONGEST_LINE", 1000)
    path.write_text("time_s,force_n\n0,1\n" + "1" * 3000)
    with pytest.raises(RecordingError, match="line 3 has a million characters or more"):
        read_table(path)


@pytest.mark.parametrize("form", ["iso", "numbers"])
def test_a_workbook_gives_the_same_numbers(form: str, tmp_path: Path) -> None:
    rows = [(0.25 * k, 1.5 * k - 2.0, 0.5 * k, 10.0 + k) for k in range(5)]
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(["Versuch 7"])
    sheet.append(["Zeit" if form == "iso" else "Zeit (ms)", "Kraft [N]", "Spannung [V]", "Druck [bar]"])
    for time_s, *others, pressure_kpa in rows:
        time = BEGIN.replace(tzinfo=None) + timedelta(seconds=time_s) if form == "iso" else time_s * 1e3
        sheet.append([time, *others, pressure_kpa / 100])
    book.create_sheet("Second").append(["time_s", "force_n"])
    book["Second"].append([1, 2])
    book.save(tmp_path / "table.xlsx")
    recording = read_table(tmp_path / "table.xlsx")
    assert_rows(recording, rows)
    assert "sheet 'Sheet' was read; --sheet takes another: Second" in recording.notes[0]
    assert recording.place(0).endswith("table.xlsx:3")
    for sheet_name in ("Second", "2"):
        other = read_table(tmp_path / "table.xlsx", column_mapping(f"sheet={sheet_name}"))
        assert other.columns["force_n"].tolist() == [2.0]
    with pytest.raises(RecordingError, match="has no sheet 'Secnd'; did you mean 'Second'"):
        read_table(tmp_path / "table.xlsx", column_mapping("sheet=Secnd,force_n=2"))


def test_a_quote_that_nobody_closes_is_no_table_and_no_defect(tmp_path: Path) -> None:
    path = tmp_path / "torn.csv"
    path.write_text('time_s,command_v,force_n\n"' + "1," * 100_000 + "\n")
    with pytest.raises(RecordingError, match="line 2 has quotes and 200002 characters"):
        read_table(path)


@pytest.mark.parametrize("first", [0, 300])
@pytest.mark.parametrize("separator", ["\t", ";"])
def test_a_comma_of_thousands_beside_decimal_points_is_no_number(separator: str, first: int, tmp_path: Path) -> None:
    """As Excel copies cells with a format: 1,234 N were read as 1.234 N."""
    rows = [f"{k / 100:.2f};2.5;{'1,234' if k >= first and k % 7 == 0 else 900 + k}" for k in range(400)]
    path = tmp_path / "table.txt"
    path.write_text(
        "time_s;command_v;force_n\n".replace(";", separator) + "\n".join(rows).replace(";", separator) + "\n"
    )
    with pytest.raises(
        RecordingError, match=rf"table.txt:{first + 2 + -first % 7}, column force_n .*: '1,234' is no number"
    ):
        read_table(path)
    assert "'1,234' is no number" in read_table(path, lenient=True).notes[0]


def test_a_decimal_comma_stays_one_beside_a_version_and_behind_whole_numbers(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("time_s;force_n;version\n0,01;1,234;1.2\n0,02;2,345;1.2\n")
    np.testing.assert_allclose(read_table(path).columns["force_n"], [1.234, 2.345])
    path.write_text("time_s;force_n\n" + "".join(f"{k};{k}\n" for k in range(300)) + "300;1,5\n")
    assert read_table(path).columns["force_n"][-1] == 1.5


def test_a_table_of_which_every_row_is_left_out_is_told_why(tmp_path: Path) -> None:
    """`fit`, which leaves rows out, said '0 rows: a ladder goes up and down in stairs'."""
    path = tmp_path / "table.csv"
    path.write_text("time_s,force_n\n0,5,1,2\n0,6,1,3\n0,7,1,4\n")
    with pytest.raises(RecordingError, match=r"no row can be read: line 2 has 4 cells, the header 2 .*decimal commas"):
        read_table(path, lenient=True)


def test_a_row_that_is_commented_out_is_no_row(tmp_path: Path) -> None:
    """Beside a first column of words it reads like any other."""
    rows = [f"ok,{0.01 * k:.2f},1.0,{7.0 + k}" for k in range(80)]
    rows[40:40] = ["#bad,0.395,1.0,-9999"]
    (tmp_path / "a.csv").write_text("\n".join(["what,time_s,command_v,force_n", *rows]) + "\n")
    read = read_table(tmp_path / "a.csv")
    assert (read.rows, float(read.columns["force_n"].min())) == (80, 7.0)
