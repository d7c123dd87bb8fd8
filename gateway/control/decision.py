"""Compose the answer of a step, by where the parts of control stand at its end; and what is written where a step raised."""

from functools import lru_cache
from math import nan
from typing import Final

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.codes.warning_bits import WarningBit
from gateway.control.inputs import LineStatus, Output
from gateway.control.messages import fault_sentence
from gateway.control.readiness import Readiness
from gateway.control.sample_conditioning import Reading, SampleConditioner
from gateway.control.transitions import ControllerParts, Transitions
from gateway.control.valve.valve_switch import ValveSwitch
from gateway.registers.words import LimitedBy, Mode, State, StatusBit

_ENABLED, _READY, _CONTACT, _IN_BAND = 1, 2, 4, 8  # StatusBit as plain integers: an IntFlag operation costs 0.5 us
_FAULT, _WARNING, _LIMITED, _UNREACHABLE = 16, 32, 64, 128
_PULLING, _SWITCHING = 256, 512
_STATUS_WORDS: Final = tuple(StatusBit(word) for word in range(1024))
_RESTARTED, _MASTER_LOST = WarningBit.RESTARTED.value, WarningBit.MASTER_LOST.value
_TARGET_UNREACHABLE, _TRIM_SATURATED = WarningBit.TARGET_UNREACHABLE.value, WarningBit.TRIM_SATURATED.value
_FORCE_UNSTEADY, _ZERO_DOUBTED = WarningBit.FORCE_UNSTEADY.value, WarningBit.ZERO_DOUBTED.value
_warning_word = lru_cache(WarningBit)  # to make a flag of an integer costs as much as all of its bits
_FORCE, _NOT_LIMITED = Mode.FORCE, LimitedBy.NONE
_IN_FAULT, _CALIBRATING = State.FAULT, State.CALIBRATING


def safe_output(fault: FaultCode, safe_voltage_v: float = 0.0) -> Output:
    """Return what a caller writes when `step` raised: the safe voltage, latched fault. `Controller.safe_output` knows the
    rig's voltage."""
    return Output(
        safe_voltage_v,
        state=State.FAULT,
        status=StatusBit.FAULT,
        fault=fault,
        enable_block=RefusalReason.FAULT_LATCHED,
        clear_command=True,
        events=(fault_sentence(fault, "safe voltage written"),),
    )


class OutputComposer:
    """Reads the parts of control and changes nothing of them."""

    def __init__(
        self,
        parts: ControllerParts,
        machine: Transitions,
        readiness: Readiness,
        conditioner: SampleConditioner,
        valve: ValveSwitch | None,
    ) -> None:
        self._parts, self._machine, self._readiness, self._valve = parts, machine, readiness, valve
        self._conditioner = conditioner

    def compose(self, now_s: float, reading: Reading, line: LineStatus, touching: bool, outside_n: float) -> Output:
        """Return the answer of a step. outside_n: contact force that neither slide nor payload gives.

        The measured force is nan unless fresh and usable: a stale number with an age is still a lie to most readers."""
        machine, loop, run = self._machine, self._parts.loop, self._parts.run
        command, state, outcome = self._parts.commands.command, machine.state, machine.outcome
        block = self._readiness.enable_block(now_s, reading, line)
        warnings = self._warnings(int(line.warnings))
        is_force = command.mode is _FORCE or state is _CALIBRATING
        believed = reading.is_fresh and reading.is_usable
        return Output(
            loop.voltage_v,
            loop.feedforward_v,
            loop.trim_v,
            loop.limited_by,
            state,
            self._status(touching, warnings, is_ready=not block),
            machine.fault,
            _warning_word(warnings),
            force_measured_n=self._as_read(reading.contact_n) if believed else nan,
            force_requested_n=command.force_requested_n,
            force_accepted_n=self._accepted_n if is_force else 0.0,
            force_applied_n=loop.applied_n if is_force else 0.0,
            model_residual_n=self._as_read(reading.cell_n - (loop.expected_n + outside_n)) if believed else nan,
            sample_age_s=reading.age_s,
            heartbeat_echo=command.heartbeat,
            sequence_echo=command.command_sequence,
            calibration_phase=run.phase,
            calibration_progress=run.progress,
            calibration_time_left_s=run.eta_s,
            enable_block=block,
            valve=self._valve.order if self._valve else None,
            clear_command=outcome.clear_command,
            resets_device=outcome.resets_device,
            release_owner=outcome.release_owner,
            events=tuple(outcome.events),
        )

    def _as_read(self, force_n: float) -> float:
        """A force as the load cell shows it: negative where the tool pulls, for control calculates with positive ones."""
        return -force_n if self._valve and self._valve.is_pulling else force_n

    @property
    def _accepted_n(self) -> float:
        """The target that control pursues, 0 where there is none."""
        machine, run = self._machine, self._parts.run
        if not machine.is_enabled:
            return 0.0
        return run.target_n or (0.0 if machine.is_ramping_down else machine.hold(self._parts.commands.demand).force_n)

    def _status(self, touching: bool, warnings: int, *, is_ready: bool) -> StatusBit:
        machine, loop = self._machine, self._parts.loop
        return _STATUS_WORDS[
            (_ENABLED if machine.is_enabled else 0)
            | (_READY if is_ready else 0)
            | (_CONTACT if touching else 0)
            | (_IN_BAND if loop.in_band else 0)
            | (_FAULT if machine.state is _IN_FAULT else 0)
            | (_WARNING if warnings else 0)
            | (_LIMITED if loop.limited_by is not _NOT_LIMITED else 0)
            | (_UNREACHABLE if warnings & _TARGET_UNREACHABLE else 0)
            | (_PULLING if self._valve and self._valve.is_pulling else 0)
            | (_SWITCHING if self._valve and self._valve.is_switching else 0)
        ]

    def _warnings(self, word: int) -> int:
        """word: what the line and the process warn of."""
        machine, loop = self._machine, self._parts.loop
        return (
            word
            | (_RESTARTED if machine.is_restarted else 0)
            | (_TARGET_UNREACHABLE if loop.unreachable else 0)
            | (_TRIM_SATURATED if loop.is_trim_at_limit else 0)
            | (_FORCE_UNSTEADY if loop.settling.is_noisy else 0)
            | (_ZERO_DOUBTED if self._conditioner.is_doubted else 0)
            | (_MASTER_LOST if machine.is_master_lost else 0)
        )
