"""Reads recordings back, whatever a crash or a full disk left of them.

What is dropped is said: a torn tail is the normal end after kill -9, and batches that fail their CRC in the middle (a bad
disk) cost themselves only. numpy is imported when a file is read, not with the room: the recorder's process needs none.
"""

import contextlib
import json
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from zlib import crc32

from gateway.plain_file import is_file
from gateway.processes.state_directory import RECORDINGS
from gateway.recording.errors import RecordingError, tell_unreadable
from gateway.recording.layout import HEADER_PREFIX, LONGEST_HEADER, MAGIC, MARK, SUFFIX, Batch, batch_at, number_in

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_FLOAT64: Final = struct.Struct("<d")
_ROW_ITEM: Final = _FLOAT64.size
_GROUPS: Final = ("ladder", "experiment", "plant_in_use", "rig_texts")
"""Of a header: what is a group of keys, where it is there."""
_LARGEST: Final = 1.0e30


@dataclass(frozen=True, slots=True)
class Recording:
    """One recording: header as written, one float64 array per column, all of length rows.

    truncated: bytes were dropped, `notes` says which; a gap in the middle shows in time_s. lines: in a text file, the
    line that each row stood on. suggestion: the `--columns` that is probably meant where the headers are not ours; factors:
    what numbers as they stood were multiplied by, of columns that were in another unit.
    """

    path: Path
    header: dict[str, Any]
    columns: "dict[str, NDArray[np.float64]]"
    rows: int
    truncated: bool
    notes: tuple[str, ...] = ()
    lines: "Sequence[int] | NDArray[np.int64] | None" = None
    suggestion: str = ""
    factors: dict[str, float] = field(default_factory=dict)

    def place(self, row: int) -> str:
        """Return where a row (from 0) stands, for messages: `file:line`, or the number of the row where there are no lines."""
        return f"{self.path}, row {row + 1}" if self.lines is None else f"{self.path}:{self.lines[row]}"


@dataclass(frozen=True, slots=True)
class RecordingEntry:
    """One line of `recordings list`. fault: why the file cannot be read, empty when it can."""

    number: int
    path: Path
    header: dict[str, Any]
    rows: int
    duration_s: float
    size_bytes: int
    truncated: bool
    fault: str = ""


def read_recording(path: Path) -> Recording:
    """Return everything whole in the file; RecordingError when it is no recording or its header is cut, OSError as usual."""
    import numpy as np

    data = memoryview(path.read_bytes())
    header, offset = _header(data, path)
    names = header["columns"]
    batches, notes = _all_batches(data, offset, len(names) * _ROW_ITEM)
    rows = b"".join(data[batch.start : batch.end] for batch in batches)
    table = np.frombuffer(rows, dtype="<f8").reshape(-1, len(names))
    columns = {name: table[:, index].copy() for index, name in enumerate(names)}
    return Recording(path, header, columns, len(table), bool(notes), notes)


def read_header(path: Path) -> dict[str, Any]:
    """Return what a recording says of itself, without its rows, which may be gigabytes; errors as of `read_recording`."""
    first = len(MAGIC) + HEADER_PREFIX.size
    with path.open("rb") as stream:
        data = stream.read(first)
        length = HEADER_PREFIX.unpack_from(data, len(MAGIC))[0] if len(data) == first else 0
        data += stream.read(min(length, LONGEST_HEADER))
    return _header(memoryview(data), path)[0]


def list_recordings(state_directory: Path) -> list[RecordingEntry]:
    """Return the recordings of one state directory by number; unreadable ones are listed with their fault, and not those that
    are deleted meanwhile: reading the ones before takes its time."""
    entries: list[RecordingEntry] = []
    for path in recording_paths(state_directory):
        with contextlib.suppress(FileNotFoundError):
            entries.append(read_entry(path))
    return entries


def recording_paths(state_directory: Path) -> list[Path]:
    """Return the files of the recordings of one state directory by number. OSError for a folder that may not be read: it is not
    an empty one."""
    paths: list[Path] = []
    with contextlib.suppress(FileNotFoundError, NotADirectoryError):
        paths = [path for path in (state_directory / RECORDINGS).iterdir() if path.suffix == SUFFIX]
    numbered = ((number, path) for path in paths if (number := number_in(path)) is not None)
    return [path for _, path in sorted(numbered) if is_file(path)]  # a pipe or a device would be read for ever


def find_recording(state_directory: Path, number: int) -> Path:
    """Return the file of one number; RecordingError that names the ones there are."""
    path = state_directory / RECORDINGS / f"{number:04d}{SUFFIX}"
    if is_file(path):
        return path
    present = ", ".join(str(int(each.stem)) for each in recording_paths(state_directory)) or "none"
    raise RecordingError(f"no recording {number} in {path.parent}; there: {present}")


def read_entry(path: Path) -> RecordingEntry:
    """Return what a list says of one file; one that cannot be read has a fault. FileNotFoundError where there is none."""
    number, size_bytes = int(path.stem), path.stat().st_size
    try:
        data = memoryview(path.read_bytes())
        header, offset = _header(data, path)
    except FileNotFoundError:
        raise
    except (RecordingError, OSError) as error:
        return RecordingEntry(number, path, {}, 0, 0.0, size_bytes, True, tell_unreadable(error))
    row_size = len(header["columns"]) * _ROW_ITEM
    batches, notes = _all_batches(data, offset, row_size)
    rows = sum(batch.rows for batch in batches)
    return RecordingEntry(
        number, path, header, rows, _duration_s(data, header, batches, row_size), size_bytes, bool(notes)
    )


