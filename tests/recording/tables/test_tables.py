"""Tables of every shape give the same numbers, and what is no table is told by row and column."""

import gzip
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gateway.recording import ColumnMapping, Recorder, RecordingError, export_csv, export_parquet, read_recording
from gateway.recording.tables import csv_table
from gateway.recording.tables.any_table import read_table
from gateway.recording.tables.column_mapping import select_columns
from gateway.recording.tables.csv_dialect import detect_dialect
from gateway.recording.tables.csv_table import read_csv
from tests.gate.budgets import examples

ROWS = [(0.0, 1.5, -0.25), (0.005, 1.5, 3.75), (0.01, 2.25, float("nan"))]
NAMES = ("time_s", "command_v", "force_n")


def text_of(separator: str = ",", decimal: str = ".", head: bool = True, end: str = "\n") -> str:
    lines = [separator.join(NAMES)] if head else []
    lines += [separator.join(str(value).replace(".", decimal) for value in row) for row in ROWS]
    return end.join(lines) + end


def same(columns: dict[str, np.ndarray]) -> None:
    for k, name in enumerate(NAMES):
        np.testing.assert_array_equal(columns[name], [row[k] for row in ROWS])


@pytest.mark.parametrize(
    "text",
    [
        text_of(),
        text_of(";"),
        text_of("\t"),
        text_of(";", ","),
        text_of("\t", ","),
        text_of(end="\r\n"),
        text_of(end="\r"),
        "\ufeff" + text_of(),
        "# rig: demo\n# a remark\n\n" + text_of(),
        text_of() + "\n\n",
        text_of().rstrip("\n"),
        text_of().replace("nan", ""),
        text_of().replace("nan", "NULL"),
        text_of().replace("nan", " - "),
        text_of().replace("\n0.005", "\n# tool: changed\n\n0.005"),
        text_of(end=",\n"),
        text_of().replace("1.5", '"1.5"'),
        text_of().replace("3.75", "+3.75"),
        text_of().replace("3.75", " 375e-2 "),
    ],
)
def test_every_shape_of_csv_gives_the_same_numbers(text: str, tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_bytes(text.encode())
    recording = read_table(path)
    same(recording.columns)
    assert (recording.rows, recording.notes, recording.truncated) == (3, (), False)


@pytest.mark.parametrize(("separator", "decimal"), [(",", "."), (";", ","), ("\t", ",")])
def test_a_table_without_header_is_read_by_a_mapping_and_refused_without(
    separator: str, decimal: str, tmp_path: Path
) -> None:
    path = tmp_path / "table.csv"
    path.write_text(text_of(separator, decimal, head=False))
    same(read_table(path, ColumnMapping.parse("time_s=1,command_v=2,force_n=3")).columns)
    with pytest.raises(RecordingError, match=r"table.csv:1: no header row.*--columns .*the table has 3 columns"):
        read_table(path)


def test_units_are_converted_and_unnamed_columns_left_out(tmp_path: Path) -> None:
    path = tmp_path / "zillen.csv"
    path.write_text("0.000\t3.4\t0.5\t1.08\t-4.000\t0.995\t50.2\t\r\n276.000\t3.5\t0.5\t1.13\t2.000\t1.020\t52.6\t\r\n")
    columns = read_table(
        path, ColumnMapping.parse("time_s=1:ms,position_mm=5:mm,pressure_kpa=6:bar,force_n=7:n")
    ).columns
    assert {name: values.round(9).tolist() for name, values in columns.items()} == {
        "time_s": [0.0, 0.276],
        "position_mm": [-4.0, 2.0],
        "pressure_kpa": [99.5, 102.0],
        "force_n": [50.2, 52.6],
    }


def test_other_numbers_stay_under_their_own_names_and_words_go(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("t,F,operator,humidity\n0,1,Ann,40\n1,2,Bob,41\n")
    recording = read_table(path, ColumnMapping.parse("time_s=t,force_n=F"))
    assert list(recording.columns) == ["time_s", "force_n", "humidity"]
    assert recording.notes == ("columns of words, not numbers: operator",)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "time_s,force_n\n0,1\n1,abc\n",
            "(the 2. of the table): 'abc' is no number; where nothing was read, leave the cell empty",
        ),
        ("# note: x\ntime_s,force_n\n\n0,1\n1;2,3\n", "table.csv:5, column time_s"),
        ("time_s,force_n\n0,1\n1\n2,3\n", "table.csv:3: 1 cells, the header 2"),
        ("time_s,force_n\n0,1\n1,2,3\n2,3\n", "table.csv:3: 3 cells, the header 2"),
        ("time_s,force_n\n0,5,1,2\n0,6,1,3\n0,7,1,4\n", "2: 4 cells, the header 2 (decimal commas beside commas?"),
        ("time_s;force_n\n0;1\n1;2;3\n2;3\n", "table.csv:3: 3 cells, the header 2$"),
        ("time_s,force_n,force_n\n0,1,2\n", "a column name stands twice in the header: force_n"),
        ("time_s,force_n\n0,1_0\n", "'1_0' is no number"),
        ("time_s,force_n\n0,1\n1,2\n2,\ufffd\n", "table.csv:4, column force_n"),
        ("# only: comments\n", "holds no table"),
        ("", "is an empty file, not a recording"),
        ("\n\n", "holds no table"),
    ],
)
def test_what_cannot_be_read_is_told_by_row_and_column(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text(text)
    with pytest.raises(RecordingError) as caught:
        read_table(path)
    assert words in f"{caught.value}$"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (gzip.compress(b"time_s,force_n\n", mtime=0), "gzip"),
        (b"PK\x03\x04\x14\x00\x06\x00", "damaged Excel workbook or zip file"),
        (b"\x89PNG\r\n\x1a\n\x00", "is a PNG picture, not a recording (.fgr, CSV, Parquet or .xlsx)"),
        (
            b"TDSm\x0e\x00\x00\x00",
            "TDMS file (LabVIEW, DIAdem), not a recording (.fgr, CSV, Parquet or .xlsx): export it",
        ),
        (b'{"verdict": "known"}', "is a JSON document, not a recording"),
        (
            b"MATLAB 5.0 MAT-file",
            "MATLAB file (.mat), not a recording (.fgr, CSV, Parquet or .xlsx): in MATLAB: writetable",
        ),
        (b"\x00\x01\x02\x03\n", "no text"),
        (b"PAR1 and nothing more", "damaged Parquet"),
        (b"\x89FGR1\r\n\n", "ends inside its header"),
    ],
)
def test_other_files_are_told_for_what_they_are(content: bytes, words: str, tmp_path: Path) -> None:
    path = tmp_path / "file.csv"
    path.write_bytes(content)
    with pytest.raises(RecordingError) as caught:
        read_table(path)
    assert words in f"{caught.value}$"


