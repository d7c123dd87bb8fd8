"""What stands above the rows of a table, between them and in place of numbers: titles, comments, units, words; long tables."""

from pathlib import Path

import pytest

from gateway.recording import RecordingError, read_table
from gateway.recording.tables import csv_table
from gateway.recording.tables.column_mapping import ColumnMapping
from gateway.recording.tables.csv_dialect import detect_dialect

HEAD = "time_s,command_v,force_n"


def table(tmp_path: Path, *lines: str) -> Path:
    path = tmp_path / "table.csv"
    path.write_text("\n".join((*lines, "")))
    return path


def rows(number: int) -> list[str]:
    return [f"{k / 100},{k % 5},{k}" for k in range(number)]


def test_sixty_lines_of_a_report_may_stand_above_the_header(tmp_path: Path) -> None:
    found = read_table(table(tmp_path, *["Report of a cell"] * 60, HEAD, *rows(200)))
    assert (found.rows, found.notes) == (200, ("60 lines before the header (line 61) were left out",))
    with pytest.raises(RecordingError):
        read_table(table(tmp_path, *["Report of a cell"] * 61, HEAD, *rows(200)))


LABVIEW = (
    "LabVIEW Measurement\t", "Separator\tTab", "Time_Pref\tRelative", "***End_of_Header***\t", "", "Channels\t2\t\t",
    "Samples\t200\t200\t", "X_Dimension\tTime\tTime\t", "X0\t0.0\t0.0\t", "***End_of_Header***\t\t\t",
)  # fmt: skip


def test_of_a_labview_measurement_the_rows_are_read_and_not_what_it_tells_of_each_channel(tmp_path: Path) -> None:
    """Its lines are as wide as the rows: `a column name stands twice in the header: 200`."""
    lines = [f"{row}," for row in rows(200)]
    text = [line.replace(",", "\t") for line in ("X_Value,command_v,force_n,Comment", *lines)]
    found = read_table(table(tmp_path, *LABVIEW, *text), ColumnMapping.parse("time_s=X_Value:s"))
    assert (found.rows, found.columns["force_n"][-1]) == (200, 199.0)
    assert "LabVIEW's lines before the header (line 11) were left out" in found.notes
    assert found.place(0).endswith(":12")


def test_of_a_date_beside_a_time_of_day_the_one_that_goes_on_is_the_time(tmp_path: Path) -> None:
    """The date was suggested for it."""
    lines = [f"2026-11-30,10:00:{k:02d},{k % 5},{k}" for k in range(60)]
    found = read_table(table(tmp_path, "Date,Time,command_v,force_n", *lines))
    assert found.columns["time_s"].tolist() == [float(k) for k in range(60)]
    other = detect_dialect(table(tmp_path, "Date,Time of day,command_v,force_n", *lines))
    assert other.headers().suggest() == "Meant is probably --columns time_s=2"


def test_what_a_comment_says_begins_behind_its_first_colon(tmp_path: Path) -> None:
    found = read_table(table(tmp_path, "# started_utc: 2026-11-22T10:31:47Z", HEAD, *rows(3)))
    assert found.header["started_utc"] == "2026-11-22T10:31:47Z"


@pytest.mark.parametrize("between", ["", "# a comment"])
def test_a_row_of_units_may_stand_apart_from_its_header(between: str, tmp_path: Path) -> None:
    found = read_table(table(tmp_path, "Time,Voltage,Force", between, "s,V,N", *rows(3)))
    assert found.columns["force_n"].tolist() == [0.0, 1.0, 2.0]
    assert found.place(0).endswith(":4")


def test_a_table_that_is_read_piece_by_piece_has_all_of_its_rows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As of a day, read line by line for its comments."""
    monkeypatch.setattr(csv_table, "_CELLS_AT_ONCE", 12)
    found = read_table(table(tmp_path, HEAD, *rows(50), "# a pause", *rows(51)[50:]))
    assert found.columns["force_n"].tolist() == [float(k) for k in range(51)]
    assert [found.place(row).rpartition(":")[2] for row in (0, 49, 50)] == ["2", "51", "53"]


@pytest.mark.parametrize(("words", "is_column"), [(6, False), (4, True)])
def test_a_column_is_one_of_words_where_most_of_its_cells_are(words: int, is_column: bool, tmp_path: Path) -> None:
    cells = ["on"] * words + [str(k) for k in range(10 - words)]
    found = read_table(
        table(tmp_path, f"{HEAD},lamp", *(f"{row},{cell}" for row, cell in zip(rows(10), cells, strict=True)))
    )
    assert ("lamp" in found.columns) is is_column
    assert any("columns of words, not numbers: lamp" in note for note in found.notes) is not is_column


def test_of_many_notes_three_are_told_and_how_many_more() -> None:
    notes = [f"line {k}" for k in range(5)]
    told = [csv_table.shorten_notes(notes[:count], "such lines")[-1] for count in (3, 4, 5)]
    assert told == ["line 2", "and 1 more such lines", "and 2 more such lines"]


@pytest.mark.parametrize("word", ["#N/A", "#NV", "1.#QNAN", "-1.#IND", "-nan(ind)"])
@pytest.mark.parametrize("is_fast", [True, False])
def test_what_a_program_writes_for_no_number_is_none(
    word: str, is_fast: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Excel says it in its own language, Windows in its library's."""
    if not is_fast:
        monkeypatch.setattr(csv_table, "_read_fast", lambda *_: None)
    cells = [f"{k / 100},1.0,{word if k == 7 else 5 + k}" for k in range(80)]
    force_n = read_table(table(tmp_path, HEAD, *cells)).columns["force_n"]
    assert [k for k, value in enumerate(force_n) if value != value] == [7] and force_n[8] == 13.0
