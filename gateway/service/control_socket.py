"""`control.sock` in the state directory: what is asked of a running gateway by its own tools, apart from Modbus.

record on|off|status, calibration runs, the calibration in use and its change, last writers of each register, what the
residual watch has found (its process tells it here, others may read it), the loop's health, and faults
of a simulated rig (passed on to the rig's own socket by the tools themselves). Mode 0600: whoever may write the state
directory may ask.
"""

from pathlib import Path
from typing import Any

from gateway.registers import RegisterBank
from gateway.service.json_lines import Handler, JsonLineServer
from gateway.service.ladder_keeper import LadderKeeper
from gateway.service.publish import LoopHealth
from gateway.service.recordings import Recordings
from gateway.service.upload import Upload
from gateway.service.watch_desk import WatchDesk


class ControlSocket(JsonLineServer):
    def __init__(
        self,
        state: Path,
        bank: RegisterBank,
        recordings: Recordings,
        health: LoopHealth,
        upload: Upload,
        ladder: LadderKeeper,
        watch: WatchDesk,
    ) -> None:
        handlers: dict[str, Handler] = {
            "record": self._record,
            "calibration": self._calibration,
            "calibrate": ladder.answer,
            "last-writer": self._last_writer,
            "health": self._health_figures,
            "residual": watch.answer,
        }
        super().__init__(state / "control.sock", handlers)
        self._bank = bank
        self._recordings = recordings
        self._health = health
        self._upload = upload
        self._watch = watch

    def _record(self, request: dict[str, Any]) -> dict[str, Any]:
        is_on = request.get("on")
        if is_on is None:
            return self._recordings.status()
        return self._recordings.start() if is_on else self._recordings.stop()

    def _calibration(self, request: dict[str, Any]) -> dict[str, Any]:
        """{"use": number} or {"rollback": true} begin a change; neither tells what is in use and how the last one went."""
        if request.get("rollback"):
            return self._upload.rollback()
        number = request.get("use")
        if number is None:
            return self._upload.status()
        if type(number) is not int:
            raise ValueError(f"use = {number}: the number of a calibration is expected")
        return self._upload.use(number)

    def _last_writer(self, request: dict[str, Any]) -> dict[str, Any]:
        return {
            "owner": self._bank.owner,
            "writers": {
                name: {"peer": str(peer), "time_s": at_s} for name, (peer, at_s) in self._bank.last_writer.items()
            },
        }

    def _health_figures(self, request: dict[str, Any]) -> dict[str, Any]:
        return {
            "ticks": self._health.ticks,
            "missed_ticks": self._health.missed_ticks,
            "loop_time_us": self._health.loop_time_s * 1e6,
            "late_p50_us": self._health.lateness_us(0.5),
            "late_p99_us": self._health.lateness_us(0.99),
            "residual": self._watch.figures(),
        }
