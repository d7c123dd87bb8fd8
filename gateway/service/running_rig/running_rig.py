"""One running rig: its control loop with real edges (two ports, the Modbus faces, tick, recorder, control socket)."""

import asyncio
import contextlib
import os
import time
import traceback
from functools import partial
from pathlib import Path
from typing import Any

from gateway import VERSION
from gateway.audit.rig_audit import RigAudit
from gateway.calibrations.activation import ActiveCalibration
from gateway.codes.faults import FaultCode
from gateway.control import Controller
from gateway.control.blame_for_silence import cause_of_silence
from gateway.devices import ValveHost, cell_host, output_host
from gateway.live.standstill import suspended_s
from gateway.modbus import Peer
from gateway.ports import SerialPort
from gateway.processes.clock_tick import ClockTick
from gateway.processes.event_log import EventLog
from gateway.processes.exit_cause import Ending
from gateway.processes.scheduling.scheduler_counters import SchedulerCounters
from gateway.processes.scheduling.withheld_time import WithheldTime
from gateway.processes.state_directory import RECORDINGS
from gateway.profiles import CellLine, OutputLine, Rig
from gateway.recording.ring import SampleRing
from gateway.registers import RegisterBank
from gateway.service import banner
from gateway.service.clean_shutdown_marker import CleanShutdownMarker
from gateway.service.control_socket import ControlSocket, RunningParts
from gateway.service.guardian_line import GuardianLine, told_of_reply
from gateway.service.running_rig import starting
from gateway.service.running_rig.bank_rules import bank_rules
from gateway.service.running_rig.calibration_runs import CalibrationRuns
from gateway.service.running_rig.control_loop import ControlLoop, LoopProcess
from gateway.service.running_rig.faces.faces import Faces
from gateway.service.running_rig.handover import Handover, left_of
from gateway.service.running_rig.lateness import Lateness
from gateway.service.running_rig.lines.device_checks import DeviceChecks
from gateway.service.running_rig.lines.load_cell_line import CellExchange
from gateway.service.running_rig.lines.output_line import OutputExchange
from gateway.service.running_rig.lines.rig_ports import RigPorts
from gateway.service.running_rig.lines.valve_line import ValveExchange
from gateway.service.running_rig.lines.watchdog_word import WatchdogRegister, device_fault_note, watchdog_word
from gateway.service.running_rig.recording.recordings import Recordings
from gateway.service.running_rig.rig_calibrations import RigCalibrations
from gateway.service.running_rig.rig_plants import PlantEdges, RigPlants
from gateway.service.simulation.requests import SimulationRequests
from gateway.service.watch_reports import WatchReports

_STOP_BOUND_S = 4.5  # the guardian waits 5 s


