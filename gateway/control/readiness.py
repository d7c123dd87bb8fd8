"""Whether an enable would be accepted now, and where the controller stands when it is asked for something."""

from dataclasses import dataclass
from typing import Final

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.control.inputs import LineStatus
from gateway.control.sample_conditioning import Reading
from gateway.control.supervision.fault_detection import line_words
from gateway.control.transitions import ControllerParts, Transitions
from gateway.control.valve.valve_switch import ValveSwitch
from gateway.registers.words import State

_OFF, _LOST = State.OFF, FaultCode.OUTPUT_LOST
_BLOCKS: Final = dict.fromkeys(State, RefusalReason.NONE) | {
    State.FAULT: RefusalReason.FAULT_LATCHED,
    State.CALIBRATING: RefusalReason.CALIBRATING,
}


@dataclass(frozen=True, slots=True)
class Situation:
    """Where the controller stands at the moment of the question."""

    now_s: float
    state: State
    faulted_s: float  # when the last fault was latched; -inf: never
    lost_s: float  # when the master was lost last, the same
    reading: Reading
    block: RefusalReason  # why an enable would be refused in OFF
    excuse: str  # the machine, where that is the cause of it, or what the valve does
    line_fault: str  # what the output line reports, with its code
    is_output_known: bool  # the output answers, so that its voltage is ours
    is_output_heard: bool  # it answers at all
    voltage_v: float
    is_lowest: bool  # no less voltage can be out
    applied_n: float
    leaving_n: float  # of voltages of late, or that the output may have kept; by the model
    repeats: str  # the load cell seems to be frozen, in words; empty where it does not
    held_n: float | None  # force that is held for a lost master, None where none is
    ramps_down: bool  # the force goes to 0, and then the output off
    stall_words: str  # why nothing is taken that may have waited while the loop stood still; empty where it did not


class Readiness:
    """Tells whether an enable would be accepted now, and where the controller stands; changes nothing of what it is given."""

    def __init__(self, parts: ControllerParts, machine: Transitions, valve: ValveSwitch | None) -> None:
        self._parts, self._machine, self._valve = parts, machine, valve

    def enable_block(self, now_s: float, reading: Reading, line: LineStatus) -> RefusalReason:
        """Return why an enable would be refused now; NONE where it would be accepted, or has been."""
        state = self._machine.state
        return self._block_in_off(now_s, reading, line) if state is _OFF else _BLOCKS[state]

    def situation(self, now_s: float, reading: Reading, line: LineStatus) -> Situation:
        """Return where the controller stands. reading: as old as it is now."""
        loop, machine = self._parts.loop, self._machine
        block = self._block_in_off(now_s, reading, line)
        return Situation(
            now_s=now_s,
            state=machine.state,
            faulted_s=machine.faulted_s,
            lost_s=machine.lost_s,
            reading=reading,
            block=block,
            excuse=self._excuse(block, now_s, reading, line),
            line_fault=f"{line.fault.code} {line_words(line)}" if line.fault else "",
            is_output_known=line.acknowledged_v is not None and block is not RefusalReason.OUTPUT_FAULT,
            is_output_heard=line.fault is not _LOST and not self._parts.faults.is_silent(now_s, line),
            voltage_v=loop.voltage_v,
            is_lowest=loop.is_lowest,
            applied_n=loop.applied_n,
            leaving_n=max(loop.expected.leaving_n(loop.branch_share), loop.left.rise_n),
            repeats=self._parts.faults.repeats,
            held_n=machine.held_n if machine.is_master_lost else None,
            ramps_down=machine.is_ramping_down or machine.is_stopping,
            stall_words=self._parts.faults.stall_words(now_s, line),
        )

    def _block_in_off(self, now_s: float, reading: Reading, line: LineStatus) -> RefusalReason:
        if self._machine.is_stopping:
            return RefusalReason.NOT_READY
        block = self._parts.faults.enable_block(now_s, reading, line)
        return block or (RefusalReason.VALVE_UNKNOWN if self._valve_words(now_s) else block)

    def _excuse(self, block: RefusalReason, now_s: float, reading: Reading, line: LineStatus) -> str:
        if block is RefusalReason.VALVE_UNKNOWN:
            return self._valve_words(now_s)
        return self._parts.faults.excuse(block, now_s, reading, line)

    def _valve_words(self, now_s: float) -> str:
        """What would be a fault of the valve right behind an enable; empty where nothing would."""
        cause = self._valve.first_cause(now_s) if self._valve else None
        return cause.sentence if cause else ""
