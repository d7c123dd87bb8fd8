"""The answers of control.sock that the processes beside control live on: the state in words, and Modbus requests of theirs.

A request goes through the register bank as one of a Modbus face does: the same checks, refusals, ownership and audit. Its peer
is named by the way it came (web, mqtt, opcua), which no address can be.
"""

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from math import floor, isfinite
from pathlib import Path
from typing import Any, Final

from gateway import VERSION
from gateway.codes.explanation import Explanation
from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.codes.warning_bits import WarningBit
from gateway.control.inputs import Output
from gateway.live import live_state as live
from gateway.live.standstill import boottime_s
from gateway.modbus import Peer
from gateway.modbus.pdu import is_exception
from gateway.modbus.server import answer, refuse_unit
from gateway.profiles import Rig
from gateway.registers.words import ControlBit
from gateway.service.running_rig.bank_rules import plain_role
from gateway.service.running_rig.calibration_runs import CalibrationRuns
from gateway.service.running_rig.control_loop import ControlLoop
from gateway.service.socket_requests import EmptyRequest, ModbusRequest, parse_request
from gateway.units import kilopascal_from_pascal

_LONGEST_PDU: Final = 253
_SET_S: Final = 0.5  # from one tick to the next a clock that is only adjusted goes on by less
Answer = dict[str, Any]


class AlarmTimes:
    """When the fault and each warning rose, seconds since 1970; to be followed at each tick. A clock that is set, as by a time
    server minutes after a start, takes them along: else an alarm would have stood for years, or not yet. steady: seconds that
    nobody sets. on_set: called when that has happened, with how far, s."""

    def __init__(self, clock: Callable[[], float] = time.time, steady: Callable[[], float] = boottime_s) -> None:
        self.on_set: Callable[[float], object] = lambda set_s: None
        self._clock, self._steady = clock, steady
        self._ahead_s = clock() - steady()
        self._fault, self._warnings = FaultCode.NONE, WarningBit(0)
        self._since: dict[FaultCode | WarningBit, float] = {}

    def follow(self, decision: Output | None) -> None:
        """Note what is new and forget what is over."""
        self._follow_clock()
        if decision is None or (decision.fault is self._fault and decision.warnings == self._warnings):
            return
        standing = _standing(decision)
        self._since = {alarm: self._since.get(alarm, self._clock()) for alarm in standing}
        self._fault, self._warnings = decision.fault, decision.warnings

    def _follow_clock(self) -> None:
        before_s, self._ahead_s = self._ahead_s, self._clock() - self._steady()
        if abs(set_s := self._ahead_s - before_s) > _SET_S:
            self._since = {alarm: since_s + set_s for alarm, since_s in self._since.items()}
            self.on_set(set_s)

    def since(self, alarm: FaultCode | WarningBit) -> float:
        """Return when it rose; now for one that nobody has followed yet."""
        return self._since.get(alarm, self._clock())


def clock_sentence(set_s: float) -> str:
    """Return what the log says of a clock that was set by so many seconds: --since goes by the new one."""
    which = "forward" if set_s > 0.0 else "back"
    return f"the clock was set {which} by {abs(set_s):.1f} s: what was said before has the times of the old one"


@dataclass(frozen=True, slots=True)
class LiveParts:
    """Parts of the running rig that the state is made of. paths: of the serial ports by line, now."""

    loop: ControlLoop
    paths: Callable[[], dict[str, str]]
    runs: CalibrationRuns
    peers: Callable[[], tuple[Peer, ...]]
    status: dict[str, Callable[[], Answer]]
    """`calibration`, `plant`, `recording`, `residual`: each tells how it is."""
    calibration_date: Callable[[], str]


