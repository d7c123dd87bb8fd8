"""The running gateway's recording: at most one, started and stopped on command; a full disk ends it, not the control, and it
goes on by itself when there is room (recording_again.py). Nothing here waits for the disk (run_recording.py).

One that goes on for ever goes on in another file after a day, or when it is as long as one may be, so that whoever prunes
recordings has something to prune, and no file is too long to be read.
"""

import asyncio
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any, Final

from gateway.control.inputs import Output
from gateway.devices.messages import ForceSample
from gateway.plain_file import tell_refusal
from gateway.plants.in_use import in_use_facts
from gateway.processes.disk_worker import DiskWorker
from gateway.processes.event_log import EventLog
from gateway.profiles import Rig
from gateway.recording import Recorder
from gateway.recording.label import NO_LABEL, RecordingLabel
from gateway.recording.tables.column_names import CALIBRATION
from gateway.service.running_rig.lines.output_line import LineState
from gateway.service.running_rig.recording.recorded_row import COLUMNS
from gateway.service.running_rig.recording.recording_again import RecordingAgain
from gateway.service.running_rig.recording.retention import RecordingRetention
from gateway.service.running_rig.recording.run_recording import RunRecording
from gateway.service.running_rig.recording.wanted_recording import WantedRecording

RUN_COLUMNS: Final = (*COLUMNS, CALIBRATION)
LONGEST_BYTES: Final = 256 << 20
LONGEST_S: Final = 86400.0
_SHARES: Final = 8
"""How many files there are at least in what a rig's limits have room for."""
_SHORTEST_S: Final = 10.0  # of a file: where the limits have room for less, each tick would make another one
END_BOUND_S: Final = 1.0
Answer = dict[str, Any]
Opened = Callable[[RunRecording, OSError | None], None]


