"""Any file that somebody hands us: read, or refused by a sentence; and memory does not follow what a damaged header claims."""

import io
import resource
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import openpyxl
import pyarrow
import pyarrow.parquet
import pytest

from gateway.profiles import ProfileError, check_file, shipped_profiles_folder
from gateway.profiles.strict_yaml import text
from gateway.recording import Recorder, RecordingError, read_table
from tests.fuzz.conftest import Examples
from tests.fuzz.damage import damaged

COLUMNS = ("time_s", "command_v", "force_n")
MOST_GROWTH_BYTES = 200e6


@pytest.fixture(autouse=True)
def memory_stays(request: pytest.FixtureRequest) -> Iterator[None]:
    """The peak of this process, which any header may try to raise."""
    before_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    yield
    grown_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kb
    assert grown_kb * 1024 < MOST_GROWTH_BYTES, f"{grown_kb} kB more in {request.node.name}"


def assert_read_or_refused(examples: Examples, whole: bytes, path: Path) -> None:
    """Damaged in many ways."""
    assert_each_read_or_refused((damaged(whole, examples.chance, 4) for _ in range(examples.count)), examples, path)


def assert_each_read_or_refused(every: Iterator[bytes], examples: Examples, path: Path) -> None:
    """A table of equal columns, or a RecordingError of one line."""
    refused, count, chance = 0, *examples
    for bad in every:
        path.write_bytes(bad)
        try:
            recording = read_table(path, lenient=chance.random() < 0.5)
        except RecordingError as error:
            refused += 1
            assert str(error) and "\n" not in str(error), bad[:200]
        else:
            assert {column.shape for column in recording.columns.values()} <= {(recording.rows,)}
    assert 0 < refused < count, f"{refused} of {count} refused"


def test_no_recording_of_ours_breaks_its_reader(tmp_path: Path, examples: Callable[..., Examples]) -> None:
    recorder = Recorder(tmp_path, {"rig": "demo", "seed": 7}, COLUMNS)
    for k in range(12):
        recorder.append((0.01 * k, 0.5, 1.5 * k))
        if k % 4 == 3:
            recorder.write()
    recorder.close()
    assert_read_or_refused(examples("recordings"), recorder.path.read_bytes(), tmp_path / "bad.fgr")


def test_no_table_of_text_breaks_its_reader(tmp_path: Path, examples: Callable[..., Examples]) -> None:
    rows = "".join(f"{0.01 * k:.2f},{0.5 * k:.3f},{1.5 * k}\n" for k in range(8))
    assert_read_or_refused(examples("CSV files"), f"time_s,command_v,force_n\n{rows}".encode(), tmp_path / "bad.csv")


def test_no_parquet_file_breaks_its_reader(tmp_path: Path, examples: Callable[..., Examples]) -> None:
    table = pyarrow.table({name: np.arange(20.0) for name in COLUMNS})
    pyarrow.parquet.write_table(table, tmp_path / "good.parquet")
    assert_read_or_refused(
        examples("Parquet files"), (tmp_path / "good.parquet").read_bytes(), tmp_path / "bad.parquet"
    )


@pytest.fixture
def book(tmp_path: Path) -> Path:
    made = openpyxl.Workbook()
    for row in (COLUMNS, *((0.1 * k, 1.0, 2.0 * k) for k in range(6))):
        made.active.append(row)
    made.save(tmp_path / "good.xlsx")
    return tmp_path / "good.xlsx"


def with_damaged_part(book: Path, examples: Examples) -> Iterator[bytes]:
    """The workbook, with one of its parts damaged inside of a whole archive, or the archive itself."""
    with zipfile.ZipFile(book) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    for _ in range(examples.count):
        name, packed = examples.chance.choice(tuple(parts)), io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
            for part, data in parts.items():
                archive.writestr(part, damaged(data, examples.chance) if part == name else data)
        yield packed.getvalue() if examples.chance.random() < 0.7 else damaged(book.read_bytes(), examples.chance)


def test_no_workbook_breaks_its_reader(book: Path, examples: Callable[..., Examples]) -> None:
    given = examples("workbooks")
    assert_each_read_or_refused(with_damaged_part(book, given), given, book.with_name("bad.xlsx"))


def test_no_yaml_breaks_its_reader(tmp_path: Path, examples: Callable[..., Examples]) -> None:
    """What can be read as YAML, and one in twenty as the profile that it was."""
    count, chance = examples("YAML files")
    folder, refused = shipped_profiles_folder(), 0
    good = {kind: sorted((folder / kind).glob("*.yaml"))[:6] for kind in ("devices", "plants", "rigs")}
    for number in range(count):
        whole = chance.choice(good[chance.choice(tuple(good))]).read_bytes()
        start = chance.randrange(max(1, len(whole) - 300))
        bad = damaged(whole if number % 20 == 0 else whole[start : start + 300], chance, 4)
        try:
            text.parse(bad, "bad.yaml")
            if number % 20 == 0:
                (tmp_path / "bad.yaml").write_bytes(bad)
                assert check_file(tmp_path / "bad.yaml") is not None
        except ProfileError as error:
            refused += 1
            assert error.faults and all(fault.file.endswith("bad.yaml") for fault in error.faults)
    assert 0 < refused < count
