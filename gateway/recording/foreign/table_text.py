"""Any table as a file of UTF-8 text: UTF-16 and Windows-1252 are decoded, the sheet of a workbook is written out.

What is UTF-8 already is read where it lies. The rest goes to a temporary file, piece by piece, so that one reader knows all
rules, and memory stays small whatever the file is.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from gateway.file_signature import SIGNATURE_BYTES, describe_signature
from gateway.recording.errors import RecordingError

ZIP: Final = b"PK\x03\x04"
_PIECE: Final = 1 << 20
_SAMPLE_BYTES: Final = 1 << 16
_BYTE_ORDER_MARKS: Final = ((b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"))
_CONTROL: Final = frozenset((*range(9), *range(14, 32)))
_MANY: Final = 0.3  # of every second byte, 0: numbers and Latin letters in UTF-16


@dataclass(frozen=True, slots=True)
class TableText:
    """file: UTF-8 text, the table itself or made from it; notes: what was done."""

    file: Path
    notes: tuple[str, ...] = ()


@contextmanager
def as_text(path: Path, sheet: str | None = None) -> Iterator[TableText]:
    """Yield the table as text; what was made for it is gone afterwards. RecordingError for what is no table."""
    with path.open("rb") as stream:
        sample = stream.read(_SAMPLE_BYTES)
    if sample.startswith(ZIP):
        from gateway.recording.foreign.workbook import write_sheet

        with TemporaryDirectory(prefix="force-gateway-") as folder:
            target = Path(folder) / "sheet.txt"
            yield TableText(target, write_sheet(path, sheet, target))
        return
    if sheet is not None:
        raise RecordingError(f"--sheet {sheet}: {path} is no Excel workbook")
    encoding = _encoding(path, sample)
    if encoding == "utf-8":
        yield TableText(path)
        return
    with TemporaryDirectory(prefix="force-gateway-") as folder:
        target = Path(folder) / "table.txt"
        _recode(path, encoding, target)
        yield TableText(target, ("read as Windows-1252 text",) if encoding == "cp1252" else ())


def refuse_other_kinds(path: Path) -> None:
    """Refuse a file that is something else, with what it is and what is wanted."""
    with path.open("rb") as stream:
        found = describe_signature(stream.read(SIGNATURE_BYTES))
    if found:
        what, cure = found
        raise RecordingError(f"{path} is {what}, {_WANTED}{f': {cure}' if cure else ''}")


def refuse_our_profiles(path: Path) -> None:
    """Refuse a rig, calibration or plan that is given for a recording; nothing happens for what is none of ours."""
    from gateway.profiles.kinds.file_kind import CALLED, kind_of
    from gateway.profiles.strict_yaml.faults import ProfileError
    from gateway.profiles.strict_yaml.text import parse

    try:
        kind = kind_of(parse(path.read_bytes(), str(path)).value)
    except (ProfileError, OSError):
        return
    if kind:
        raise RecordingError(f"{path} is {CALLED[kind]}, {_WANTED}")


_WANTED: Final = "not a recording (.fgr, CSV, Parquet or .xlsx)"


def _encoding(path: Path, sample: bytes) -> str:
    """Return the encoding that the first bytes show. RecordingError for what is no text."""
    for mark, encoding in _BYTE_ORDER_MARKS:
        if sample.startswith(mark):
            return encoding
    if (wide := _wide(sample)) is not None:
        return wide
    if control := next((byte for byte in sample if byte in _CONTROL), None):
        raise RecordingError(f"{path} is no text (byte 0x{control:02X} near its beginning), {_WANTED}")
    if 0 in sample:
        raise RecordingError(f"{path} is no text (byte 0x00 near its beginning), {_WANTED}")
    try:
        sample.decode()
    except UnicodeDecodeError as error:
        if error.start < len(sample) - 3 or len(sample) < _SAMPLE_BYTES:
            return "cp1252"
    return "utf-8"


def _wide(sample: bytes) -> str | None:
    """Return the UTF-16 that has no byte order mark: every second byte of most characters is 0."""
    if b"\x00\n" not in sample and b"\n\x00" not in sample and b"\r\x00" not in sample:
        return None
    pairs = len(sample) // 2
    low, high = sample[0::2].count(0) / pairs, sample[1::2].count(0) / pairs
    if high > _MANY and low < 0.01:
        return "utf-16-le"
    return "utf-16-be" if low > _MANY and high < 0.01 else None


def _recode(path: Path, encoding: str, target: Path) -> None:
    with (
        path.open(encoding=encoding, errors="replace", newline="") as source,
        target.open("w", encoding="utf-8", newline="") as text,
    ):
        while piece := source.read(_PIECE):
            text.write(piece)
