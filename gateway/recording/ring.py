"""The sample ring: the last minutes of a run in shared memory, for the processes beside the control loop.

Decisions
- Written by control alone, one row per load-cell sample, in memory that never meets a disk (a memfd of the guardian's): a
  row costs a microsecond and no system call. A file in the state directory was rejected: a page that is being written
  back can make its writer wait for the disk. A message per sample was rejected: a reader that sleeps fills the pipe.
- Nobody locks. Readers take rows that were whole when they looked, and afterwards drop those that were overwritten
  meanwhile; a reader can be stopped, killed or slow without anybody feeling it.
- It outlives a restart of control (the guardian holds it), which goes on writing behind the rows that are there.

    magic (8) | length of names u32 | capacity u32 | rows written u64 | column names, JSON | ... at 4096: rows of float64
"""

import json
import mmap
import os
import struct
from typing import Final

from gateway import defaults

MAGIC: Final = b"FGRING1\n"
CAPACITY: Final = defaults.RING_ROWS
"""Rows: 7.9 MB for 15 columns."""
_FIXED: Final = struct.Struct("<8sII")
_WRITTEN: Final = struct.Struct("=Q")
_WRITTEN_AT: Final = _FIXED.size
_NAMES_AT: Final = _WRITTEN_AT + _WRITTEN.size
_ROWS_AT: Final = 4096
_ITEM: Final = 8


class SampleRing:
    """Control's end. `append` takes the values of one row in the order of the columns."""

    def __init__(self, descriptor: int, columns: tuple[str, ...], capacity: int = CAPACITY) -> None:
        """Go on in the ring behind this descriptor, or lay it out anew. OSError when memory for it is not to be had."""
        self._row = struct.Struct(f"<{len(columns)}d")
        self._capacity = capacity
        header = _header(columns, capacity)
        size = _ROWS_AT + capacity * self._row.size
        known = os.fstat(descriptor).st_size == size and os.pread(descriptor, _FIXED.size, 0) == header[: _FIXED.size]
        if not known:
            os.ftruncate(descriptor, 0)
            os.posix_fallocate(descriptor, 0, size)  # all of it now: no page is looked for while the loop works
            os.pwrite(descriptor, header, 0)
        self._map = mmap.mmap(descriptor, size, flags=mmap.MAP_SHARED | getattr(mmap, "MAP_POPULATE", 0))
        # one store of eight aligned bytes; pack_into would clear them first, and a reader would see a count of 0
        self._count = memoryview(self._map)[_WRITTEN_AT : _WRITTEN_AT + _WRITTEN.size].cast("Q")
        self._written = self._count[0]

    def append(self, values: tuple[float, ...]) -> None:
        """Write the row, and the count after it: who sees the count finds the row."""
        self._row.pack_into(self._map, _ROWS_AT + self._written % self._capacity * self._row.size, *values)
        self._written += 1
        self._count[0] = self._written

    def close(self) -> None:
        """Close the memory."""
        self._count.release()
        self._map.close()


class RingReader:
    """A reader's end, read only. Nothing is there before control has laid it out: `is_ready`.

    Of the ring only the head is mapped, rows are copied with pread: all of it would count as memory of every process beside
    control.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self.columns: tuple[str, ...] = ()
        self._capacity = 0
        self._head: mmap.mmap | None = None

    @property
    def is_ready(self) -> bool:
        """Decide whether there is a ring to read."""
        return self._head is not None or self._open()

    @property
    def rows_written(self) -> int:
        """Rows since the beginning; 0 before there is a ring."""
        if not self.is_ready or self._head is None:
            return 0
        (count,) = _WRITTEN.unpack_from(self._head, _WRITTEN_AT)
        return int(count)

    def newest(self, rows: int) -> bytes:
        """Return at most this many of the newest rows, oldest first, each len(columns) float64, little-endian."""
        end = self.rows_written - 1  # the newest one is left alone: its count may be seen before it on some processors
        first = max(0, end - min(rows, self._capacity - 1), 0)
        if end <= first:
            return b""
        data = b"".join(os.pread(self._descriptor, size, start) for start, size in self._places(first, end))
        lost = max(0, self.rows_written + 1 - self._capacity - first)  # overwritten while we copied
        return data[lost * len(self.columns) * _ITEM :]

    def _places(self, first: int, end: int) -> list[tuple[int, int]]:
        """Return (place, bytes) of the rows first .. end - 1: one piece, or two around the seam."""
        size, seam = len(self.columns) * _ITEM, (end // self._capacity) * self._capacity
        pieces = [(first, end)] if first >= seam else [(first, seam), (seam, end)]
        return [(_ROWS_AT + start % self._capacity * size, (stop - start) * size) for start, stop in pieces]

    def _open(self) -> bool:
        head = os.pread(self._descriptor, _ROWS_AT, 0)
        if len(head) < _ROWS_AT or not head.startswith(MAGIC):
            return False
        _, length, self._capacity = _FIXED.unpack_from(head)
        self.columns = tuple(json.loads(head[_NAMES_AT : _NAMES_AT + length]))
        self._head = mmap.mmap(self._descriptor, _ROWS_AT, prot=mmap.PROT_READ)
        return True

    def close(self) -> None:
        """Close the memory."""
        if self._head is not None:
            self._head.close()


def _header(columns: tuple[str, ...], capacity: int) -> bytes:
    names = json.dumps(columns).encode()
    if _NAMES_AT + len(names) > _ROWS_AT:
        raise ValueError(f"{len(columns)} column names take {len(names)} bytes, {_ROWS_AT - _NAMES_AT} are there")
    return _FIXED.pack(MAGIC, len(names), capacity) + _WRITTEN.pack(0) + names