def test_a_directory_is_told_to_be_one(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="is a directory: name the recording in it"):
        read_table(tmp_path)


def test_a_torn_last_line_is_left_out_and_told(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("time_s,force_n\n0,1\n1,2\n2")
    recording = read_table(path)
    assert recording.rows == 2
    assert recording.notes == ("line 4, the last, is torn: 1 of 2 cells; it was left out",)


def test_lenient_tells_what_strict_refuses(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("time_s,force_n\n0,1\n1\n2,abc\n3,4\n")
    recording = read_table(path, lenient=True)
    np.testing.assert_array_equal(recording.columns["force_n"], [1.0, np.nan, 4.0])
    assert recording.notes == ("line 3 has 1 cells, the header 2: left out", "line 4, force_n: 'abc' is no number")
    assert [recording.place(row) for row in range(3)] == [f"{path}:{line}" for line in (2, 4, 5)]


def test_a_word_in_a_covariate_is_no_reason_to_refuse(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("time_s,force_n,humidity\n0,1,40\n1,2,ERR\n2,3,41\n")
    recording = read_table(path)
    assert recording.notes == ("line 3, humidity: 'ERR' is no number (1 such cells): not known there",)
    np.testing.assert_array_equal(recording.columns["humidity"], [40.0, np.nan, 41.0])


def test_quality_may_be_said_in_words(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("time_s,force_n,quality\n0,1,ok\n1,2,OVERLOAD\n2,3,unstable\n")
    assert read_table(path).columns["quality"].tolist() == [0.0, 2.0, 1.0]


cells = st.one_of(
    st.floats(width=64).map(repr),
    st.floats(-1e3, 1e3).map(lambda value: f"{value:.4f}"),
    st.sampled_from(["", "nan", "NaN", "null", "-", "1e3", "-0", " 7 ", ".5", "5."]),
)


@given(rows=st.lists(st.tuples(cells, cells, cells), min_size=1, max_size=12), separator=st.sampled_from(",;\t"))
@settings(max_examples=examples(60), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_the_fast_way_and_the_exact_way_agree(rows: list[tuple[str, ...]], separator: str, tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text(separator.join(NAMES) + "\n" + "".join(separator.join(row) + "\n" for row in rows))
    form = detect_dialect(path)
    chosen = select_columns(form.names, None, "x")
    fast, exact = csv_table._read_fast(form, chosen), csv_table._LineReader(form, chosen, lenient=False).read()
    if fast is not None:
        assert list(fast.lines) == list(exact.lines)
        for k in range(3):
            np.testing.assert_array_equal(fast.columns[k], exact.columns[k])


def test_a_clean_table_goes_the_fast_way(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("# rig: demo\n" + text_of(";", ","))
    form = detect_dialect(path)
    assert csv_table._read_fast(form, select_columns(form.names, None, "x")) is not None


def test_more_numbers_than_fit_are_refused_before_they_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "table.csv"
    path.write_text(text_of() * 1)
    monkeypatch.setattr(csv_table, "LARGEST_CELLS", 8)
    with pytest.raises(RecordingError, match="4 rows of 3 columns are more than 8 numbers"):
        read_csv(path)


@pytest.fixture
def gateway_file(tmp_path: Path) -> Path:
    recorder = Recorder(tmp_path / "recordings", {"rig": "demo", "rig_texts": {"a.yaml": "name: a\n"}}, NAMES)
    for row in ROWS:
        recorder.append(row)
    recorder.close()
    return recorder.path


@pytest.mark.parametrize(("suffix", "export"), [("csv", export_csv), ("parquet", export_parquet)])
def test_what_was_exported_reads_back(
    suffix: str, export: Callable[..., None], gateway_file: Path, tmp_path: Path
) -> None:
    target = tmp_path / f"out.{suffix}"
    export(replace(read_recording(gateway_file), truncated=True, notes=("torn tail",)), target)
    recording = read_table(target)
    same(recording.columns)
    assert recording.header["rig"] == "demo"
    assert "columns" not in recording.header
    assert "torn tail" in str(recording.notes) or recording.header.get("dropped") == "torn tail"


def test_our_own_format_takes_a_mapping_too(gateway_file: Path) -> None:
    recording = read_table(gateway_file, ColumnMapping.parse("force_n=3:kn"))
    assert recording.columns["force_n"][1] == pytest.approx(3750.0)
    same(read_table(gateway_file).columns)


def test_a_parquet_file_whose_names_are_no_text_is_a_sentence(tmp_path: Path) -> None:
    path = tmp_path / "table.parquet"
    pq.write_table(pa.table({"time_s": [0.0, 0.1], "force_n": [1.0, 2.0]}), path, store_schema=False)
    path.write_bytes(path.read_bytes().replace(b"force_n", b"\xffo\xeece_n"))
    with pytest.raises(RecordingError, match="damaged Parquet"):
        read_table(path)


def test_of_two_parquet_columns_of_one_name_the_one_is_read_that_was_picked(tmp_path: Path) -> None:
    """The advice to pick one led to an internal error."""
    path = tmp_path / "table.parquet"
    pq.write_table(pa.table([[0.0, 0.1], [1.0, 2.0], [3.0, 4.0]], names=["time_s", "force_n", "force_n"]), path)
    with pytest.raises(RecordingError, match="stands twice in the header: force_n; pick one with --columns"):
        read_table(path)
    for place, first in ((2, 1.0), (3, 3.0)):
        assert read_table(path, ColumnMapping.parse(f"force_n={place}:n")).columns["force_n"][0] == first


def test_parquet_of_others_is_read_by_what_its_columns_are(tmp_path: Path) -> None:
    path = tmp_path / "table.parquet"
    stamps = np.array([1_700_000_000_000_000, 1_700_000_000_005_000], dtype="datetime64[us]")
    table = pa.table(
        {
            "stamp": stamps,
            "F": pa.array([1, None], pa.int16()),
            "valve": pa.array([2.5, 3.5], pa.float32()),
            "on": [True, False],
            "who": ["Ann", "Bob"],
        }
    )
    pq.write_table(table.replace_schema_metadata({"rig": "cell 4"}), path)
    recording = read_table(path, ColumnMapping.parse("time_s=stamp,force_n=2:kn,command_v=valve"))
    np.testing.assert_array_equal(recording.columns["time_s"], [0.0, 0.005])
    np.testing.assert_array_equal(recording.columns["force_n"], [1000.0, np.nan])
    np.testing.assert_array_equal(recording.columns["on"], [1.0, 0.0])
    assert recording.notes == ("columns that hold no numbers: who",)
    assert recording.header == {"rig": "cell 4", "force_unit": "N"}
    assert recording.place(1) == f"{path}, row 2"
    with pytest.raises(RecordingError, match=r"column force_n holds string, not numbers: convert it \(pandas: astype"):
        read_table(path, ColumnMapping.parse("force_n=who"))
