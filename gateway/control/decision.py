"""Put a decision into sentences, status bits and warning bits: what one step answers."""

from dataclasses import dataclass, field
from functools import lru_cache
from math import nan
from typing import Final, NamedTuple

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.codes.warning_bits import WarningBit
from gateway.control.force_loop.force_loop import ForceLoop
from gateway.control.inputs import Output
from gateway.control.messages import fault_sentence
from gateway.control.sample_conditioning import Reading
from gateway.control.state_table import ENABLED_STATES
from gateway.registers.command import Command
from gateway.registers.words import LimitedBy, Mode, State, StatusBit

_ENABLED, _READY, _CONTACT, _IN_BAND = 1, 2, 4, 8  # StatusBit as plain integers: an IntFlag operation costs 0.5 us
_FAULT, _WARNING, _LIMITED, _UNREACHABLE = 16, 32, 64, 128
_RESTARTED, _MASTER_LOST = WarningBit.RESTARTED.value, WarningBit.MASTER_LOST.value
_TARGET_UNREACHABLE, _TRIM_SATURATED = WarningBit.TARGET_UNREACHABLE.value, WarningBit.TRIM_SATURATED.value
_STATUS_WORDS: Final = tuple(StatusBit(word) for word in range(256))
_warning_word = lru_cache(WarningBit)  # to make a flag of an integer costs as much as all of the bits
_FORCE, _NOT_LIMITED = Mode.FORCE, LimitedBy.NONE  # as is a member that is looked up on its class, in Python 3.11
_IN_FAULT, _CALIBRATING = State.FAULT, State.CALIBRATING


@dataclass(slots=True)
class StepOutcome:
    """Answer of a step beside the voltage."""

    events: list[str] = field(default_factory=list)
    clear_command: bool = False
    release_owner: bool = False

    def tell(self, *sentences: str) -> None:
        """Add sentences for the log; empty ones are none."""
        self.events.extend(filter(None, sentences))

    @property
    def is_empty(self) -> bool:
        """Decide whether there is nothing to say and nothing to do."""
        return not (self.events or self.clear_command or self.release_owner)


class ControllerStatus(NamedTuple):
    """The state of the controller at the end of a step, for the output."""

    state: State
    fault: FaultCode
    block: RefusalReason
    warnings: int
    touching: bool
    accepted_n: float
    expected_cell_n: float
    calibration_phase: int = 0
    calibration_progress: float = 0.0
    calibration_time_left_s: float = 0.0


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


def status_bits(status: ControllerStatus, loop: ForceLoop) -> int:
    """Return status_word: StatusBit as a plain integer."""
    enabled = status.state in ENABLED_STATES
    return (
        (_ENABLED if enabled else 0)
        | (_READY if not status.block else 0)
        | (_CONTACT if status.touching else 0)
        | (_IN_BAND if loop.in_band else 0)
        | (_FAULT if status.state is _IN_FAULT else 0)
        | (_WARNING if status.warnings else 0)
        | (_LIMITED if loop.limited_by is not _NOT_LIMITED else 0)
        | (_UNREACHABLE if loop.unreachable else 0)
    )


def warning_bits(word: int, loop: ForceLoop, restarted: bool, master_lost: bool) -> int:
    """Return the warning word. word: what the line and the process warn of."""
    return (
        word
        | (_RESTARTED if restarted else 0)
        | (_TARGET_UNREACHABLE if loop.unreachable else 0)
        | (_TRIM_SATURATED if loop.is_trim_at_limit else 0)
        | (_MASTER_LOST if master_lost else 0)
    )


def output_of(
    command: Command, status: ControllerStatus, loop: ForceLoop, reading: Reading, outcome: StepOutcome
) -> Output:
    """Return the answer of a step. The measured force is nan unless fresh and usable: a stale number with an age is still a lie
    to most readers."""
    is_force = command.mode is _FORCE or status.state is _CALIBRATING
    believed = reading.is_fresh and reading.is_usable
    return Output(
        loop.voltage_v,
        loop.feedforward_v,
        loop.trim_v,
        loop.limited_by,
        status.state,
        _STATUS_WORDS[status_bits(status, loop)],
        status.fault,
        _warning_word(status.warnings),
        force_measured_n=reading.contact_n if believed else nan,
        force_requested_n=command.force_requested_n,
        force_accepted_n=status.accepted_n if is_force else 0.0,
        force_applied_n=loop.applied_n if is_force else 0.0,
        model_residual_n=reading.cell_n - status.expected_cell_n if believed else nan,
        sample_age_s=reading.age_s,
        heartbeat_echo=command.heartbeat,
        sequence_echo=command.command_sequence,
        calibration_phase=status.calibration_phase,
        calibration_progress=status.calibration_progress,
        calibration_time_left_s=status.calibration_time_left_s,
        enable_block=status.block,
        clear_command=outcome.clear_command,
        release_owner=outcome.release_owner,
        events=tuple(outcome.events),
    )