class Recordings:
    """Recordings of a rig: at most one open file, each under its time. disk: two threads by default. What is asked here is
    answered by a future of the loop: it is done when the disk has done its part. on_wanted: told what is recorded, and goes
    on in the next process if this one dies; None: nothing any more."""

    def __init__(self, directory: Path, rig: Rig, log: EventLog, disk: DiskWorker | None = None) -> None:
        self._directory = directory
        self._rig = rig
        self._log = log
        self._disk, self._syncing = disk or DiskWorker(), disk or DiskWorker()
        self._current: RunRecording | None = None
        self._closing: list[RunRecording] = []
        self._retention = RecordingRetention(directory.parent, rig.retention, log)
        self._again = RecordingAgain()
        days, most = rig.retention.days, rig.retention.bytes
        self._longest_bytes = LONGEST_BYTES if most is None else min(LONGEST_BYTES, most // _SHARES)
        self._longest_s = LONGEST_S if days is None else min(LONGEST_S, days * 86400.0 / _SHARES)
        self._began_s: float | None = None
        self._wanted = WantedRecording()
        self.on_wanted: Callable[[WantedRecording | None], None] = lambda wanted: None
        self.calibration = rig.calibration
        self.plant_in_use = in_use_facts(rig)

    def start(self, label: RecordingLabel = NO_LABEL, for_s: float = 0.0) -> Future[Answer]:
        """Begin a recording; ValueError when one is running. The answer is the status, or OSError where the disk takes none:
        one that waits for room goes on waiting. for_s: it ends by itself so long after the next tick, 0: it does not."""
        if self._current:
            raise ValueError(f"already recording to {self._current.path or self._directory}")
        return self._start(WantedRecording(label, for_s), waits_for_room=False)

    def _start(self, wanted: WantedRecording, *, waits_for_room: bool) -> Future[Answer]:
        before, self._wanted = self._wanted, wanted
        has_waited = bool(self._again.why)
        answer: Future[Answer] = Future()

        def opened(fresh: RunRecording, error: OSError | None) -> None:
            if error:
                if not waits_for_room:  # another one may: it is still the one that it was
                    self._wanted = before
                    if not has_waited:  # what was refused does not begin by itself, nor in the next process
                        self._want_no_more()
                answer.set_exception(OSError(f"{self._directory}: {tell_refusal(error)}"))
            else:
                self._again.forget()
                answer.set_result(self._facts_of(fresh))

        self._begin(opened, waits_for_room=waits_for_room)
        return answer

    def _begin(self, opened: Opened, *, waits_for_room: bool = True) -> None:
        """Begin a file. waits_for_room: where the disk takes none it is tried again, unless somebody has ended it by then."""
        rig = self._rig
        header = {
            **self._wanted.label.as_header(),
            "rig": rig.name,
            "rig_fingerprint": rig.fingerprint,
            "rig_texts": dict(rig.texts),
            "calibration": self.calibration.number,
            "calibration_noise_n": self.calibration.noise_n,
            "plant_in_use": self.plant_in_use,
            "simulated": rig.simulated,
            "seed": rig.seed,
        }
        recording = RunRecording(
            self._disk, self._syncing, lambda: Recorder(self._directory, header, RUN_COLUMNS), self._log
        )

        def tell(error: OSError | None) -> None:
            if error and self._current is recording:
                self._current = None
                if waits_for_room:
                    self._again.ask(tell_refusal(error))
            elif self._current is recording:  # else somebody has ended it meanwhile
                self._wanted = self._wanted.in_file(str(recording.path))
                self.on_wanted(self._wanted)
            opened(recording, error)

        self._current, self._began_s = recording, None
        recording.begin(tell)

    def use_plant(self, rig: Rig) -> None:
        """Note the plant that is in use from now on. A recording that runs goes on in another file: it says of all its rows
        how they were read."""
        self.plant_in_use = in_use_facts(rig)
        if self._current:
            self._go_on_in_another(self._current, "with the plant in use")

    def _go_on_in_another(self, ended: RunRecording, why: str) -> None:
        def opened(fresh: RunRecording, error: OSError | None) -> None:
            if error:
                self._log(
                    "recording", f"E402 {ended.path} ends {why}, not recording: {tell_refusal(error)}; control goes on"
                )
            else:
                self._log("recording", f"{ended.path} ends {why}, {fresh.path} goes on")

        self._end(ended, lambda: None)
        self._begin(opened)

    def try_start(self, wanted: WantedRecording) -> Future[tuple[str, ...]]:
        """Begin a recording; a sentence where the disk takes none, which is no reason not to control: it goes on waiting."""
        notes: Future[tuple[str, ...]] = Future()

        def started(answer: Future[Answer]) -> None:
            error = answer.exception()
            if not notes.cancelled():  # by a start that has ended before the disk answered
                notes.set_result((f"not recording: {error}",) if error else ())

        self.on_wanted(wanted)
        self._start(wanted, waits_for_room=True).add_done_callback(started)
        return notes

    def stop(self) -> Future[Answer]:
        """End the recording, if there is one; return where it is and how many rows the disk has taken, and as `fault` why not
        all of them."""
        self._want_no_more()
        return self._stop()

    def _want_no_more(self) -> None:
        self._again.forget()
        self.on_wanted(None)

    def _stop(self) -> Future[Answer]:
        answer: Future[Answer] = Future()
        if not (ended := self._current):
            answer.set_result({"recording": None})
            return answer

        def closed() -> None:
            facts: Answer = {"recording": None}
            if ended.path:
                facts |= {"written": str(ended.path), "rows": ended.rows_written}
            answer.set_result(facts | {"fault": ended.failure} if ended.failure else facts)

        self._end(ended, closed)
        return answer

    def _end(self, ended: RunRecording, closed: Callable[[], None]) -> None:
        def tell() -> None:
            self._closing.remove(ended)
            if ended.failure:
                self._log("recording", ended.failure)
            closed()

        self._current = None
        self._closing.append(ended)
        ended.close(tell, drops_empty=bool(ended.failure))

    async def close(self) -> None:
        """End the recording, if there is one, with this process. A disk that takes nothing for a second is not waited for."""
        self._again.forget()
        ended = asyncio.wrap_future(self._stop())
        await asyncio.wait([ended], timeout=END_BOUND_S)  # not cancelled: the disk may still tell its end
        for ending in (self._retention, self._disk, self._syncing):
            ending.close()

    def status(self) -> Answer:
        """Return where the current recording is, how many rows it has there, and in which file it began; `waits`: why there is
        none until there is room."""
        if self._current and self._current.path:
            return self._facts_of(self._current)
        return {"recording": None, "waits": self._again.why} if self._again.why else {"recording": None}

    def append(self, sample: ForceSample, decision: Output, line: LineState) -> None:
        """Append a row to the open recording, if there is one."""
        if self._current:
            self._current.append(sample, decision, line, float(self.calibration.number))

    def flush(self, now_s: float) -> None:
        """Hand over what waits, once a tick. A recording that has stopped (disk full) is logged once and dropped; one whose
        time is over ends. What there is no room for goes."""
        self._retention.tick(now_s)
        for ended in tuple(self._closing):
            ended.flush(now_s)
        if recording := self._current:
            recording.flush(now_s)
            if recording.failure:
                self._end_failed(recording, now_s)
            elif self._is_over(now_s):
                self._want_no_more()
                self._end(recording, lambda: self._tell_over(recording))
            elif self._is_long(recording.size_bytes, now_s):
                self._go_on_in_another(recording, "as long as one may be")
                self._retention.hasten()
        elif self._again.is_due(now_s):
            self._try_again(now_s)

    def _tell_over(self, ended: RunRecording) -> None:
        file = ended.path or "a recording whose file the disk has not made"
        self._log("recording", f"{file} ends after {self._wanted.for_s:g} s, {ended.rows_written} rows")

    def _end_failed(self, recording: RunRecording, now_s: float) -> None:
        self._end(recording, lambda: None)
        self._again.note_lasting(now_s - (now_s if self._began_s is None else self._began_s))
        self._again.ask(recording.failure or "")

    def _try_again(self, now_s: float) -> None:
        def opened(fresh: RunRecording, error: OSError | None) -> None:
            if not error:
                self._again.forget()
                self._log("recording", f"it goes on: recording to {fresh.path}")

        if self._is_over(now_s):
            self._want_no_more()
        else:
            self._begin(opened)

    def _is_long(self, size_bytes: int, now_s: float) -> bool:
        if self._began_s is None:
            self._began_s = now_s
        lasted_s = now_s - self._began_s
        return lasted_s >= _SHORTEST_S and (size_bytes >= self._longest_bytes or lasted_s >= self._longest_s)

    def _is_over(self, now_s: float) -> bool:
        if (wanted := self._wanted.with_end(now_s)) is not self._wanted:
            self._wanted = wanted
            self.on_wanted(wanted)
        return wanted.is_over(now_s)

    def _facts_of(self, recording: RunRecording) -> Answer:
        path, began_in = str(recording.path), self._wanted.began_in if recording is self._current else ""
        return {"recording": path, "rows": recording.rows, "began_in": began_in or path}
