"""The unit of a force that the comments of a table say: one for whoever reads the table, a fit or a diagnosis."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet as pq

from gateway.recording import RecordingError, read_table
from gateway.recording.measurement import measurement_of
from gateway.recording.tables.mapping_file import column_mapping

KGF = 9.80665
ROWS = "".join(f"{k / 100},{k % 5},{k % 7}\n" for k in range(400))


def table(tmp_path: Path, unit: str, head: str = "time_s,command_v,force_n") -> Path:
    path = tmp_path / "table.csv"
    path.write_text(f"# force_unit: {unit}\n{head}\n{ROWS}")
    return path


@pytest.mark.parametrize("unit", ["kgf", "KGF", "kg", "Kg", "kp"])
def test_a_unit_in_the_comments_counts_for_the_diagnosis_too(unit: str, tmp_path: Path) -> None:
    recording = read_table(table(tmp_path, unit))
    measured = measurement_of(recording)
    np.testing.assert_allclose(measured.force_n[:4], [0.0, KGF, 2 * KGF, 3 * KGF])
    assert recording.header["force_unit"] == "N" and recording.factors == {"force_n": KGF}
    assert f"forces are in {unit} and were turned into newtons (1 {unit} = 9.8066 N)" in measured.notes


@pytest.mark.parametrize("unit", ["N", "n", "newton", ""])
def test_newtons_stay_as_they_are(unit: str, tmp_path: Path) -> None:
    recording = read_table(table(tmp_path, unit))
    assert recording.columns["force_n"][:3].tolist() == [0.0, 1.0, 2.0]
    assert recording.factors == {} and recording.notes == ()


def test_metadata_of_parquet_counts_as_well(tmp_path: Path) -> None:
    path = tmp_path / "table.parquet"
    columns = pa.table({"time_s": [0.0, 0.1], "force_n": [1.0, 2.0], "command_v": [1.0, 1.0]})
    pq.write_table(columns.replace_schema_metadata({"force_unit": "lbf"}), path)
    np.testing.assert_allclose(read_table(path).columns["force_n"], [4.4482216152605, 8.896443230521])


@pytest.mark.parametrize(
    ("head", "mapping", "factor"),
    [
        ("time_s,command_v,Kraft [mN]", None, 1.0e-3),
        ("time_s,command_v,f", "force_n=f:n", 1.0),
        ("time_s,command_v,f", "force_n=f", KGF),
    ],
)
def test_what_a_header_or_a_mapping_says_counts_more(
    head: str, mapping: str | None, factor: float, tmp_path: Path
) -> None:
    recording = read_table(table(tmp_path, "kgf", head), column_mapping(mapping))
    np.testing.assert_allclose(recording.columns["force_n"][1], factor)


@pytest.mark.parametrize("unit", ["stone", "MN"])
def test_a_unit_that_is_none_of_force_is_refused_with_what_is_there(unit: str, tmp_path: Path) -> None:
    path = table(tmp_path, unit)
    with pytest.raises(
        RecordingError, match=rf"table.csv: its comments say force_unit: {unit}, which is none of n, mn, kn"
    ):
        read_table(path)
    assert read_table(path, column_mapping("force_n=force_n:n")).columns["force_n"][1] == 1.0


def test_a_row_of_units_that_says_nothing_leaves_the_unit_of_the_header(tmp_path: Path) -> None:
    """`-` stands there for none, or for what the header says already."""
    path = tmp_path / "table.csv"
    path.write_text(f"Time,Voltage [V],Force [kgf]\ns,-,-\n{ROWS}")
    np.testing.assert_allclose(read_table(path).columns["force_n"][:3], [0.0, KGF, 2 * KGF])


@pytest.mark.parametrize("last", ["gr\xfc", "gr\xfcn", "\xfc"])
def test_a_table_that_ends_with_a_letter_of_windows_is_read_as_that(last: str, tmp_path: Path) -> None:
    """A whole file does not end amid a letter, as a piece of it may."""
    path = tmp_path / "table.csv"
    rows = "".join(f"{k},{k},ja\n" for k in range(9))
    path.write_bytes(f"time_s,force_n,note\n{rows}9,9,{last}".encode("cp1252"))
    recording = read_table(path)
    assert recording.rows == 10 and any("Windows-1252" in note for note in recording.notes)
