"""Has recordings put on the disk in a thread beside the control loop: once they have begun, and once they have ended."""

from collections.abc import Callable
from pathlib import Path

from gateway.processes.disk_worker import DiskWorker
from gateway.recording.recorder import sync_recording

Log = Callable[[str, str], None]


class RecordingSync:
    """sync(path) from the loop. log: called in the thread, when the disk refuses."""

    def __init__(self, log: Log) -> None:
        self._log = log
        self._worker = DiskWorker()

    def __call__(self, path: Path) -> None:
        try:
            self._worker.begin(lambda: self._sync(path))
        except OSError as error:
            self._tell(path, error)

    def close(self) -> None:
        """Begin nothing more; what is under way comes to its end."""
        self._worker.close()

    def _sync(self, path: Path) -> None:
        try:
            sync_recording(path)
        except FileNotFoundError:  # deleted meanwhile
            return
        except OSError as error:
            self._tell(path, error)

    def _tell(self, path: Path, error: OSError) -> None:
        self._log("recording", f"E402 recording {path} may not outlive a power cut: {error.strerror}; control goes on")
