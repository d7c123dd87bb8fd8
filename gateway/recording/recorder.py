"""Writes a recording: one os.write per batch of rows. When, says whoever records: a gateway each 0.1 s, in a thread beside its
control loop (service/running_rig/recording/run_recording.py), for a disk may keep any of these calls waiting.

Decisions
- Rows go into one buffer that is reused; a batch is complete, with its CRC, before its single write. A kill -9 at any
  moment leaves whole batches and at most one torn one.
- No fsync here: the kernel keeps what was written when the process dies; a power cut may cost the last half minute. Whoever
  records has `sync_recording` called once it has begun (without its header a file is nothing) and once it has ended. SQLite
  and Parquet were rejected, for they sync as they go, and a torn Parquet file has no footer and so no data.
- A full disk ends the recording, with a sentence, never the control loop; so does who deletes its file, or the folder, while
  it is written. A disk that takes no header has no recording.
- No numpy here: the control process needs none of it to record.
"""

import contextlib
import fcntl
import json
import os
import struct
import time
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from gateway.plain_file import tell_refusal, write_whole
from gateway.processes.durable_file import sync_path
from gateway.recording.layout import BATCH_PREFIX, MARK, SUFFIX, batch_crc, header_bytes, number_in

_BATCH_ROWS: Final = 256  # a batch is written early when it is full: 2.5 kHz still gives one write per 0.1 s
_FORMAT: Final = 1
_LOCK_TRIES: Final = 100
_LOCK_PAUSE_S: Final = 0.001
_DELETED: Final = "somebody has deleted its file"


class Recorder:
    """One open recording. failure: None while it records, else the sentence that says why it stopped."""

    def __init__(self, directory: Path, header: Mapping[str, Any], columns: tuple[str, ...]) -> None:
        """Create the next numbered file in `directory` (made if absent); OSError, and there is none, when that cannot be done.

        header: what a reader needs to understand the rows: rig, rig_fingerprint, rig_texts, calibration, seed ...;
        `format`, `number`, `columns` and, if absent, `started_utc` are added.
        """
        self._row = struct.Struct(f"<{len(columns)}d")
        self._buffer = bytearray(BATCH_PREFIX.size + _BATCH_ROWS * self._row.size)
        self._view = memoryview(self._buffer)
        self._rows = 0
        self._batch = 0
        self.rows_written = 0
        self.failure: str | None = None
        with contextlib.suppress(FileExistsError):  # a link to a disk that is not mounted, too: that is told below
            directory.mkdir(parents=True, mode=0o700)
        self.number, self.path, descriptor = _create_next(directory)
        self._descriptor: int | None = descriptor
        _lock_until_closed(descriptor)
        facts = {"format": _FORMAT, "number": self.number, "started_utc": _utc_now()} | dict(header)
        self._length = self._write_header(header_bytes(json.dumps(facts | {"columns": list(columns)}).encode()))

    @property
    def is_open(self) -> bool:
        """Decide whether rows are still written."""
        return self._descriptor is not None

    @property
    def size_bytes(self) -> int:
        """Return how long the file is."""
        return self._length

    def append(self, values: tuple[float, ...]) -> None:
        """Add one row, in the order of the columns; struct.error when their number differs. Nothing once it stopped."""
        if self._descriptor is None:
            return
        self._row.pack_into(self._buffer, BATCH_PREFIX.size + self._rows * self._row.size, *values)
        self._rows += 1
        if self._rows == _BATCH_ROWS:
            self._write_batch()

    def write(self) -> None:
        """Write what has been gathered now."""
        if self._rows:
            self._write_batch()

    def close(self) -> None:
        """Write the last rows and close the file; a second call does nothing."""
        if self._rows:
            self._write_batch()
        elif self._descriptor is not None and self._is_deleted(self._descriptor):
            self._stop(_DELETED)
        self._release()

    def _write_header(self, data: bytes) -> int:
        """Return its length. A file without one could not be read: it goes."""
        assert self._descriptor is not None
        try:
            write_whole(self._descriptor, data)
        except OSError:
            self._release()
            with contextlib.suppress(OSError):
                self.path.unlink()
            raise
        return len(data)

    def _write_batch(self) -> None:
        end = BATCH_PREFIX.size + self._rows * self._row.size
        crc = batch_crc(self._batch, self._rows, self._view[BATCH_PREFIX.size : end])
        BATCH_PREFIX.pack_into(self._buffer, 0, MARK, self._batch, self._rows, crc)
        rows, self._rows = self._rows, 0
        if self._write(self._view[:end]):
            self._batch += 1
            self.rows_written += rows

    def _write(self, data: bytes | memoryview) -> bool:
        """Write it; False, and the recording ends, when the disk did not take all of it."""
        if self._descriptor is None:
            return False
        try:
            write_whole(self._descriptor, data)
            if self._is_deleted(self._descriptor):
                return self._stop(_DELETED)
        except OSError as error:
            return self._stop(tell_refusal(error))
        self._length += len(data)
        return True

    @staticmethod
    def _is_deleted(descriptor: int) -> bool:
        """A file without a name takes rows as before, and they are gone with its descriptor."""
        return os.fstat(descriptor).st_nlink == 0

    def _stop(self, reason: str) -> bool:
        self.failure = f"E402 recording {self.path} stopped after {self.rows_written} rows: {reason}; control goes on"
        if self._descriptor is not None:
            try:
                os.ftruncate(self._descriptor, self._length)  # the piece of a batch that did fit is no data
            except OSError:
                pass  # the reader drops it just as well
        self._rows = 0
        self._release()
        return False

    def _release(self) -> None:
        if self._descriptor is not None:
            descriptor, self._descriptor = self._descriptor, None
            os.close(descriptor)


def sync_recording(path: Path) -> None:
    """Put what is written of a recording, its name and its folder's on the disk: not in a loop. OSError where it refuses."""
    for each in (path, path.parent, path.parent.parent):
        sync_path(each)


def _create_next(directory: Path) -> tuple[int, Path, int]:
    """Number, path and descriptor of a file that nobody else has: O_EXCL settles who gets a number. None is used twice, also
    where its recording was deleted: then there is a mark."""
    number = 1 + max((number_in(path) or 0 for path in directory.iterdir()), default=0)
    while True:
        path = directory / f"{number:04d}{SUFFIX}"
        try:
            return number, path, os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o640)
        except FileExistsError:
            number += 1


def _utc_now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def _lock_until_closed(descriptor: int) -> None:
    """Lock what is recorded: whoever deletes recordings looks, and who looks at a new one holds it for a moment."""
    for _ in range(_LOCK_TRIES):
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            time.sleep(_LOCK_PAUSE_S)
        except OSError:  # some file systems have no locks
            return
        else:
            return
