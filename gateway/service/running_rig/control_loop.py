"""The control loop of one rig: on each command, sample and tick it decides a voltage, sends it and publishes the status.

A master's write calls `on_asked` and, where control can take it, `on_command` inside the bank's write: so the answer is
control's own, and the voltage is on its way before the master has it.
The tick serves what must happen without anybody asking: watchdogs, trim, ramps. It decides only where nothing was decided
within the last period: a cell as fast as the loop brings the next sample before the next tick. So two decisions are at most two
periods apart (and a bit, for jitter).
Clock and ports come in as arguments. No exception of ours leaves a voltage standing: `_decide` turns any into the safe one.
"""

import traceback
from collections.abc import Callable
from dataclasses import dataclass
from math import inf, nan
from typing import Final

from gateway import defaults
from gateway.codes.faults import FaultCode
from gateway.codes.warning_bits import WarningBit
from gateway.control import Controller
from gateway.control.blame_for_silence import NOT_HELD, Held
from gateway.control.inputs import LineStatus, Output
from gateway.devices.messages import ForceSample, Garbage
from gateway.processes.scheduling.scheduler_counters import ProcessorTime, time_between, waited_s_of
from gateway.recording.ring import SampleRing
from gateway.registers import RegisterBank
from gateway.registers.command import Command, Status
from gateway.registers.residual_cause import ResidualCause
from gateway.registers.writes.proposed_write import EdgeRefusal, ProposedWrite
from gateway.service.running_rig.calibration_runs import CalibrationRuns
from gateway.service.running_rig.last_tick import LastTick
from gateway.service.running_rig.lateness import Lateness
from gateway.service.running_rig.lines.load_cell_line import CellExchange
from gateway.service.running_rig.lines.output_line import OutputExchange
from gateway.service.running_rig.lines.valve_line import ValveExchange
from gateway.service.running_rig.published_status import BackgroundStatus, LoopHealth, status_of
from gateway.service.running_rig.rate_warnings import LineNoise, RateWarnings, SlowLoop
from gateway.service.running_rig.recording.recorded_row import row_of
from gateway.service.running_rig.recording.recordings import Recordings

_FRESH_PERIODS: Final = 1.05  # a tick decides nothing so soon after a sample or a command; more than 1: a cell's jitter
_RESTARTED: Final = int(WarningBit.RESTARTED)
_LONG_SILENCE_S: Final = 0.03  # a shorter one needs no explanation
_LONGEST_SILENCE_S: Final = 10.0  # then it is no hiccup any more

Log = Callable[[str, str], None]
"""log(cause, sentence): the cause groups lines for rate limits, the sentence is for people."""


@dataclass(frozen=True, slots=True)
class LoopProcess:
    """Process that the loop runs in. clock: monotonic seconds; period_s: of the tick; processor_time: what the process has had
    of a processor until now, None where the machine does not count that; lateness: None where nobody counts it; suspended_s:
    how long the machine has been suspended until now, while its clock stood still."""

    clock: Callable[[], float]
    log: Log
    period_s: float = 1.0 / defaults.LOOP_HZ
    processor_time: Callable[[], ProcessorTime | None] = lambda: None
    lateness: Lateness | None = None
    suspended_s: Callable[[], float] = lambda: 0.0


