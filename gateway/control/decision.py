"""A decision put into words and bits: what one step answers."""

from dataclasses import dataclass, field
from math import nan

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


@dataclass(slots=True)
class Outcome:
    """What a step wants from its caller besides the voltage."""

    events: list[str] = field(default_factory=list)
    clear_command: bool = False
    release_owner: bool = False


@dataclass(frozen=True, slots=True)
class ControllerStatus:
    """Where the controller stands at the end of a step."""

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
    """What a caller writes when `step` raised: the safe voltage, latched fault. `Controller.safe_output` knows the
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


def status_bits(standing: ControllerStatus, pursuit: ForceLoop) -> int:
    enabled = standing.state in ENABLED_STATES
    return (
        (_ENABLED if enabled else 0)
        | (_READY if not standing.block else 0)
        | (_CONTACT if standing.touching else 0)
        | (_IN_BAND if pursuit.in_band else 0)
        | (_FAULT if standing.state is State.FAULT else 0)
        | (_WARNING if standing.warnings else 0)
        | (_LIMITED if pursuit.limited_by is not LimitedBy.NONE else 0)
        | (_UNREACHABLE if pursuit.unreachable else 0)
    )


def warning_bits(word: int, pursuit: ForceLoop, restarted: bool, master_lost: bool) -> int:
    """word: what the line and the process warn of."""
    return (
        word
        | (WarningBit.RESTARTED.value if restarted else 0)
        | (WarningBit.TARGET_UNREACHABLE.value if pursuit.unreachable else 0)
        | (WarningBit.TRIM_SATURATED.value if pursuit.trim.limited_by else 0)
        | (WarningBit.MASTER_LOST.value if master_lost else 0)
    )


def output_of(
    command: Command, standing: ControllerStatus, pursuit: ForceLoop, reading: Reading, outcome: Outcome
) -> Output:
    """The frozen answer. The measured force is nan unless fresh and usable: a stale number with an age is still a lie
    to most readers."""
    is_force = command.mode is Mode.FORCE or standing.state is State.CALIBRATING
    believed = reading.is_fresh and reading.is_usable
    return Output(
        pursuit.stage.voltage_v,
        pursuit.feedforward_v,
        pursuit.trim.value_v,
        pursuit.limited_by,
        standing.state,
        StatusBit(status_bits(standing, pursuit)),
        standing.fault,
        WarningBit(standing.warnings),
        force_measured_n=reading.contact_n if believed else nan,
        force_requested_n=command.force_requested_n,
        force_accepted_n=standing.accepted_n if is_force else 0.0,
        force_applied_n=pursuit.law.applied_n if is_force else 0.0,
        model_residual_n=reading.cell_n - standing.expected_cell_n if believed else nan,
        sample_age_s=reading.age_s,
        heartbeat_echo=command.heartbeat,
        sequence_echo=command.command_sequence,
        calibration_phase=standing.calibration_phase,
        calibration_progress=standing.calibration_progress,
        calibration_time_left_s=standing.calibration_time_left_s,
        enable_block=standing.block,
        clear_command=outcome.clear_command,
        release_owner=outcome.release_owner,
        events=tuple(outcome.events),
    )
