"""Workbooks that are damaged, hostile or something else cost a sentence, and neither memory nor time."""

import zipfile
from pathlib import Path

import openpyxl
import pytest

from gateway.recording import RecordingError, read_table
from gateway.recording.foreign import workbook


@pytest.fixture
def book(tmp_path: Path) -> Path:
    made = openpyxl.Workbook()
    made.active.append(["time_s", "force_n", "command_v"])
    for k in range(3):
        made.active.append([0.1 * k, None if k == 1 else 1.5, "#DIV/0!" if k == 2 else 2.5])
    path = tmp_path / "table.xlsx"
    made.save(path)
    return path


def with_part(path: Path, name: str, data: bytes) -> Path:
    """The workbook with one part exchanged."""
    target = path.with_name("changed.xlsx")
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as new:
        for part in old.namelist():
            if part != name:
                new.writestr(part, old.read(part))
        new.writestr(name, data)
    return target


def refused(path: Path) -> str:
    with pytest.raises(RecordingError) as caught:
        read_table(path)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_empty_cells_and_faults_are_no_numbers(book: Path) -> None:
    columns = read_table(book).columns
    assert [str(value) for value in columns["force_n"]] == ["1.5", "nan", "1.5"]
    assert [str(value) for value in columns["command_v"]] == ["2.5", "2.5", "nan"]


def test_a_cell_of_excel_without_a_value_is_none_and_a_row_may_end_before_the_others(tmp_path: Path) -> None:
    """`#N/A` is what NA() writes; cells at the end of a row that are empty are not there."""
    made = openpyxl.Workbook()
    for row in (["time_s", "command_v", "force_n"], [0.0, 2.5, "#N/A"], [0.1], [0.2, 2.5]):
        made.active.append(row)
    made.save(tmp_path / "table.xlsx")
    target = tmp_path / "sheet.txt"
    workbook.write_sheet(tmp_path / "table.xlsx", None, target)
    assert target.read_text().splitlines()[1:] == ["0\t2.5\tnan", "0.1\t\t", "0.2\t2.5\t"]


def test_a_part_that_unpacks_to_more_than_is_taken_is_refused_before_it_is_read(book: Path) -> None:
    bomb = with_part(book, "xl/sharedStrings.xml", b" " * (workbook.LARGEST_PART_BYTES + 1))
    assert bomb.stat().st_size < 100_000
    assert "its part xl/sharedStrings.xml is 32 MB unpacked, allowed 32 MB: save the sheet as CSV" in refused(bomb)


def test_rows_that_never_end_are_refused(book: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workbook, "LONGEST_ROWS", 1000)
    head = b'<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>'
    far = b'<row r="999999999999"><c r="A999999999999"><v>1</v></c></row></sheetData></worksheet>'
    assert "row 1001 of 0 columns: a sheet has at most" in refused(
        with_part(book, "xl/worksheets/sheet1.xml", head + far)
    )


@pytest.mark.parametrize("entity", [b'<!ENTITY a "aaaaaaaaaa">', b'<!ENTITY a SYSTEM "file:///etc/hostname">'])
def test_entities_are_not_unfolded(entity: bytes, book: Path) -> None:
    more = b"".join(b'<!ENTITY %c "%s">' % (98 + k, b"&%c;" % (97 + k) * 10) for k in range(12))
    text = (
        b"<!DOCTYPE w ["
        + entity
        + more
        + b']><worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main">'
        b"<sheetData><row><c t='str'><v>&m;</v></c></row></sheetData></worksheet>"
    )
    assert refused(with_part(book, "xl/worksheets/sheet1.xml", text))


def test_a_workbook_cut_in_half_or_without_its_parts_is_a_sentence(book: Path) -> None:
    whole = book.read_bytes()
    book.write_bytes(whole[: len(whole) // 2])
    assert "is a damaged Excel workbook or zip file" in refused(book)
    with zipfile.ZipFile(book, "w") as file:
        file.writestr("xl/workbook.xml", "no xml")
    assert "is a damaged Excel workbook" in refused(book)


@pytest.mark.parametrize(
    ("part", "words"),
    [
        ("word/document.xml", "is a Word document"),
        ("content.xml", "is an OpenDocument file"),
        ("xl/workbook.bin", "is a binary Excel workbook"),
        ("photo.png", "is a zip file"),
    ],
)
def test_other_zip_files_are_told_for_what_they_are(part: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "file.xlsx"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr(part, "x")
    assert f"{words}" in refused(path)
