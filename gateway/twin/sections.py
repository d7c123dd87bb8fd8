"""The named physical parameters, section by section; plant.py joins them. Every effect has a null value: its default.

Fields without a null value are the dimensions of the machine (full scales, area, pad stiffness); their defaults are
those of the ITV2050 and the 100 mm2 slide. A bound that is never met is UNLIMITED rather than infinity, which JSON (and
so the schema for editors) cannot say. The functions of the effects stand in gateway/twin/effects, regulator.py and friction.py.
"""

from dataclasses import dataclass
from typing import Annotated

from annotated_types import Ge, Gt, Le

from gateway.defaults import PAD_STIFFNESS_N_PER_M, STRICT, UNLIMITED

NotNegative = Annotated[float, Ge(0)]
Positive = Annotated[float, Gt(0)]
Share = Annotated[float, Ge(0), Le(1)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Regulator:
    """Electro-pneumatic regulator: command voltage in, gauge pressure out."""

    __pydantic_config__ = STRICT
    full_scale_v: Positive = 10.0  # command at full scale
    full_scale_pa: Positive = 0.9e6  # gauge pressure at full scale
    command_step_v: NotNegative = 0.0  # one step of the command input; 10/1023 V for SMC's 10 bits
    command_bow: Annotated[float, Ge(-0.25), Le(0.25)] = 0.0  # command too high in mid scale, share of full scale
    command_s: Annotated[float, Ge(-0.125), Le(0.125)] = (
        0.0  # S-shaped error, no seconds: too low at 1/4, too high at 3/4
    )
    dead_band_pa: NotNegative = 0.0  # a change of the target smaller than this is not noticed
    hysteresis_pa: NotNegative = 0.0  # full width of the loop target -> pressure (play)
    supply_pa: NotNegative = UNLIMITED  # the air line: no pressure above it
    leak_per_s: NotNegative = 0.0  # rate at which the target decays while the command does not change
    droop_pa_per_pa: float = 0.0  # pressure gained per supply pressure above the reference
    droop_share_per_pa: float = 0.0  # the same as a share of the target
    droop_reference_pa: Positive = 0.6e6  # supply at which the above is nothing, no effect of its own
    delay_s: Annotated[float, Ge(0), Le(2)] = 0.0  # wire, converter and valve before anything moves
    slew_pa_per_s: Positive = UNLIMITED  # fastest change of pressure
    lag_s: NotNegative = 0.0  # first-order lag
    fill_slowdown: Annotated[float, Gt(-1)] = 0.0  # the lag is this share longer when the pressure rises (a leak)
    second_lag_s: NotNegative = 0.0  # another lag behind it
    ceiling_pa: Positive = UNLIMITED  # the air line again, met while the pressure is still rising
    leak_flow_pa: NotNegative = 0.0  # pressure that a hole behind the valve costs at 0.3 MPa, by the flow through it
    hunting_pa: NotNegative = 0.0  # amplitude of a limit cycle on the pressure, while there is pressure
    hunting_hz: Positive = 5.0  # its frequency, no effect of its own
    hunting_phase_rad: float = 0.0  # its phase at time 0, no effect of its own


@dataclass(frozen=True, slots=True, kw_only=True)
class Cylinder:
    """The slide that turns pressure into thrust. It rests on its back stop at 0 m."""

    __pydantic_config__ = STRICT
    area_m2: Positive = 1.0e-4  # effective, of all pistons
    stroke_m: Positive = UNLIMITED  # travel from the back stop to the end stop
    chamber_lag_s: NotNegative = 0.0  # first-order lag of the chamber's pressure behind the gauge's (hose, throttle)


@dataclass(frozen=True, slots=True, kw_only=True)
class Friction:
    """Friction of seals and guide: limit = coulomb + load_dependent x |thrust| + stribeck / (1 + (v / v_s)^2) + ..."""

    __pydantic_config__ = STRICT
    coulomb_n: NotNegative = 0.0  # at any load and speed
    load_dependent_n_per_n: Share = 0.0  # per newton of pressure thrust
    asymmetry_n: float = 0.0  # more of it moving out, less moving in
    stribeck_n: NotNegative = 0.0  # what standing adds to sliding
    stribeck_speed_m_per_s: Positive = 0.01  # scale of the above, no effect of its own
    viscous_n_s_per_m: NotNegative = 0.0  # per speed
    asymmetry_n_s_per_m: float = 0.0  # more of it moving out, less moving in
    presliding_m: NotNegative = 0.0  # travel until the last Maxwell-slip element slides; 0: rigid Coulomb
    dwell_stiction_n: NotNegative = 0.0  # what a long rest adds until the slide has moved again
    dwell_stiction_s: Positive = 5.0  # time constant of the rest, no effect of its own
    side_load_n_s_per_mm: NotNegative = 0.0  # more friction per feed speed (needs the feed)
    side_load_n_per_n: NotNegative = 0.0  # more friction per newton of thrust while the feed moves (needs the feed)
    side_load_tilt_n: NotNegative = 0.0  # more friction by the sine of the tilt (needs the tilt)
    side_load_n_per_mm: NotNegative = 0.0  # more friction per distance from the middle (needs the position)
    place_n_per_mm: float = 0.0  # slope of the friction along the stroke (needs the position)
    place_n_per_mm2: float = 0.0  # curvature of the same
    place_asymmetry_n_per_mm: float = 0.0  # slope of what moving out has more, and moving in less
    place_asymmetry_n_per_mm2: float = 0.0  # curvature of the same


@dataclass(frozen=True, slots=True, kw_only=True)
class Contact:
    """End effector and pad against the workpiece. The pad pushes, it never pulls."""

    __pydantic_config__ = STRICT
    pad_stiffness_n_per_m: Positive = PAD_STIFFNESS_N_PER_M  # pad and workpiece together
    pad_damping_n_s_per_m: NotNegative = 0.0  # of the same
    gap_m: NotNegative = 0.0  # travel from the back stop to the workpiece
    mass_kg: NotNegative = 0.0  # what moves: end effector and slide
    tilt_deg: float = 0.0  # 0: the tool points down and its weight presses; 90: level, no weight; 180: up
    lost_n: NotNegative = 0.0  # thrust that closes a gap before any force passes
    backlash_n: NotNegative = 0.0  # full width of a play of the force
    creep_share: Annotated[float, Gt(-1)] = 0.0  # the pad gives: this share of the force follows late
    creep_s: Positive = 10.0  # its time constant, no effect of its own
    hardening: float = 0.0  # share by which 10 N reads high, growing with the root of the force
    wear_per_m: float = 0.0  # share of the force lost per distance ground
    wear_n_per_m: float = 0.0  # force gained per distance ground
    tilt_n: float = 0.0  # weight by the cosine of the measured tilt
    tilt_zero_deg: float = 0.0  # tilt where the above is largest, no effect of its own
    feed_drag_n_s_per_mm: float = 0.0  # per feed speed
    feed_drag_n: float = 0.0  # by the sign of the feed
    feed_drag_abs_n_s_per_mm: float = 0.0  # per feed speed, whatever its sign
    spindle_n: float = 0.0  # amplitude of the spindle's vibration
    spindle_n_per_krpm2: float = 0.0  # amplitude per speed squared (unbalance)
    spindle_order: Positive = 1.0  # vibrations per turn, no effect of its own
    spindle_phase_rad: float = 0.0  # phase at time 0, no effect of its own
    position_n_per_mm: float = 0.0  # slope of the force along the path
    position_n_per_mm2: float = 0.0  # curvature of the same
    ripple_n: float = 0.0  # amplitude of a periodic force along the path
    ripple_pitch_mm: Positive = 5.0  # its period, no effect of its own
    ripple_phase_rad: float = 0.0  # its phase at position 0, no effect of its own
    stop_stiffness_n_per_mm: NotNegative = 0.0  # an elastic end stop met at the position below
    stop_mm: float = UNLIMITED  # where it is met, no effect of its own


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadCell:
    """Load cell, amplifier and logging, under the workpiece: what becomes of the contact force until it is written."""

    __pydantic_config__ = STRICT
    filter_s: NotNegative = 0.0  # first-order lag of the amplifier
    noise_n: NotNegative = 0.0  # standard deviation of one reading
    quantum_n: NotNegative = 0.0  # one count of the converter
    range_n: Positive = UNLIMITED  # readings stop at +- this
    zero_n: float = 0.0  # reading without force
    zero_n_per_k: float = 0.0  # the same per temperature above the reference
    span_per_k: float = 0.0  # share of the force per temperature above the reference
    reference_c: float = 20.0  # temperature where the above are nothing, no effect of its own
    warm_up_n: float = 0.0  # reading too high when switched on, at time 0
    warm_up_s: Positive = 60.0  # time constant after which it has gone, no effect of its own
    drift_n_per_s: float = 0.0  # zero per time
    quadratic_per_n: float = 0.0  # share by which the reading grows per force
    cubic_per_n2: float = 0.0  # the same per force squared
    hum_n: float = 0.0  # amplitude of the mains in the reading
    hum_hz: Positive = 50.0  # its frequency, no effect of its own
    hum_phase_rad: float = 0.0  # its phase at time 0, no effect of its own
    crosstalk_n_per_v: float = 0.0  # of the command voltage into the reading
    clock_offset_s: float = 0.0  # the reading is that of this much earlier (later if negative: in replay only)
    clock_skew: Annotated[float, Gt(-1), Le(1)] = 0.0  # the reading of time t is that of t (1 - skew)
    sign_lost: Share = 0.0  # 1: readings without their sign
    repeated_share: Share = 0.0  # readings that repeat the one before
    outlier_share: Share = 0.0  # readings with a spike
    outlier_n: float = 0.0  # size of a spike, no effect of its own