def _duration_s(data: memoryview, header: dict[str, Any], batches: list[Batch], row_size: int) -> float:
    """From the first row's time_s to the last one's; 0 without rows or such a column."""
    if not batches or "time_s" not in header["columns"]:
        return 0.0
    at = header["columns"].index("time_s") * _ROW_ITEM
    first: float = _FLOAT64.unpack_from(data, batches[0].start + at)[0]
    last: float = _FLOAT64.unpack_from(data, batches[-1].end - row_size + at)[0]
    return last - first


def _header(data: memoryview, path: Path) -> tuple[dict[str, Any], int]:
    """Return the header and the offset of the first batch."""
    start = len(MAGIC) + HEADER_PREFIX.size
    if data[: len(MAGIC)] != MAGIC[: len(data)]:
        raise RecordingError(f"{path} is not a recording of force-gateway: it begins with {bytes(data[:8]).hex(' ')}")
    length, crc = HEADER_PREFIX.unpack_from(data, len(MAGIC)) if len(data) >= start else (0, 0)
    if len(data) < start or (length <= LONGEST_HEADER and len(data) < start + length):
        raise RecordingError(
            f"{path} is a recording that ends inside its header, after {len(data)} bytes: the recorder was stopped as it began"
        )
    document = data[start : start + length]
    if length > LONGEST_HEADER or crc32(document) != crc:
        raise RecordingError(
            f"{path} has a damaged header (its CRC-32 differs): the rows cannot be understood without it"
        )
    header = _said_by(bytes(document))
    if header.get("format", 1) != 1:
        raise RecordingError(f"{path} is of format {header['format']}; this version reads format 1")
    names = header.get("columns")
    if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
        raise RecordingError(f"{path} has a header without columns: zeros of a power cut, or another program's file")
    if strange := _strange_in(header):
        raise RecordingError(f"{path} has a header whose {strange}: another program's file")
    return header, start + length


def _strange_in(header: dict[str, Any]) -> str:
    """Return what of a header no gateway writes, empty for nothing: whoever goes on with a ladder counts with what it says."""
    if wrong := [name for name in _GROUPS if not isinstance(header.get(name) or {}, dict)]:
        return f"{wrong[0]} is no group of keys"
    ladder = {f"ladder.{name}": value for name, value in (header.get("ladder") or {}).items() if value is not None}
    numbers = ladder | {"zero_n": header.get("zero_n", 0.0)}
    if wrong := [name for name, value in numbers.items() if not _is_number(value)]:
        return f"{wrong[0]} is no number"
    earlier = header.get("continues", [])
    if not isinstance(earlier, list) or not all(type(number) is int for number in earlier):
        return "continues is no list of recordings' numbers"
    return ""


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and abs(value) < _LARGEST


def _said_by(document: bytes) -> dict[str, Any]:
    """Return what a header says; nothing, where it is none although its CRC-32 is right, as that of no bytes at all is."""
    try:
        said = json.loads(document)
    except (ValueError, RecursionError):
        return {}
    return said if isinstance(said, dict) else {}


def _all_batches(data: memoryview, offset: int, row_size: int) -> tuple[list[Batch], tuple[str, ...]]:
    """Whole batches in order, and a sentence for every piece between or after them that was dropped."""
    batches: list[Batch] = []
    notes: list[str] = []
    for batch in _scan(data, offset, row_size):
        if isinstance(batch, Batch):
            batches.append(batch)
        else:
            notes.append(batch)
    return batches, tuple(notes)


def _scan(data: memoryview, offset: int, row_size: int) -> Iterator[Batch | str]:
    """Whole batches, each once and in their order: a number that is missing is said, unless its damaged bytes were."""
    expected, is_told = 0, False
    while offset < len(data):
        batch = batch_at(data, offset, row_size)
        if batch is not None:
            if batch.number > expected and not is_told:
                yield f"{batch.number - expected} batches before byte {offset} are missing: something was cut out"
            if batch.number < expected:
                yield f"batch {batch.number} at byte {offset} is there once more, or late, and was dropped"
            else:
                yield batch
                expected = batch.number + 1
            offset, is_told = batch.end, False
            continue
        is_told = True
        following = _next_batch(data, offset, row_size)
        if following is None:
            yield f"torn tail: the last {len(data) - offset} bytes are not a whole batch and were dropped"
            return
        yield f"{following - offset} bytes at {offset} are damaged (CRC-32) and were dropped"
        offset = following


def _next_batch(data: memoryview, offset: int, row_size: int) -> int | None:
    """Return where the next whole batch begins after a damaged place, None when there is none."""
    raw = bytes(data[offset:])  # memoryview cannot be searched
    at = raw.find(MARK, 1)
    while at >= 0:
        if batch_at(data, offset + at, row_size) is not None:
            return offset + at
        at = raw.find(MARK, at + 1)
    return None
