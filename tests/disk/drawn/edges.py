"""What of the gateway meets a scene instead of its machine: clocks, threads, and a look at what is synced and pruned."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest

from gateway.processes import durable_file
from gateway.recording import recorder
from gateway.recording.care import keeping
from tests.disk.drawn.players.recording_laws import row_of
from tests.disk.drawn.players.recording_player import RecordingPlayer
from tests.disk.drawn.workers import DrawnWorker

if TYPE_CHECKING:
    from tests.disk.drawn.scene import Scene

_ROOM: Final = "gateway.service.running_rig.recording"
_WITH_THREADS: Final = (
    "gateway.audit.audit_log",
    "gateway.calibrations.upload",
    f"{_ROOM}.recordings",
    f"{_ROOM}.retention",
)


class LockClock:
    """Who waits for a lock that is held between two calls waits in vain: at once."""

    def __init__(self) -> None:
        self._now_s = 0.0

    def monotonic(self) -> float:
        return self._now_s

    def sleep(self, wait_s: float) -> None:
        self._now_s += 1.0


@contextmanager
def edges_of(scene: "Scene") -> Iterator[None]:
    """Meanwhile they are the scene's."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("time.time", lambda: scene.wall_s)
        patch.setattr(durable_file, "time", LockClock())
        for module in _WITH_THREADS:
            patch.setattr(f"{module}.DiskWorker", DrawnWorker)
        for player in scene.players:
            if isinstance(player, RecordingPlayer):
                _watch_recordings(player, patch)
        yield


def _watch_recordings(player: RecordingPlayer, patch: pytest.MonkeyPatch) -> None:
    """Rows are known by their numbers, and what is synced and pruned is seen."""
    sync, prune = recorder.sync_recording, keeping.prune_recordings

    def watched_sync(path: Path) -> None:
        sync(path)
        player.note_synced(path)

    def watched_prune(*arguments: Any) -> Any:
        return player.watch_pruning(prune, *arguments)

    patch.setattr(f"{_ROOM}.run_recording.row_of", row_of)
    patch.setattr(f"{_ROOM}.run_recording.sync_recording", watched_sync)
    for module in (f"{_ROOM}.retention", "tests.disk.drawn.players.recording_player"):
        patch.setattr(f"{module}.prune_recordings", watched_prune)
