"""The running gateway's recording: at most one, started and stopped on command; a full disk ends it, not the control, and it
goes on by itself when there is room (recording_again.py).

One that goes on for ever goes on in another file after a day, or when it is as long as one may be, so that whoever prunes
recordings has something to prune, and no file is too long to be read.
"""

import contextlib
from pathlib import Path
from typing import Any, Final

from gateway.control.inputs import Output
from gateway.devices.messages import ForceSample
from gateway.plants.in_use import in_use_facts
from gateway.processes.event_log import EventLog
from gateway.profiles import Rig
from gateway.recording import Recorder
from gateway.recording.label import NO_LABEL, RecordingLabel
from gateway.service.recording_retention import RecordingRetention
from gateway.service.recording_sync import RecordingSync
from gateway.service.running_rig.lines.output_line import LineState
from gateway.service.running_rig.recorded_row import COLUMNS, RunRecording
from gateway.service.running_rig.recording_again import RecordingAgain

LONGEST_BYTES: Final = 256 << 20
LONGEST_S: Final = 86400.0
_SHARES: Final = 8
"""How many files there are at least in what a rig's limits have room for."""


class Recordings:
    """Recordings of a rig: at most one open file, each under its time."""

    def __init__(self, directory: Path, rig: Rig, log: EventLog) -> None:
        self._directory = directory
        self._rig = rig
        self._log = log
        self._current: RunRecording | None = None
        self._retention = RecordingRetention(directory.parent, rig.retention, log)
        self._sync = RecordingSync(log)
        self._again = RecordingAgain()
        days, most = rig.retention.days, rig.retention.bytes
        self._longest_bytes = LONGEST_BYTES if most is None else min(LONGEST_BYTES, most // _SHARES)
        self._longest_s = LONGEST_S if days is None else min(LONGEST_S, days * 86400.0 / _SHARES)
        self._began_s: float | None = None
        self._label = NO_LABEL
        self._for_s = 0.0
        self._ends_s: float | None = None
        self.calibration = rig.calibration
        self.plant_in_use = in_use_facts(rig)

    def start(self, label: RecordingLabel = NO_LABEL, for_s: float = 0.0) -> dict[str, Any]:
        """Begin a recording; ValueError when one is running, OSError where the disk takes none: one that waits for room goes on
        waiting. for_s: it ends by itself so long after the next tick, 0: it does not."""
        if self._current:
            raise ValueError(f"already recording to {self._current.recorder.path}")
        self._label, self._for_s, self._ends_s, self._began_s = label, for_s, None, None
        try:
            self._begin()
        except OSError as error:
            raise OSError(f"{self._directory}: {error.strerror or error}") from error
        self._again.forget()
        return self.status()

    def _begin(self) -> None:
        rig, label = self._rig, self._label
        header = {
            **label.as_header(),
            "rig": rig.name,
            "rig_fingerprint": rig.fingerprint,
            "rig_texts": dict(rig.texts),
            "calibration": self.calibration.number,
            "calibration_noise_n": self.calibration.noise_n,
            "plant_in_use": self.plant_in_use,
            "simulated": rig.simulated,
            "seed": rig.seed,
        }
        self._current, self._began_s = RunRecording(Recorder(self._directory, header, COLUMNS)), None
        self._sync(self._current.recorder.path)

    def use_plant(self, rig: Rig) -> None:
        """Note the plant that is in use from now on. A recording that runs goes on in another file: it says of all its rows
        how they were read."""
        self.plant_in_use = in_use_facts(rig)
        if self._current:
            self._go_on_in_another("with the plant in use")

    def _go_on_in_another(self, why: str) -> None:
        ended = self.stop()
        try:
            self._begin()
            self._log("recording", f"{ended['written']} ends {why}, {self.status()['recording']} goes on")
        except OSError as error:
            self._again.ask(str(error))
            self._log("recording", f"E402 {ended['written']} ends {why}, not recording: {error}; control goes on")

    def try_start(self) -> tuple[str, ...]:
        """Begin a recording; a sentence where the disk takes none, which is no reason not to control."""
        try:
            self.start()
        except OSError as error:
            self._again.ask(str(error))
            return (f"not recording: {error}",)
        return ()

    def stop(self) -> dict[str, Any]:
        """End the recording, if there is one; return where it is and how many rows the disk has taken, and as `fault` why not
        all of them."""
        self._again.forget()
        if not self._current:
            return {"recording": None}
        recorder, self._current = self._current.recorder, None
        recorder.close()
        self._sync(recorder.path)
        answer = {"recording": None, "written": str(recorder.path), "rows": recorder.rows_written}
        if recorder.failure:
            self._log("recording", recorder.failure)
            answer["fault"] = recorder.failure
        return answer

    def close(self) -> None:
        """End the recording, if there is one, for good."""
        self.stop()
        self._retention.close()
        self._sync.close()

    def status(self) -> dict[str, Any]:
        """Return where the current recording is and how many rows it has; `waits`: why there is none until there is room."""
        if not self._current:
            return {"recording": None, "waits": self._again.why} if self._again.why else {"recording": None}
        return {"recording": str(self._current.recorder.path), "rows": self._current.rows}

    def append(self, sample: ForceSample, decision: Output, line: LineState) -> None:
        """Append a row to the open recording, if there is one."""
        if self._current:
            self._current.append(sample, decision, line)

    def flush(self, now_s: float) -> None:
        """Write what waits, once a tick. A recorder that has stopped (disk full) is logged once and dropped; one whose time is
        over ends. What there is no room for goes."""
        self._retention.tick(now_s)
        if self._current:
            recorder = self._current.recorder
            recorder.flush(now_s)
            if recorder.failure:
                self._end_failed(recorder, now_s)
            elif self._is_over(now_s):
                ended = self.stop()
                self._log("recording", f"{ended['written']} ends after {self._for_s:g} s, {ended['rows']} rows")
            elif self._is_long(recorder.size_bytes, now_s):
                self._go_on_in_another("as long as one may be")
                self._retention.hasten()
        elif self._again.is_due(now_s):
            self._try_again(now_s)

    def _end_failed(self, recorder: Recorder, now_s: float) -> None:
        self._log("recording", recorder.failure or "")
        self._current = None
        if not recorder.rows_written:
            with contextlib.suppress(OSError):
                recorder.path.unlink()
        self._again.note_lasting(now_s - (now_s if self._began_s is None else self._began_s))
        self._again.ask(recorder.failure or "")

    def _try_again(self, now_s: float) -> None:
        if self._is_over(now_s):
            self._again.forget()
            return
        try:
            self._begin()
        except OSError as error:
            self._again.ask(str(error))
            return
        self._again.forget()
        self._log("recording", f"it goes on: recording to {self.status()['recording']}")

    def _is_long(self, size_bytes: int, now_s: float) -> bool:
        if self._began_s is None:
            self._began_s = now_s
        return size_bytes >= self._longest_bytes or now_s - self._began_s >= self._longest_s

    def _is_over(self, now_s: float) -> bool:
        if self._for_s and self._ends_s is None:
            self._ends_s = now_s + self._for_s
        return self._ends_s is not None and now_s >= self._ends_s
