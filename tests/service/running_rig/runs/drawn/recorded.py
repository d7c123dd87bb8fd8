"""What a run has left on the disk: up to its end, whole and readable, and nothing but what was heard and asked."""

from pathlib import Path
from typing import TYPE_CHECKING

from gateway.recording import read_recording
from gateway.registers.words import State

if TYPE_CHECKING:
    from tests.service.running_rig.runs.drawn.scene import Scene

FLUSH_READINGS = 12
"""So many may be lost with the process: those of a tenth of a second, and of the tick that it died in."""
ODD_ROWS = 1
"""At its begin and at its end: in the same tick as an order."""


class Recorded:
    """is_cut: the disk takes no more of it."""

    def __init__(self, scene: "Scene") -> None:
        self._scene = scene
        self.is_cut = False
        self._rows: list[tuple[float, float]] = []
        self._heard = 0
        self._path: Path | None = None
        self._is_followed = False
        self._calibration = 0

    def look(self) -> None:
        """Follow, at each tick."""
        rig, judge = self._scene.rig, self._scene.judge
        recording = rig.runs._recording
        is_running = judge.state is State.CALIBRATING
        if recording and recording.path != self._path and is_running:
            self._path, self._rows, self._is_followed, self.is_cut = recording.path, [], True, False
            self._calibration = self._scene.calibration
        is_new, self._heard = len(rig.heard) > self._heard, len(rig.heard)
        if self._is_followed and is_new and is_running and rig.controller.active_run.running:
            self._rows.append((rig.heard[-1][1] - rig.controller.zero_n, rig.wire.voltage_v))
        if self._is_followed and recording is None:
            self._judge(0)

    def killed(self) -> None:
        """The process has ended without a word."""
        if self._is_followed:
            self._judge(FLUSH_READINGS)

    def _judge(self, lost: int) -> None:
        complain, rows, self._is_followed = self._scene.judge.complain, self._rows, False
        assert self._path
        try:
            table = read_recording(self._path)
        except Exception as error:
            complain(f"the recording of a run cannot be read: {error!r}")
            return
        if table.header["calibration"] != self._calibration:
            complain(f"{table.header['calibration']} is recorded as in use, {self._calibration} was")
        if self.is_cut:
            return
        if not len(rows) - lost - ODD_ROWS <= table.rows <= len(rows) + 1 + ODD_ROWS:
            complain(f"{table.rows} rows are recorded of {len(rows)} readings of a run")
            return
        told = list(zip(table.columns["force_n"].tolist(), table.columns["command_v"].tolist(), strict=True))
        most = max(matching(told, rows[skipped:]) for skipped in (0, 1))
        if most < min(len(told), len(rows)) - 2 * ODD_ROWS:
            complain(f"of {len(told)} rows of a run only {most} are what was heard and asked")


def matching(told: list[tuple[float, float]], rows: list[tuple[float, float]]) -> int:
    """How many of the rows are the same."""
    return sum(abs(a[0] - b[0]) < 1e-6 and abs(a[1] - b[1]) < 1e-6 for a, b in zip(told, rows, strict=False))