class LiveAnswers:
    """Called from the loop only."""

    def __init__(self, rig: Rig, parts: LiveParts) -> None:
        self.alarm_times = AlarmTimes()
        self._rig = rig
        self._parts = parts
        self._role = plain_role(rig)

    def modbus(self, request: Answer, *, has_waited: bool = False) -> Answer:
        """Answer one PDU: {"via": "web", "unit": 1, "pdu": hex} gives {"pdu": hex}, of an exception with the sentence that says
        why: {"pdu": hex, "refusal": sentence}. ValueError for no hex, and for what comes too late: others may ask more than
        their share, and an enable that its page has given up must not press. has_waited: behind others of its caller."""
        asked = parse_request(ModbusRequest, request)
        pdu = bytes.fromhex(asked.pdu)
        if not 1 <= len(pdu) <= _LONGEST_PDU:
            raise ValueError(f"a PDU has 1 to {_LONGEST_PDU} bytes")
        if asked.until_s is not None and self._parts.loop.clock() > asked.until_s:
            raise ValueError("it waited for longer than whoever asked: nothing was done")
        bank, peer = self._parts.loop.bank, Peer(asked.via, role=self._role, is_behind=has_waited)
        units = self._rig.network.units
        given = answer(pdu, bank, peer) if asked.unit in units else refuse_unit((asked.unit, pdu), units, bank, peer)
        refusal = bank.last_refusal if is_exception(given) else None
        return {"pdu": given.hex()} | ({"refusal": refusal.sentence} if refusal else {})

    def state(self, request: Answer) -> Answer:
        """Answer how everything is, as LiveState has it."""
        parse_request(EmptyRequest, request)
        loop = self._parts.loop
        decision = loop.decision or loop.controller.safe_output(FaultCode.NONE)
        refusal = loop.bank.last_refusal
        block = decision.enable_block
        return live.LiveState(
            rig=self._rig.name,
            simulated=self._rig.simulated,
            version=VERSION,
            time_unix_s=time.time(),
            state=decision.state.name.lower(),
            mode=loop.bank.command.mode.name.lower(),
            status=tuple(str(bit.name).lower() for bit in decision.status),
            owner=loop.bank.owner,
            enable_block="" if block is RefusalReason.NONE else f"{block.code} {block.explanation.sentence}",
            last_refusal=refusal.sentence if refusal else "",
            refusals=loop.bank.refusals,
            faults=self._alarms(alarm for alarm in _standing(decision) if isinstance(alarm, FaultCode)),
            warnings=self._alarms(alarm for alarm in _standing(decision) if isinstance(alarm, WarningBit)),
            force=_force(decision, loop.output.pressure_pa),
            limits=self._limits(loop),
            calibration=self._calibration(),
            plant=self._plant(),
            peers=tuple(
                live.LivePeer(identity=peer.identity, address=str(peer), role=peer.role.name.lower())
                for peer in self._parts.peers()
            ),
            recording=_recording(self._parts.status["recording"]()),
            run=self._run(),
            residual=_residual(self._parts.status["residual"]()),
            writers=_writers(loop, self._parts.loop.clock()),
            **self._lines(loop),
            loop=self._loop(loop),
        ).to_json()

    def _alarms(self, alarms: Iterable[FaultCode | WarningBit]) -> tuple[live.LiveAlarm, ...]:
        return tuple(_alarm(one.explanation, self.alarm_times.since(one)) for one in alarms)

    def _limits(self, loop: ControlLoop) -> live.LiveLimits:
        control, command = self._rig.control, loop.bank.command
        model = loop.controller.active_run.model
        low_n, high_n = model.force_range_n
        if model.limits_n:
            low_n, high_n = max(low_n, model.limits_n[0]), min(high_n, model.limits_n[1])
        if command.control_word & ControlBit.VALVE_PULL:
            high_n = floor(100.0 * loop.controller.most_pull_n()) / 100.0  # rounded up it would be refused
        return live.LiveLimits(
            force_min_n=max(control.limits.smallest_force_n, low_n),
            force_max_n=min(control.limits.force_max_n, high_n),
            voltage_max_v=control.limits.voltage_max_v,
            tolerance_n=command.in_band_tolerance_n or control.defaults.in_band_tolerance_n,
            lease_s=control.supervision.lease_s,
        )

    def _calibration(self) -> live.LiveCalibration:
        status, date = self._parts.status["calibration"](), self._parts.calibration_date()
        kind = "built in" if status["built_in"] else "stored"
        return live.LiveCalibration(
            number=status["active"], name=status["name"], kind=kind, date_utc=date, age_s=_age_s(date)
        )

    def _plant(self) -> live.LivePlant:
        status = self._parts.status["plant"]()
        return live.LivePlant(number=status["active"], name=status["name"])

    def _run(self) -> live.LiveRun:
        status = self._parts.runs.status()
        return live.LiveRun(
            running=status["running"],
            phase=status["phase"],
            share=status["progress"],
            eta_s=status["eta_s"],
            said=status["ended"],
            stored=self._parts.runs.stored,
            result=status["result"],
        )

    def _lines(self, loop: ControlLoop) -> dict[str, live.LiveLine]:
        now_s, paths, output = self._parts.loop.clock(), self._parts.paths(), loop.output.counts
        silent_s = loop.output.unanswered_since_s
        return {
            "output": live.LiveLine(
                port=paths["output"],
                device=self._rig.output.device.name,
                asked=output.asked,
                heard=output.heard,
                garbled=output.garbled,
                age_s=None if loop.output.acknowledged_v is None else now_s - silent_s if silent_s else 0.0,
            ),
            "load_cell": live.LiveLine(
                port=paths["load_cell"],
                device=self._rig.load_cell.device.name,
                asked=loop.cell_counts.asked,
                heard=loop.cell_counts.heard,
                garbled=loop.cell_counts.garbled,
                age_s=now_s - loop.sample.time_s if loop.sample else None,
            ),
            "valve": self._valve_line(loop, now_s),
        }

    def _valve_line(self, loop: ControlLoop, now_s: float) -> live.LiveLine:
        valve = self._rig.valve
        if valve is None or loop.valve is None:
            return live.LiveLine()
        counts, silent_s = loop.valve.counts, loop.valve.status.unanswered_since_s
        return live.LiveLine(
            port=self._parts.paths()["valve"],
            device=valve.device.name,
            asked=counts.asked,
            heard=counts.heard,
            garbled=counts.garbled,
            age_s=None if not counts.heard else now_s - silent_s if silent_s else 0.0,
        )

    def _loop(self, loop: ControlLoop) -> live.LiveLoop:
        health = loop.health
        return live.LiveLoop(
            hz=self._rig.loop_hz,
            ticks=health.ticks,
            missed=health.missed_ticks,
            late_p50_us=health.lateness_us(0.5),
            late_p99_us=health.lateness_us(0.99),
            step_us=_finite(health.loop_time_s * 1e6),
        )


