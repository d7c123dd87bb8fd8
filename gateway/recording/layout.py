"""The bytes of a recording file `NNNN.fgr`, in one place for the writer and the reader.

    magic (8) | header length u32 | CRC-32 of the header u32 | header, JSON in UTF-8
    then batches: mark (4) | number u32 | rows u32 | CRC-32 u32 | rows x columns float64

Little-endian throughout. A batch's CRC covers its number, its row count and its rows, so that a batch cut anywhere, or a
page of zeros that a power cut left behind, never passes for data. Batch numbers count from 0: a gap is seen.
"""

import re
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from zlib import crc32

MAGIC: Final = b"\x89FGR1\r\n\n"  # a text transfer, which would mangle line ends, breaks it
MARK: Final = b"FGB\x1e"
HEADER_PREFIX: Final = struct.Struct("<II")
BATCH_PREFIX: Final = struct.Struct("<4sIII")
COUNTS: Final = struct.Struct("<II")
LONGEST_HEADER: Final = 16 << 20
SUFFIX: Final = ".fgr"
_NUMBER: Final = re.compile(r"[0-9]{1,15}")


def number_in(path: Path) -> int | None:
    """Return the number of a recording, or of a mark beside one, by the name of its file; None where it has another one."""
    return int(path.stem) if _NUMBER.fullmatch(path.stem) else None


def header_bytes(document: bytes) -> bytes:
    """Return everything that stands before the first batch."""
    return MAGIC + HEADER_PREFIX.pack(len(document), crc32(document)) + document


def batch_crc(number: int, rows: int, payload: bytes | memoryview) -> int:
    """Return the CRC-32 of a batch: of its number, its row count and its rows."""
    return crc32(payload, crc32(COUNTS.pack(number, rows)))


@dataclass(frozen=True, slots=True)
class Batch:
    """One whole batch found in a file: its number, its row count, and where its rows begin and end."""

    number: int
    rows: int
    start: int
    end: int


def batch_at(data: memoryview, offset: int, row_size: int) -> Batch | None:
    """Return the batch that begins at offset; None when it is cut, damaged, or no batch."""
    start = offset + BATCH_PREFIX.size
    if start > len(data):
        return None
    mark, number, rows, crc = BATCH_PREFIX.unpack_from(data, offset)
    end = start + rows * row_size
    if mark != MARK or end > len(data) or batch_crc(number, rows, data[start:end]) != crc:
        return None
    return Batch(number, rows, start, end)
