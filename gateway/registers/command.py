"""The frozen snapshot that the bank hands to control, and the snapshot that control's decision publishes.

Tuples, for both are made at every write or step, and a frozen dataclass of so many fields takes seven times as long.
"""

from math import nan
from typing import Final, NamedTuple, TypeAlias

from gateway.codes.faults import FaultCode
from gateway.registers.words import ControlBit, LimitedBy, Mode, State

_NO_BIT: Final = ControlBit(0)

Channel: TypeAlias = tuple[str, str, int, int, int]
"""Identity, host, port, address and bytes of a write: a master that writes in cycles has one for each of its frames."""
NO_CHANNEL: Final = ("", "", 0, 0, 0)
NO_BEAT: Final = ("", "", 0, 0, 1)
"""The channel of a write that brings no heartbeat, or of which none is taken: the one of its command is that which stood."""


class Command(NamedTuple):
    """One accepted write of the command block, whole, SI units. 0 in a field that has a default of the rig means that one.

    number counts accepted writes (control sees a new one by it); received_s is monotonic; peer is the writer's address;
    channel tells its frames apart.
    stops: whatever the control word was, this write wants the output off. lowered_from_n: what the master wrote as setpoint
    before a calibration with a smaller limit lowered it, 0 where none did. has_waited: it was asked for a while ago, in a pile
    of requests: its master may be long gone. repeats: no other heartbeat than when its master was refused, or in the
    process before: its program may stand still.
    """

    control_word: ControlBit = _NO_BIT
    force_setpoint_n: float = 0.0
    force_ramp_n_per_s: float = 0.0
    mode: Mode = Mode.FORCE
    heartbeat: int = 0
    voltage_setpoint_v: float = 0.0
    tilt_angle_rad: float = 0.0
    precontact_force_n: float = 0.0
    contact_ramp_s: float = 0.0
    payload_kg: float = 0.0
    command_sequence: int = 0
    in_band_tolerance_n: float = 0.0
    in_band_time_s: float = 0.0
    number: int = 0
    received_s: float = 0.0
    peer: str = ""
    channel: Channel = NO_CHANNEL
    stops: bool = False
    lowered_from_n: float = 0.0
    has_waited: bool = False
    repeats: bool = False

    @property
    def force_requested_n(self) -> float:
        """The setpoint as the master wrote it."""
        return self.lowered_from_n or self.force_setpoint_n


class Status(NamedTuple):
    """Everything that control and service publish, SI units; nan = unavailable. Owner and refusals are the bank's own."""

    state: State = State.OFF
    status_word: int = 0
    force_measured_n: float = nan
    force_requested_n: float = 0.0
    force_accepted_n: float = 0.0
    force_applied_n: float = 0.0
    output_voltage_v: float = nan
    feedforward_v: float = 0.0
    trim_v: float = 0.0
    limited_by: LimitedBy = LimitedBy.NONE
    fault_code: FaultCode = FaultCode.NONE
    warning_word: int = 0
    sample_age_s: float = nan
    loop_time_s: float = nan
    heartbeat_echo: int = 0
    sequence_echo: int = 0
    calibration_id: int = 0
    model_residual_n: float = nan
    pressure_pa: float = nan
    missed_ticks: int = 0
    calibration_phase: int = 0
    calibration_progress: float = 0.0
    calibration_stored: int = 0
    calibration_time_left_s: float = 0.0
    residual_cause: int = 0  # ResidualCause
    plant_id: int = 0
