"""What control is told besides settings, command and sample, and what a step answers."""

from dataclasses import dataclass
from math import inf, nan
from typing import Final, NamedTuple

from gateway.bsfm import Bsfm
from gateway.bsfm.model import Response
from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.codes.warning_bits import WarningBit
from gateway.control.blame_for_silence import NOT_HELD, Held
from gateway.control.sample_conditioning import Reading
from gateway.devices.valve_profile import ValveDirection
from gateway.registers.words import LimitedBy, State, StatusBit

_NO_WARNING: Final = WarningBit(0)
_NO_STATUS: Final = StatusBit(0)


@dataclass(frozen=True, slots=True)
class CalibrationInUse:
    """A calibration as control uses it. model: as volts are sent (`apply_command_map`); response: as the calibration measured
    it, None where the rig file's timing counts; noise_n: of the load cell, as it was measured, 0 where that is not known;
    pull_model: measured while pulling, as volts are sent, None where it follows from that of pushing."""

    model: Bsfm
    number: int
    response: Response | None = None
    noise_n: float = 0.0
    pull_model: Bsfm | None = None


@dataclass(slots=True)
class WireCounts:
    """Counts of one serial line since the start. asked: questions that went out, 0 of a device that talks by itself; heard:
    answers or messages understood; garbled: what could not be read."""

    asked: int = 0
    heard: int = 0
    garbled: int = 0

    def since(self, before: "WireCounts") -> "WireCounts":
        """Return what has been counted since then."""
        return WireCounts(self.asked - before.asked, self.heard - before.heard, self.garbled - before.garbled)


class ValveStatus(NamedTuple):
    """What the valve's line knows. stands: direction by the last readback, None before the first; unanswered_since_s: time of
    the oldest question without an answer, None if all are answered; said: what came in its place; lost: its port is away."""

    stands: ValveDirection | None = None
    unanswered_since_s: float | None = None
    lost: bool = False
    said: str = ""


class LineStatus(NamedTuple):
    """What the output line and the process know at the time of a step."""

    acknowledged_v: float | None = None  # that the device confirmed last; None before the first
    unanswered_since_s: float | None = None  # monotonic, of the oldest write without an answer; None: no such
    fault: FaultCode = FaultCode.NONE  # what the line itself reports: refused, altered, lost
    said: str = ""  # the device's own words to that, where it has said something
    cell_lost: bool = False
    pressure_pa: float = nan
    pressure_pa_per_v: float = nan  # of the output device, by the ranges in its profile; nan: nobody knows
    owner_connected: bool = True  # False once the owning master's last connection has closed
    late_s: float = 0.0  # how late this step runs
    waited_s: float | None = None  # so much of it the process was not let run; None: the machine does not count that
    warnings: WarningBit = _NO_WARNING
    temperature_c: float = nan  # of the load cell, for compensation; nan: nobody knows
    feed_mm_s: float = nan  # under the tool, for compensation; nan: nobody knows
    sent_v: float | None = None  # that went out last on the wire, which carries one at a time; None: nobody knows
    wire_s: float = nan  # how long one setting keeps the wire; nan: nobody knows
    cell_held: Held = NOT_HELD  # what kept us from hearing a device that has not been heard for a while
    output_held: Held = NOT_HELD  # the same of the output device
    output_counts: WireCounts | None = None  # of its line, growing; None: nobody counts
    cell_counts: WireCounts | None = None  # of its line, growing; None: nobody counts
    valve: ValveStatus | None = None  # the directional valve; None: the rig has none
    standing_v: float | None = None  # that surely stands there; None: another one is on its way, or nobody knows
    cell_says: str = ""  # what the cell says in place of readings
    answer_late_s: float = 0.0  # what the last answer took, where it came after its time
    suspended_s: float = 0.0  # so much of late_s the whole machine was suspended
    withheld: tuple[float, str] = 0.0, ""  # seconds kept from us from outside about then; by whom
    owner_refused: str = ""  # why the owner's last write was refused; empty where it was taken
    owner_refused_s: float = -inf  # when one of them was, monotonic


class LoopInputs(NamedTuple):
    """What one step of the force loop knows. expected_n: the model's contact force at the lagged voltage; held_back: the
    first rise looks wrong; outside_n: contact force that neither slide nor payload gives (compensation)."""

    now_s: float
    dt_s: float
    reading: Reading
    touching: bool
    expected_n: float
    held_back: bool = False
    outside_n: float = 0.0


class Output(NamedTuple):
    """One decision with its reasons. voltage_v is what must be written now."""

    voltage_v: float
    feedforward_v: float = 0.0
    trim_v: float = 0.0
    limited_by: LimitedBy = LimitedBy.NONE
    state: State = State.OFF
    status: StatusBit = _NO_STATUS
    fault: FaultCode = FaultCode.NONE
    warnings: WarningBit = _NO_WARNING
    force_measured_n: float = nan  # tared, gravity compensated
    force_requested_n: float = 0.0
    force_accepted_n: float = 0.0  # the target that control pursues: 0 when not enabled
    force_applied_n: float = 0.0  # the ramped target of this instant
    model_residual_n: float = nan  # measured minus what the model expects at this voltage
    sample_age_s: float = nan
    heartbeat_echo: int = 0
    sequence_echo: int = 0
    calibration_phase: int = 0
    calibration_progress: float = 0.0
    calibration_time_left_s: float = 0.0
    enable_block: RefusalReason = RefusalReason.NONE  # why an enable would be refused now
    valve: ValveDirection | None = None  # what the valve's device is to be told; None: nothing, or no valve
    clear_command: bool = False  # service: bank.clear_command(): the output went off
    resets_device: bool = False  # service: clear what the output device has latched: somebody has reset
    release_owner: bool = False  # service: bank.release_owner(): the lease is over
    events: tuple[str, ...] = ()  # sentences for the log, each starting with its code where it has one
