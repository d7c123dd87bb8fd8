"""A gateway that ends while a run is recorded."""

import asyncio
from pathlib import Path

from gateway.recording import read_recording
from tests.service.running_rig.runs.test_calibration_runs import SHORT, on_a_hanging_disk


def test_the_end_of_the_process_waits_until_the_disk_has_the_last_rows(tmp_path: Path) -> None:
    """The process is gone behind it, and its threads with it."""
    rig, runs, disk = on_a_hanging_disk(tmp_path)
    runs.answer({"plan": SHORT})
    rig.run(0.2)
    disk.let_go()
    rig.run(0.2)

    async def end() -> None:
        asyncio.get_running_loop().call_later(0.02, disk.let_go)
        await runs.close()

    asyncio.run(end())
    recording = read_recording(Path(str(runs.status()["recording"])))
    assert recording.rows == runs._last.rows > 0  # type: ignore[union-attr]
