"""One recording of the running gateway: rows are gathered in the loop; a thread makes the file, writes and closes it, and
another one syncs it.

A disk that others keep busy holds up a write, and a new file even more, for as long as it likes: control stood still for 241 ms
on a machine whose other processes synced files, and was ended for it. Rows wait in memory meanwhile; a disk that has taken
nothing for HANGS_S ends the recording, never the control.

A sync has a thread of its own, for it may take seconds where the kernel takes rows at once: behind one, control that was killed
half a second after its recording had begun left not a row.
"""

import contextlib
import errno
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from gateway.control.inputs import Output
from gateway.devices.messages import ForceSample
from gateway.plain_file import tell_refusal
from gateway.processes.disk_worker import DiskWorker
from gateway.recording import Recorder
from gateway.recording.care.keeping import drop_empty_recording
from gateway.recording.recorder import sync_recording
from gateway.service.running_rig.lines.output_line import LineState
from gateway.service.running_rig.recording.recorded_row import row_of

HANGS_S: Final = 30.0
FLUSH_S: Final = 0.1
_HANGS: Final = f"the disk has taken nothing for {HANGS_S:g} s"
Log = Callable[[str, str], None]


class RunRecording:
    """Called from the loop only; time_s of its rows counts from the first of them.

    disk, syncing: each does one thing after the other, syncing what nothing waits for. make: of the file, in the thread.
    """

    def __init__(self, disk: DiskWorker, syncing: DiskWorker, make: Callable[[], Recorder], log: Log) -> None:
        self.rows = 0
        self._disk, self._syncing, self._make, self._log = disk, syncing, make, log
        self._file: Recorder | None = None  # put there by the thread
        self._start_s: float | None = None
        self._gathered: list[tuple[float, ...]] = []
        self._next_flush_s: float | None = None
        self._now_s: float | None = None  # of the last tick
        self._waiting_s: deque[float] = deque()  # when each batch was handed over that the disk has not taken
        self._given = self._taken = 0
        self._is_hung = False
        self._closed: Callable[[], object] | None = None

    # -- in the loop

    def begin(self, opened: Callable[[OSError | None], object]) -> None:
        """Have the file made. opened(error): once there is one (None), or why there is none; nothing is written then."""

        def tell(result: Any) -> None:
            opened(result if isinstance(result, OSError) else None)

        self._disk(self._open, tell)

    @property
    def path(self) -> Path | None:
        """Path of the file, None until there is one."""
        return self._file.path if self._file else None

    @property
    def number(self) -> int:
        """Number of the file, 0 until there is one."""
        return self._file.number if self._file else 0

    @property
    def rows_written(self) -> int:
        """Number of rows that the disk has taken."""
        return self._file.rows_written if self._file else 0

    @property
    def size_bytes(self) -> int:
        """Length of the file."""
        return self._file.size_bytes if self._file else 0

    @property
    def failure(self) -> str | None:
        """Sentence that says why it stopped by itself; None while it records, and where no file was opened."""
        if self._is_hung:
            begun = (
                f"recording {self.path} stopped after {self.rows_written} rows"
                if self.path
                else "no recording was begun"
            )
            return f"E402 {begun}: {_HANGS}; control goes on"
        return self._file.failure if self._file else None

    def append(self, sample: ForceSample, decision: Output, line: LineState, *labels: float) -> None:
        """Append a row. labels: of the columns that a run adds."""
        if self._start_s is None:
            self._start_s = sample.time_s
        self.rows += 1
        self._gathered.append(row_of(sample.time_s - self._start_s, sample, decision, line) + labels)

    def flush(self, now_s: float) -> None:
        """Hand over what has been gathered, each 0.1 s, and look whether the disk hangs; once a tick, also while it closes."""
        if self._now_s is None:  # what was handed over before the first tick waits from now on
            self._waiting_s = deque(now_s for _ in self._waiting_s)
        self._now_s = now_s
        while len(self._waiting_s) > self._given - self._taken:
            self._waiting_s.popleft()
        if self._waiting_s and now_s - self._waiting_s[0] > HANGS_S:
            self._is_hung = True
            self._tell_closed()
        elif self._next_flush_s is None or now_s >= self._next_flush_s:
            self._next_flush_s = now_s + FLUSH_S
            self._hand_over()

    def close(self, closed: Callable[[], object], *, drops_empty: bool = False) -> None:
        """Have the last rows written and the file closed. closed(): in the loop, once that is done, or the disk hangs.
        drops_empty: a file without a row goes."""
        self._closed = closed
        self._hand_over()
        self._give(lambda work: self._disk(work, lambda _: self._tell_closed()), lambda: self._close(drops_empty))

    def _tell_closed(self) -> None:
        if closed := self._closed:
            self._closed = None
            closed()

    def _hand_over(self) -> None:
        if self._gathered:
            rows, self._gathered = self._gathered, []
            self._give(self._begin, lambda: self._write(rows))

    def _give(self, begin: Callable[[Callable[[], None]], None], work: Callable[[], None]) -> None:
        def counted() -> None:
            try:
                work()
            finally:
                self._taken += 1

        self._given += 1
        self._waiting_s.append(self._now_s or 0.0)
        begin(counted)

    def _begin(self, work: Callable[[], None]) -> None:
        with contextlib.suppress(OSError):  # no thread: `opened` tells it
            self._disk.begin(work)

    # -- in the thread

    def _open(self) -> None:
        if self._is_hung:
            raise TimeoutError(errno.ETIMEDOUT, _HANGS)
        self._file = self._make()
        self._begin_sync(self._file.path)

    def _write(self, rows: list[tuple[float, ...]]) -> None:
        if self._file:
            for row in rows:
                self._file.append(row)
            self._file.write()

    def _close(self, drops_empty: bool) -> None:
        if self._file:
            self._file.close()
            if drops_empty and not self._file.rows_written:
                with contextlib.suppress(OSError):
                    drop_empty_recording(self._file.path)
            self._begin_sync(self._file.path)

    def _begin_sync(self, path: Path) -> None:
        try:
            self._syncing.begin(lambda: self._sync(path))
        except OSError:  # no second thread, or the process ends
            self._sync(path)

    # -- in the thread that syncs

    def _sync(self, path: Path) -> None:
        try:
            sync_recording(path)
        except FileNotFoundError:  # deleted meanwhile
            return
        except OSError as error:
            self._log(
                "recording",
                f"E402 recording {path} may not outlive a power cut: {tell_refusal(error)}; control goes on",
            )
