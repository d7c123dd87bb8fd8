"""What a rig file may say about control. Each field carries its unit and its bounds; profiles builds them from YAML
and the JSON schema from the same annotations, so there is one place to change."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Final

from annotated_types import Ge, Gt, Le

from gateway import defaults
from gateway.bsfm.response.second_order import SecondOrder
from gateway.defaults import STRICT


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Bounds that no command passes."""

    __pydantic_config__ = STRICT
    force_max_n: Annotated[float, Gt(0), Le(300)]  # largest accepted setpoint (int16 at 0.01 N carries 327)
    over_force_n: Annotated[float, Gt(0)]  # measured force that trips OVER_FORCE
    over_force_samples: Annotated[int, Ge(1), Le(10)] = 3  # so many readings in a row trip it
    smallest_force_n: Annotated[float, Ge(0)] = 0.0  # below it the output is 0 V
    voltage_min_v: Annotated[float, Ge(0)] = 0.0  # least voltage while enabled: that of 0 N
    voltage_max_v: Annotated[float, Gt(0), Le(10)] = defaults.VOLTAGE_MAX_V  # largest voltage that is sent
    safe_voltage_v: Annotated[float, Ge(0)] = 0.0  # out while off and in a fault; 0 V may drop a tool
    voltage_slew_v_per_s: Annotated[float, Gt(0)] = 100.0  # rising only; falling may be immediate


@dataclass(frozen=True, slots=True, kw_only=True)
class Defaults:
    """Values that 0 in a command register means."""

    __pydantic_config__ = STRICT
    force_ramp_n_per_s: Annotated[float, Gt(0), Le(3276.7)] = 200.0  # rate at which the setpoint is approached
    precontact_force_n: Annotated[float, Ge(0)] = 2.0  # before contact; the calibration's friction is its least
    contact_ramp_s: Annotated[float, Ge(0), Le(10)] = 0.0  # from contact to the setpoint; 0: by force_ramp_n_per_s
    in_band_tolerance_n: Annotated[float, Gt(0)] = 1.0  # half the width of the band around the setpoint
    in_band_time_s: Annotated[float, Ge(0)] = 0.1  # within the band for so long: in_band
    contact_threshold_n: Annotated[float, Gt(0)] = 0.5  # measured force from which there is contact
    payload_kg: Annotated[float, Ge(0)] = 0.0  # what hangs on the cell; its weight is taken off by tilt_angle


OVERSHOOT_BANDS: Final = 2.0  # in_band_tolerance_n, so far a rise may go beyond its setpoint for three samples


def over_force_room_n(limits: Limits, defaults: Defaults) -> float | None:
    """Return how far over-force is above the largest setpoint, N, where a usual rise to that may trip it; else None."""
    room_n = limits.over_force_n - limits.force_max_n
    return room_n if room_n < OVERSHOOT_BANDS * defaults.in_band_tolerance_n else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Trim:
    """The bounded integral from the load cell. gain 0 switches it off: feedforward alone."""

    __pydantic_config__ = STRICT
    gain_v_per_n_s: Annotated[float, Ge(0)] = 0.0  # of the integral; 0: feedforward alone
    limit_v: Annotated[float, Ge(0), Le(3)] = 0.5  # largest correction, of either sign
    dead_zone_n: Annotated[float, Ge(0)] = 0.15  # errors below it are stiction's: integrating them makes a limit cycle
    memory_n: Annotated[float, Gt(0)] = 20.0  # travel of the target over which a correction fades to 37 %


@dataclass(frozen=True, slots=True, kw_only=True)
class LeadSettings:
    """The lags of the regulator, which the force law inverts so that steps settle faster. 0 and 0: off."""

    __pydantic_config__ = STRICT
    lag_s: Annotated[float, Ge(0), Le(2)] = 0.0  # of the regulator; rather too short than too long; 0: no lead
    second_lag_s: Annotated[float, Ge(0), Le(2)] = 0.0  # behind the first; 0: there is one lag only