class RunningRig:
    """Wires the control loop of one rig to its edges, starts and stops them.

    `failed` is set when an internal error left the loop in an unknown state.
    """

    def __init__(self, rig: Rig, ports: dict[str, str], state: Path, guardian: GuardianLine, log: EventLog) -> None:
        self._calibrations = RigCalibrations(rig, state)
        self._plants = RigPlants(self._calibrations.rig, state)
        self._rig = rig = self._plants.rig
        self._calibration, self._state = rig.calibration, state
        self._guardian, self._log = guardian, log
        self._shutdown_marker = CleanShutdownMarker(state)
        self._spoke = asyncio.Event()
        self._running: dict[str, Any] = {
            "rig": rig.name,
            "file": str(rig.file.absolute()),
            "lease_s": rig.control.supervision.lease_s,
            "lease_action": rig.control.supervision.lease_action.value,
        }
        self.ring: SampleRing | None = None
        self.failed = asyncio.Event()
        asyncio.get_running_loop().set_exception_handler(self._on_internal_error)
        host, rest_v = output_host(rig.output.device), rig.control.limits.safe_voltage_v
        self._host = host
        self._safe_frame, self._last_frame = host.safe_frame(rest_v), host.last_frame
        told = told_of_reply(host, rig.output.device)
        handed = partial(guardian.hand_over, safe_frame=self._safe_frame, **told)
        self._ports = RigPorts(rig, ports, handed, log, guardian.take_back)
        checks = DeviceChecks(host, is_waived=rig.accept_no_device_watchdog)
        self._line = OutputExchange(host, self._ports.write_output, rig.output.device.reply_timeout_s, checks, rest_v)
        self._line.drop_unsent = self._ports.drop_output
        self._counters = SchedulerCounters(os.getpid())
        self._lateness = Lateness(1.0 / rig.loop_hz, WithheldTime())
        self._follow_rig()
        cell = rig.load_cell
        reads, stall_s = cell_host(cell.device, cell.sign, cell.unit), rig.control.supervision.stall_s
        self._cell_line = CellExchange(reads, self._ports.write_cell, cell.device, stall_s)
        self._valve_line: ValveExchange | None = None
        if rig.valve:
            valve = rig.valve.device
            self._valve_line = ValveExchange(ValveHost(valve), self._ports.write_valve, valve.reply_timeout_s)
        self._tick = ClockTick(1.0 / rig.loop_hz, self._on_tick)
        self._recordings = Recordings(state / RECORDINGS, rig, log)
        self._audit = RigAudit(state, log, time.monotonic)

    def _wire(self, cause: FaultCode) -> None:
        """Make bank, controller and the loop between them, and who serves both."""
        self._wire_loop(cause)
        rig, keep = self._rig, self._guardian.keep
        self._recordings.on_wanted = lambda wanted: keep(recording=wanted.as_facts() if wanted else None)
        self._calibration_runs = CalibrationRuns(self.controller, rig, self._state, time.monotonic, self._log)
        self.loop.calibration_runs, self._calibration_runs.decide = self._calibration_runs, self.loop.refresh
        self._faces = Faces(rig, self.bank, self._on_peer_closed, self._log)
        self._faces.on_served = self._show_faces
        failed = self._audit.note_failure
        self._upload = self._calibrations.serve(self.bank, self._on_calibration, self._log, failed)
        is_free, log = lambda: self.controller.can_compensate_anew, self._log.speaking_for("plant")
        self._plants.serve(PlantEdges(is_free, self._on_plant, time.monotonic, log, failed))
        self.watch_reports = WatchReports(self.loop, time.monotonic, self._log.speaking_for("watch"))
        self._follow_plant()
        self._control_socket = ControlSocket(
            self._state,
            RunningParts(
                rig=rig,
                loop=self.loop,
                recordings=self._recordings,
                upload=self._upload,
                calibration_runs=self._calibration_runs,
                watch=self.watch_reports,
                plants=self._plants,
                audit=self._audit,
                simulation=SimulationRequests(rig),
                paths=lambda: self._ports.paths,
                peers=lambda: self._faces.peers,
                calibration_date=lambda: self._calibration.date_utc,
                running=self._running,
            ),
            self._log,
        )

    def _wire_loop(self, cause: FaultCode) -> None:
        rig, log = self._rig, self._log
        self.bank = RegisterBank(rig.register_map, bank_rules(rig), now=time.monotonic)
        self._watchdogs = WatchdogRegister(self._line, self.bank.show_watchdogs, self._log)
        self._audit.watch(self.bank)
        self.bank.on_refusal = lambda refusal, peer: log(
            f"refusal {peer.host} {refusal.reason.name.lower()}", f"{refusal.sentence}   ({peer})"
        )
        self.bank.on_accepted = lambda sentence, peer: log(f"accepted {peer.host}", f"{sentence}   ({peer})")
        self.controller = Controller(
            rig.control,
            rig.calibration_in_use(rig.calibration),
            unclean_restart=bool(cause),
            compensation=rig.compensation,
        )
        self.loop = ControlLoop(
            self.bank,
            self.controller,
            self._line,
            self._cell_line,
            LoopProcess(time.monotonic, log, self._tick.period_s, self._counters.read, self._lateness, suspended_s),
        )
        self.loop.is_watched = False  # until READY: before it the guardian knows of no heartbeat to miss
        self.loop.valve, self.loop.restart_cause = self._valve_line, cause
        self._ports.loop, self.loop.pressure_pa_per_v = self.loop, rig.output.device.pressure_pa_per_v
        self.loop.recordings, self.loop.ring = self._recordings, self.ring
        self.loop.warnings.bits = starting.lasting_warnings(rig, is_coarse_clock=self._tick.is_fallback)

    async def start(self, bind: list[Any] | None, handover: Handover, *, restarted: Ending | None) -> banner.Ready:
        """Open the ports, greet both devices, then serve Modbus: nobody is answered before there is an answer."""
        self._wire(starting.cause_of_restart(restarted, was_unclean=self._shutdown_marker.mark_running()))
        handover.restore_held(self.bank, time.monotonic(), self._guardian.keep, self._guardian.left_beats)
        self.controller.forget_tare(handover.forgotten_zero_n)
        await self._ports.open(is_restart=bool(restarted))
        self._tick.start()
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(self._spoke.wait(), starting.waiting_s(is_restart=bool(restarted)))
        for change in handover.changes(**self._in_use()):
            self._log("start", change)
        self._guardian.keep(**self._in_use())
        notes = await self._notes(restarted)
        if wanted := handover.recording(time.monotonic()):
            notes += await asyncio.wrap_future(self._recordings.try_start(wanted))
            if restarted and (path := self._recordings.status()["recording"]):
                self._log("recording", f"it goes on behind the restart: recording to {path}")
        if unserved := await self._control_socket.start():
            notes += (f"E152 {unserved}",)
        for note in notes:
            self._log.note("start", note)
        self._note_start(restarted)
        self._faces.tls_ports = handover.tls_ports
        faces = await self._faces.start(bind, is_restart=bool(restarted))
        self._show_faces()
        return banner.Ready(
            rig=self._rig,
            modbus=self._faces.modbus,
            output_port=self._ports.output.path,
            cell_port=self._ports.cell.path,
            voltage_v=self._line.acknowledged_v,
            force_n=banner.shown_force(self.loop.sample),
            notes=notes,
            faces=faces,
            valve_port=self._ports.valve.path if self._ports.valve else "",
            valve_stands=self._valve_line.status.stands if self._valve_line else None,
        )

    def _show_faces(self) -> None:
        modbus = self._faces.modbus
        self._running |= {"port": modbus[1] if modbus else None, "serial": self._faces.serial_paths}
        self._guardian.keep(tls_ports=self._faces.tls_ports)

    def _note_start(self, restarted: Ending | None) -> None:
        """So that the audit shows what was changed while no gateway ran."""
        after = restarted.sentence if restarted else ""
        self._audit.note_gateway("start", rig=self._rig.name, **self._in_use(), version=VERSION, after=after)

    def _in_use(self) -> dict[str, int]:
        return {"calibration": self._calibration.number, "plant": self._plants.status()["active"]}

    def _follow_rig(self) -> None:
        pid = self._guardian.rig_pid
        self._lateness.follow_rig(SchedulerCounters(pid) if pid else None)

    def move_ports(self, ports: dict[str, str]) -> None:
        """Follow the simulated rig to other ports after a restart: what was lost is opened there."""
        self._follow_rig()
        self._ports.move(ports)

    async def _notes(self, restarted: Ending | None) -> tuple[str, ...]:
        notes = [*self._rig.notes, *self._calibrations.notes, *self._plants.notes]
        if self._rig.why_unwatched:
            notes.append(self._rig.why_unwatched)
        if restarted:
            notes.append(f"restarted in OFF after: {restarted.sentence}")
        else:
            notes += starting.warning_notes(self._rig)
        if self._line.checks.fault:
            notes.append(device_fault_note(self._line.checks))
        elif self._line.acknowledged_v is None:
            notes.append(await self._why_silent(self._ports.output, self._rig.output, is_restart=bool(restarted)))
        if self._cell_line.identity.fault:
            notes.append(device_fault_note(self._cell_line.identity))
        elif self.loop.sample is None:
            notes.append(await self._why_silent(self._ports.cell, self._rig.load_cell, is_restart=bool(restarted)))
        notes += starting.silent_valve_notes(self._valve_line, self._ports.valve, is_restart=bool(restarted))
        return tuple(notes)

    async def _why_silent(self, port: SerialPort, line: OutputLine | CellLine, *, is_restart: bool) -> str:
        if is_restart and port.path in self._ports.not_opened:
            return str(self._ports.not_opened[port.path])
        waited_s, now_s = starting.waiting_s(is_restart=is_restart), time.monotonic()
        held = self._lateness.since(now_s - waited_s, now_s, self._counters.waited_s())
        _, blamed = cause_of_silence(FaultCode.OUTPUT_SILENT, waited_s, held, "")
        return await starting.why_silent(
            port, line, blamed, self._rig.control.limits.safe_voltage_v, is_restart=is_restart
        )

    async def ramp_down(self) -> None:
        """Ramp the force to 0, then send the safe voltage (at most 4.5 s); at once where nobody guards it, or it fails."""
        controller, guardian, until_s = self.controller, self._guardian, time.monotonic() + _STOP_BOUND_S
        controller.stop()
        self.bank.held_enables.note_lost(self.bank.owner, self.bank.command.heartbeat)
        while time.monotonic() < until_s and not (controller.has_stopped or guardian.is_gone or self.failed.is_set()):
            await asyncio.sleep(self._tick.period_s)

    async def close(self) -> None:
        """Send the safe voltage, then close everything; the clean-shutdown marker goes last."""
        self._tick.close()
        await self._ports.write_last(self._safe_frame)
        self._guardian.note_safe()
        reply_s, rest_v = self._rig.output.device.reply_timeout_s, self._rig.control.limits.safe_voltage_v
        # Nothing is decided any more, and what masters read grows old: they go while the device is let go.
        await asyncio.gather(self._faces.close(), self._ports.let_go_output(self._last_frame, reply_s, rest_v))
        for waiting in (self._control_socket, self._recordings, self._calibration_runs, self._audit):
            await waiting.close()
        for part in (self._ports, self._upload, self._plants, self._counters, self._lateness):
            part.close()
        self._shutdown_marker.clear(left_of(self._guardian.kept))

    def _on_internal_error(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """An exception that nobody expected: the process ends with the safe voltage, the guardian starts it again in OFF."""
        error = context.get("exception")
        trace = "".join(traceback.format_exception(error)) if isinstance(error, BaseException) else ""
        self._log("internal", f"A499 internal error, please report it: {context['message']}\n{trace}")
        self._guardian.first_cause(f"internal error: {error!r}" if error else f"internal error: {context['message']}")
        self.failed.set()

    def _on_tick(self, expirations: int, late_s: float) -> None:
        self.loop.on_tick(expirations, late_s)
        self._faces.note_tick(expirations / self._rig.loop_hz + late_s + self.loop.last_tick.slept_s)
        self._watchdogs.follow(watchdog_word(self._rig, self._ports, self._line))
        now_s = time.monotonic()
        self._guardian.heartbeat(now_s, self.bank.owner, self.loop.owner_beats)
        self._control_socket.live.alarm_times.follow(self.loop.decision)
        self._recordings.flush(now_s)
        self._calibration_runs.flush(now_s)
        self._plants.take_waiting()
        self._guardian.keep(zero_n=self.controller.zero_to_tell_n(), hears_itself=self._host.hears_itself)
        self._audit.flush()
        self._tick.follow(self.loop.streamed_s)
        if starting.have_spoken(self._line, self.loop.sample, self._valve_line):
            self._spoke.set()

    def _on_calibration(self, active: ActiveCalibration) -> None:
        """All registers tell of it at once: a master that reads `committed` reads the new number and set as well."""
        self._calibration = active.calibration
        self.controller.use(self._rig.calibration_in_use(active.calibration, active.model))
        self._recordings.calibration = active.calibration
        self._audit.note_gateway("calibration in use", new=active.calibration.number)
        self._guardian.keep(**self._in_use())
        if lowered := self.bank.set_active_model(active.calibration, active.pointer.active.slot_word):
            self._log("calibration", lowered)
        self.loop.refresh()

    def _on_plant(self, rig: Rig) -> None:
        """Take the rig with another plant in use; the output is disabled."""
        self._rig = rig
        self.controller.compensate(rig.control, rig.compensation, rig.calibration_in_use(self._calibration))
        self._recordings.use_plant(rig)
        self._calibration_runs.use_plant(rig)
        self._audit.note_gateway("plant in use", new=self._plants.status()["active"])
        self._guardian.keep(**self._in_use())
        self._follow_plant()
        self.loop.refresh()

    def _follow_plant(self) -> None:
        status = self._plants.status()
        self.loop.plant_id = status["active"]
        self.watch_reports.follow_plant(status["active"], status["since_s"])

    def _on_peer_closed(self, peer: Peer) -> None:
        if peer.identity == self.bank.owner:
            self.loop.owner_connected = False
