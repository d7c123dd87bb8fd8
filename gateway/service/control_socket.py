"""`control.sock` in the state directory: what is asked of a running gateway by its own tools, apart from Modbus.

It takes:
- recordings: on, off, status;
- calibration runs, and what the last self-test has found;
- the calibration and the plant in use, and another one in their place;
- who wrote each register last, and the sentence of the last refusal;
- which rig runs, its lease, the loop's health;
- the report of the residual watch, which its process makes here and others may read;
- the whole state, and Modbus requests of the processes beside control (gateway.service.live_answers);
- whether something may be set on a simulated rig: judged and audited here, told to the rig's own socket by the tools.

Mode 0600: whoever may write the state directory may ask. What each verb takes stands in gateway.service.socket_requests.
"""

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gateway.audit.rig_audit import RigAudit
from gateway.calibrations.upload import UploadService
from gateway.modbus import Peer
from gateway.processes.json_socket.server import Handler, JsonLineServer
from gateway.processes.state_directory import CONTROL_SOCKET
from gateway.profiles import Rig
from gateway.recording.label import RecordingLabel
from gateway.service.live_answers import LiveAnswers, LiveParts, clock_sentence
from gateway.service.running_rig.calibration_runs import CalibrationRuns
from gateway.service.running_rig.control_loop import ControlLoop
from gateway.service.running_rig.recording.recordings import Recordings
from gateway.service.running_rig.rig_plants import RigPlants
from gateway.service.simulation.requests import SimulationRequests
from gateway.service.socket_requests import CalibrationRequest, EmptyRequest, RecordRequest, parse_request
from gateway.service.watch_reports import WatchReports


@dataclass(frozen=True, slots=True)
class RunningParts:
    """Parts of a running gateway that its tools may ask."""

    rig: Rig
    loop: ControlLoop
    recordings: Recordings
    upload: UploadService
    calibration_runs: CalibrationRuns
    watch: WatchReports
    plants: RigPlants
    audit: RigAudit
    simulation: SimulationRequests
    paths: Callable[[], dict[str, str]]
    peers: Callable[[], tuple[Peer, ...]]
    calibration_date: Callable[[], str]
    running: dict[str, Any] = field(default_factory=dict)
    """What does not change while it runs: rig and its file, port of Modbus TCP, lease_s (null: none), lease_action."""


class ControlSocket(JsonLineServer):
    """Local socket of control's process, on which commands of the command line are answered."""

    def __init__(self, state: Path, parts: RunningParts, log: Callable[[str, str], None]) -> None:
        self.live = LiveAnswers(parts.rig, _live_parts(parts))
        self.live.alarm_times.on_set = lambda set_s: log("clock", clock_sentence(set_s))
        handlers: dict[str, Handler] = {
            "record": self._record,
            "calibration": self._calibration,
            "plant": parts.plants.answer,
            "calibrate": lambda request: parts.calibration_runs.answer(request, has_waited=self.has_waited),
            "self-test": parts.calibration_runs.answer_self_test,
            "last-writer": self._last_writer,
            "last-refusal": self._last_refusal,
            "health": self._health_figures,
            "running": self._running,
            "sim": parts.simulation.answer,
            "residual": parts.watch.answer,
            "state": self.live.state,
            "modbus": lambda request: self.live.modbus(request, has_waited=self.has_waited),
        }
        super().__init__(state / CONTROL_SOCKET, parts.audit.watch_handlers(handlers), log)
        self._asked = parts

    def _record(self, request: dict[str, Any]) -> dict[str, Any] | Future[dict[str, Any]]:
        query, recordings = parse_request(RecordRequest, request), self._asked.recordings
        if query.on is None:
            return recordings.status()
        label = RecordingLabel(query.name, query.note)
        return recordings.start(label, query.for_s) if query.on else recordings.stop()

    def _calibration(self, request: dict[str, Any]) -> dict[str, Any]:
        """{"use": number} (with "force": true a rejected one, too) or {"rollback": true} begin a change; neither tells what is
        in use and how the last one went."""
        query = parse_request(CalibrationRequest, request)
        if query.rollback:
            return self._asked.upload.rollback()
        return (
            self._asked.upload.status() if query.use is None else self._asked.upload.use(query.use, force=query.force)
        )

    def _last_writer(self, request: dict[str, Any]) -> dict[str, Any]:
        parse_request(EmptyRequest, request)
        bank = self._asked.loop.bank
        writers = {name: {"peer": str(peer), "time_s": at_s} for name, (peer, at_s) in bank.last_writer.items()}
        return {"owner": bank.owner, "writers": writers}

    def _last_refusal(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return what the last-refusal registers stand for, in the gateway's own words; empty before the first."""
        parse_request(EmptyRequest, request)
        refusal = self._asked.loop.bank.last_refusal
        if refusal is None:
            return {"sentence": ""}
        return {"address": refusal.address, "reason": int(refusal.reason), "sentence": refusal.sentence}

    def _running(self, request: dict[str, Any]) -> dict[str, Any]:
        parse_request(EmptyRequest, request)
        return dict(self._asked.running)

    def _health_figures(self, request: dict[str, Any]) -> dict[str, Any]:
        parse_request(EmptyRequest, request)
        health = self._asked.loop.health
        return {
            "ticks": health.ticks,
            "missed_ticks": health.missed_ticks,
            "loop_time_us": health.loop_time_s * 1e6,
            "late_p50_us": health.lateness_us(0.5),
            "late_p99_us": health.lateness_us(0.99),
            "residual": self._asked.watch.figures(),
        }


def _live_parts(parts: RunningParts) -> LiveParts:
    return LiveParts(
        loop=parts.loop,
        paths=parts.paths,
        peers=parts.peers,
        runs=parts.calibration_runs,
        status={
            "calibration": parts.upload.status,
            "plant": parts.plants.status,
            "recording": parts.recordings.status,
            "residual": lambda: parts.watch.answer({}),
        },
        calibration_date=parts.calibration_date,
    )