class ResponseSource(StrEnum):
    """Source of the rig's timing that control uses."""

    MEASURED = "measured"  # by the calibration in use, where it has measured it; else the numbers of this file
    RIG = "rig"  # the numbers of this file: trim.gain_v_per_n_s, lead, supervision.response_lag_s


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopTiming:
    """What control derives from a measured response (gateway.control.force_loop.response_timing). integral_per_s: of the
    trim, N/s of correction by N of error."""

    dead_time_s: float
    lags: SecondOrder
    landing_s: float  # how much later than dead time the force arrives with the lags inverted
    integral_per_s: float


class LeaseAction(StrEnum):
    """Action when the master is lost."""

    FAULT = "fault"  # safe voltage at once, latched
    HOLD = "hold"  # keep what is applied of the last setpoint, raise a warning
    RAMP = "ramp"  # ramp to 0 N, then off


@dataclass(frozen=True, slots=True, kw_only=True)
class Supervision:
    """Bounds of the supervision, most of them in time."""

    __pydantic_config__ = STRICT
    lease_s: Annotated[float, Gt(0)] | None = None  # null: a command lasts until the next one
    lease_action: LeaseAction = LeaseAction.FAULT  # when it ends: fault, hold or ramp
    sample_timeout_s: Annotated[float, Gt(0)] = 0.05  # no reading for so long: a fault
    output_timeout_s: Annotated[float, Gt(0)] = 0.1  # no answer of the output for so long: a fault
    stall_s: Annotated[float, Gt(0)] = defaults.STALL_S  # no tick for so long: safe voltage, and a new control process
    frozen_s: Annotated[float, Gt(0)] = 0.5  # equal readings for so long while the force should move: a fault
    sample_quantum_n: Annotated[float, Gt(0)] = 0.1  # one count of the amplifier
    saturation_n: Annotated[float, Gt(0)] = 98.0  # raw at or beyond 98 % of the cell's range
    frozen_equal_samples: Annotated[int, Ge(3)] | None = None  # where noise shows in every reading: so many equal ones
    unreachable_s: Annotated[float, Gt(0)] = 2.0  # held off the setpoint this long: target-unreachable
    response_lag_s: Annotated[float, Gt(0)] = 0.2  # voltage to force: delay and lags of the rig as one first-order lag
    stuck_n: Annotated[float, Gt(0)] = (
        15.0  # measured at the safe voltage, of either sign: stuck, or a wrong zero; no enable
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class SelfTestSettings:
    """What the self-test (control_word bit 6) may do."""

    __pydantic_config__ = STRICT
    force_n: Annotated[float, Ge(0), Le(300)] = 5.0  # largest force, as the load cell feels it; 0: nothing moves
    zero_n: Annotated[float, Gt(0), Le(20)] = 1.0  # rest force beyond what friction keeps that fails; half of it warns


class SafeDirection(StrEnum):
    """Where the valve goes while the output is off: after a start, a disable, a fault."""

    PUSH = "push"
    PULL = "pull"
    KEEP = "keep"  # where it is


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveControl:
    """How the directional valve (control_word bit 4) is switched, and what pulling is calculated with."""

    __pydantic_config__ = STRICT
    dwell_s: Annotated[float, Ge(0), Le(10)] = 0.3  # without pressure before it switches, and after its readback
    timeout_s: Annotated[float, Gt(0), Le(5)] = 0.5  # for its answer and its readback, then a fault
    safe: SafeDirection = SafeDirection.PUSH  # while the output is off: push, pull, or keep where it is
    pull_area_share: Annotated[float, Gt(0), Le(1)] = 0.75  # of the piston that the rod leaves free: 1 - (rod / bore)^2


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlSettings:
    """All that a rig file says about control, and the timing that a calibration has measured."""

    limits: Limits
    defaults: Defaults = Defaults()
    trim: Trim = Trim()
    supervision: Supervision = Supervision()
    lead: LeadSettings = LeadSettings()
    response: ResponseSource = ResponseSource.MEASURED
    self_test: SelfTestSettings | None = None  # null: the rig offers none
    valve: ValveControl | None = None  # null: the rig has none
    timing: LoopTiming | None = None  # of the calibration in use, None where nothing was measured or the rig file rules