class ControlLoop:
    """Runs one step of control at each event: reads the bank's command and the newest sample, lets the controller decide, hands
    the voltage to the output line, publishes the status in the bank and the row to recordings. Owns no file and no socket.
    """

    def __init__(
        self,
        bank: RegisterBank,
        controller: Controller,
        output: OutputExchange,
        cell: CellExchange,
        process: LoopProcess,
    ) -> None:
        self.bank, self.controller = bank, controller
        self.output, self._cell = output, cell
        self.recordings: Recordings | None = None
        self.calibration_runs: CalibrationRuns | None = None
        self.ring: SampleRing | None = None
        self.health = LoopHealth()
        self.decision: Output | None = None
        self.sample: ForceSample | None = None
        self.samples = 0
        self.cell_counts = cell.counts
        self.pressure_pa_per_v = self._pressure_pa = nan  # of the output device: by its profile; at the last decision
        self.output_lost = FaultCode.NONE
        self.valve: ValveExchange | None = None
        self.cell_lost = False
        self.owner_connected = self.is_watched = True  # is_watched: a loop that stands still is noticed
        self.restart_cause, self.residual_cause, self.plant_id = FaultCode.NONE, ResidualCause.NONE, 0
        self._shown_self_test = controller.active_run.self_test
        self.clock, self._log = process.clock, process.log
        self.processor_time, self._lateness = process.processor_time, process.lateness
        self.last_tick = LastTick(process.suspended_s)
        self._heard_s, self._fresh_s = -inf, _FRESH_PERIODS * process.period_s
        self.warnings = RateWarnings(
            SlowLoop(process.period_s, process.lateness.withheld if process.lateness else None),
            LineNoise("load cell's", cell.unread.explain),
            LineNoise("output's"),
            lambda sentence: process.log("rate", sentence),
        )
        if lateness := process.lateness:
            self.warnings.held = lambda then_s, now_s: lateness.since(then_s, now_s, waited_s_of(self.processor_time()))
        bank.held_enables.beats_of, bank.held_enables.on_refused_beat = controller.beats_of, controller.hear_refused
        bank.held_enables.awake_since_s = lambda: self.last_tick.awake_since_s(self.clock())
        bank.on_command, bank.on_asked = self._on_command, self._on_asked

    def _on_asked(self, proposal: ProposedWrite) -> EdgeRefusal | None:
        """Before the bank stores a write: whether control can take it at this moment."""
        if self.controller.takes_at_once(proposal):
            return None
        now_s = self.clock()
        return self.controller.refusal_of(now_s, proposal, self._line(now_s))

    def _on_command(self, command: Command) -> None:
        self.owner_connected = True
        self._heard_s = now_s = self.clock()
        self._step(now_s)

    def on_cell_bytes(self, chunk: bytes, now_s: float) -> None:
        """Take bytes of the load cell; a complete sample makes control decide at once."""
        fresh = False
        messages = self._cell.receive(chunk, now_s)
        self.warnings.hear_cell(messages, now_s, is_stream=self._cell.is_stream)
        for message in messages:
            if isinstance(message, ForceSample):
                self.sample, fresh = message, True
                self.samples += 1
            if isinstance(message, Garbage):
                self.cell_counts.garbled += 1
            else:
                self.cell_counts.heard += 1
        if fresh:
            self._heard_s = now_s
            self._step(now_s)
            self._record()

    def on_output_bytes(self, chunk: bytes, now_s: float) -> None:
        """Take bytes of the output device."""
        self.warnings.hear_output(self.output.on_bytes(chunk, now_s), now_s)

    def on_valve_bytes(self, chunk: bytes, now_s: float) -> None:
        """Take bytes of the valve's relay."""
        if self.valve:
            self.valve.on_bytes(chunk, now_s)

    def on_valve_opened(self) -> None:
        """Forget what the valve said before: the port has been opened again."""
        if self.valve:
            self.valve.reset()
            self.valve.lost = False

    def on_valve_closed(self) -> None:
        """Decide at once that the valve is lost."""
        if self.valve:
            self.valve.reset()
            self.valve.lost = True
            self._step(self.clock())

    def on_tick(self, expirations: int, late_s: float) -> None:
        """Run one period of the loop.
        expirations: periods since the last call, more than one when the loop missed some; late_s: lateness of this one."""
        self.health.count(expirations, late_s)
        now_s = self.clock()
        self.warnings.tick(now_s, expirations, late_s, self._used_since_tick)
        if now_s - self._heard_s > self._fresh_s or self.last_tick.suspended_s():
            self._step(now_s)
        self.output.tick(now_s)  # behind the decision: an idle question would hold up its voltage
        self._cell.tick(now_s)
        if self.valve:
            self.valve.tick(now_s)
        self.last_tick.note(now_s, self.processor_time())
        if self._lateness:
            self._lateness.tick(now_s, waited_s_of(self.last_tick.processor_time))

    @property
    def owner_beats(self) -> list[int]:
        """Heartbeats that stand in the frames of who owns, that of the last write before them."""
        return [self.bank.command.heartbeat, *self.controller.beats_of(self.bank.owner)]

    @property
    def streamed_s(self) -> float | None:
        """Time at which the newest sample came of its own accord, s; None of a cell that is asked: it would follow the tick."""
        return self.sample.time_s if self.sample and self._cell.is_stream else None

    def on_output_opened(self) -> None:
        """Forget what the output said before: the port has been opened again."""
        self.output.reset()
        self.warnings.forget_output()
        self.output_lost = FaultCode.NONE

    def on_output_closed(self) -> None:
        """Decide at once that the output is lost: at the next tick another device may be behind the port."""
        self.output.reset()
        self.output_lost = FaultCode.OUTPUT_LOST
        self._step(self.clock())

    def refresh(self) -> None:
        """Decide and publish now: something besides command and sample has changed."""
        self._step(self.clock())

    def on_cell_opened(self) -> None:
        """Forget what the cell said before: the port has been opened again."""
        self._cell.reset()
        self.warnings.forget_cell()
        self.cell_lost = False

    def _used_since_tick(self) -> ProcessorTime | None:
        """Return what this process has had of a processor since the last tick."""
        last = self.last_tick.processor_time
        return time_between(last, self.processor_time()) if last else None

    def _processor_held(self, since_s: float | None, now_s: float) -> Held:
        """Asked of the kernel only once a device has not been heard for a while."""
        if self._lateness is None or since_s is None or not _LONG_SILENCE_S <= now_s - since_s <= _LONGEST_SILENCE_S:
            return NOT_HELD
        return self._lateness.since(since_s, now_s, waited_s_of(self.processor_time()))

    def _waited_since_tick(self, late_s: float) -> float | None:
        """Asked of the kernel only where the step is late: a decision has no time for it."""
        return waited_s_of(self._used_since_tick()) if late_s >= _LONG_SILENCE_S else None

    def _line(self, now_s: float) -> LineStatus:
        suspended_s, output = self.last_tick.suspended_s(), self.output
        late_s = self.last_tick.late_s(now_s, suspended_s)
        output_fault, cell = output.fault, self._cell.identity
        return LineStatus(
            acknowledged_v=output.confirmed_v if self.is_watched else None,  # then no enable is taken
            standing_v=output.standing_v,
            unanswered_since_s=output.unanswered_since_s,
            fault=self.output_lost or output_fault or cell.fault,
            said=output.said if output_fault or not cell.fault else cell.said,
            cell_lost=self.cell_lost,
            pressure_pa=output.pressure_pa,
            pressure_pa_per_v=self.pressure_pa_per_v,
            owner_connected=self.owner_connected,
            owner_refused=self.bank.owner_refused,
            owner_refused_s=self.bank.owner_refused_s,
            late_s=late_s,
            waited_s=self._waited_since_tick(late_s),  # for which the machine is to blame
            suspended_s=suspended_s,
            withheld=self._lateness.withheld() if self._lateness and late_s >= _LONG_SILENCE_S else (0.0, ""),
            warnings=self.warnings.bits,
            sent_v=output.sent_v,
            wire_s=output.round_trip_s,
            cell_held=self._processor_held(self.sample.time_s if self.sample else None, now_s),
            output_held=self._processor_held(output.unanswered_since_s, now_s),
            output_counts=output.counts,
            cell_counts=self.cell_counts,
            cell_says=self._cell.says(now_s),
            answer_late_s=output.answer_late_s,
            valve=self.valve.status if self.valve else None,
        )

    def _decide(self, now_s: float) -> Output:
        """The wire first: the reasons of a voltage are put together while it is on its way."""
        try:
            line = self._line(now_s)
            self._pressure_pa = line.pressure_pa
            voltage_v = self.controller.decide(now_s, self.bank.command, self.sample, line)
        except Exception:
            return self._make_safe(now_s)
        if not self.output_lost:  # else registers and recordings would tell of a voltage that never went out
            self.output.set_voltage(voltage_v, now_s)
        try:
            return self.controller.explain(now_s)
        except Exception:
            return self._make_safe(now_s)

    def _make_safe(self, now_s: float) -> Output:
        """An exception of ours is being handled: the safe voltage, then a sentence, for which a disk gives our source."""
        decision = self.controller.fail_internally(now_s)
        if not self.output_lost:
            self.output.set_voltage(decision.voltage_v, now_s)
        self._log("internal", f"A499 internal error, please report it; safe voltage written:\n{traceback.format_exc()}")
        return decision

    def _step(self, now_s: float) -> None:
        decision = self._decide(now_s)
        if self.valve:
            self.valve.set_direction(decision.valve, now_s)
        self.decision = decision
        if self.calibration_runs:
            self.calibration_runs.follow(decision)
        takes_output = decision.clear_command and bool(decision.fault)  # from its owner, who may have hung
        if decision.release_owner or takes_output:
            self.bank.held_enables.note_lost(self.bank.owner, self.bank.command.heartbeat)
        if decision.clear_command:
            self.bank.clear_command()
        if decision.release_owner:
            self.bank.release_owner()
        if decision.resets_device:
            self.output.clear_faults()
            self._cell.clear_faults()
        self.health.loop_time_s = self.clock() - now_s
        self.bank.publish_when_read(decision.state, self._status)
        is_new = self.controller.active_run.self_test is not self._shown_self_test
        report = self._show_self_test() if is_new else ()  # as many lines as a second has room for
        for event in decision.events:
            self._log("control self-test" if event in report else "control", event)

    def _status(self) -> Status:
        """What the registers show of the last decision, put together by the read that asks for it."""
        decision = self.decision or self.controller.safe_output(FaultCode.NONE)
        stored = self.calibration_runs.stored if self.calibration_runs else 0
        known = BackgroundStatus(self.controller.calibration_id, stored, self.residual_cause, self.plant_id)
        status = status_of(decision, self.health, self._pressure_pa, known)
        is_restart = int(decision.warnings) & _RESTARTED and not decision.fault
        return status._replace(fault_code=self.restart_cause) if is_restart else status

    def _show_self_test(self) -> tuple[str, ...]:
        self._shown_self_test = report = self.controller.active_run.self_test
        verdicts = {str(found.item): found.verdict for found in report.findings}
        self.bank.self_test.show(report.number, report.result, verdicts)
        return report.sentences

    def _record(self) -> None:
        sample, decision, line = self.sample, self.decision, self.output.line
        if sample and decision:
            for taker in (self.recordings, self.calibration_runs):
                if taker:
                    taker.append(sample, decision, line)
            if self.ring:
                self.ring.append(row_of(sample.time_s, sample, decision, line))