def _standing(decision: Output) -> tuple[FaultCode | WarningBit, ...]:
    fault = () if decision.fault is FaultCode.NONE else (decision.fault,)
    return (*fault, *decision.warnings)


def _alarm(explanation: Explanation, since_unix_s: float) -> live.LiveAlarm:
    return live.LiveAlarm(
        code=explanation.code, title=explanation.title, cure=explanation.do, since_unix_s=since_unix_s
    )


def _force(decision: Output, pressure_pa: float) -> live.LiveForce:
    return live.LiveForce(
        requested_n=decision.force_requested_n,
        accepted_n=decision.force_accepted_n,
        applied_n=decision.force_applied_n,
        measured_n=_finite(decision.force_measured_n),
        model_residual_n=_finite(decision.model_residual_n),
        voltage_v=_finite(decision.voltage_v),
        feedforward_v=decision.feedforward_v,
        trim_v=decision.trim_v,
        pressure_kpa=_finite(kilopascal_from_pascal(pressure_pa)),
        limited_by="" if not decision.limited_by else decision.limited_by.name.lower().replace("_", " "),
    )


def _recording(status: Answer) -> live.LiveRecording:
    if not status["recording"]:
        return live.LiveRecording()
    path = Path(status["recording"])
    digits = path.stem
    return live.LiveRecording(
        on=True, number=int(digits) if digits.isdecimal() else None, path=str(path), rows=status["rows"]
    )


def _residual(status: Answer) -> live.LiveResidual:
    said = {key: status.get(key, "") for key in ("sentence", "why_skipped")}
    return live.LiveResidual(cause=status["cause"], effect=status["name"], age_s=status["age_s"], **said)


def _writers(loop: ControlLoop, now_s: float) -> dict[str, live.LiveWriter]:
    return {
        name: live.LiveWriter(peer=peer.identity, age_s=round(now_s - at_s, 1))
        for name, (peer, at_s) in loop.bank.last_writer.items()
    }


def _age_s(date_utc: str) -> float | None:
    try:
        date = datetime.fromisoformat(date_utc)
    except ValueError:
        return None
    return max(0.0, time.time() - (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp())


def _finite(value: float | None) -> float | None:
    return value if value is not None and isfinite(value) else None
