"""The end of a running rig: what it has opened is closed, what it has begun for the disk ends, and nothing begins any more."""

import asyncio
import socket
import threading
from pathlib import Path

from gateway.processes.disk_worker import THREAD_NAME
from gateway.recording import list_recordings
from gateway.service.running_rig.running_rig import RunningRig
from tests.disk.threads import join_disk_threads
from tests.end_to_end.own_devices import OwnDevices
from tests.service.running_rig.begun_rig import devices, with_running_rig

__all__ = ["devices"]


def open_below(folder: Path) -> list[str]:
    found = []
    for path in Path("/proc/self/fd").iterdir():
        try:
            found.append(str(path.readlink()))
        except OSError:  # that of the listing
            continue
    return [name for name in found if name.startswith(str(folder))]


def test_behind_its_end_nothing_of_a_rig_is_open_or_under_way(devices: OwnDevices) -> None:
    """A recording and the audit are on the disk, their files are closed, and each thread that waits for it ends."""
    state = devices.directory / "state"

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        await asyncio.wrap_future(rig._recordings.start())
        recordings, runs = rig._recordings, rig._calibration_runs
        recorders = (recordings._disk, recordings._syncing, runs.disk, runs.syncing)
        for part in (*recorders, rig._upload._thread, rig._plants._thread):
            part.begin(lambda: None)
        rig._recordings._retention._worker.begin(lambda: None)
        while not rig._recordings.status()["rows"]:
            await asyncio.sleep(0.005)
        assert open_below(state)

    with_running_rig(devices, scene)
    assert [name for name in open_below(state) if Path(name).is_file()] == []
    join_disk_threads()  # one that keeps recordings within their bounds may be reading the folder
    assert open_below(state) == []
    assert not [thread for thread in threading.enumerate() if thread.name.startswith(THREAD_NAME)]
    (recording,) = list_recordings(state)
    assert recording.rows > 0 and not recording.truncated
