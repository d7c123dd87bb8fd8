"""The moving slide: thrust, weight, friction, inertia, stops, and the pad on the workpiece.

One implicit step solves  m (D/dt - v)/dt + c D/dt + pad(D) + friction(D) = thrust + weight  for the travel D; pad and
friction are piecewise linear, so the solution is closed (see friction.py). The pad cannot pull: its force is the
larger of 0 and k (x - gap + D) + d D/dt, a convex function, so D is the smaller of the solutions with and without the
pad. The damping d sees the slide's speed only: a surface that passes under the pad at 15 mm/s with a slope of 1 % would
add 6 mN. Implicit Euler damps: at 1 ms the 40 Hz of 0.6 kg on 4e4 N/m get a damping ratio of 0.13 on top of the pad's own.
A null mass gives the quasi-static solution, for steps of any length.
"""

import math
from typing import Final, NamedTuple

from gateway.compiled import step
from gateway.twin.friction import (
    BREAKAWAY_M,
    age_stiction,
    directional_drags,
    has_place,
    strain_elements,
    stribeck_limit_n,
    travel_against_friction,
    two_sided_limit,
    yield_travels_m,
)
from gateway.twin.plant import Plant
from gateway.units import STANDARD_GRAVITY_M_PER_S2

_LEAST_N: Final = 1.0e-12  # of a limit that is divided by
_UPRIGHT: Final = 1.0e-15  # cos(90 deg) is 6e-17 in floats


class Slide(NamedTuple):
    """The constants of a plant's slide, as its step needs them.

    most_n: thrust and weight at full scale. inverse_per_m: 1 / yield travel of the friction elements.
    """

    area_m2: float
    stroke_m: float
    gap_m: float
    stops_in_reach: bool
    most_n: float
    pad_n_per_m: float
    pad_n_s_per_m: float
    mass_kg: float
    weight_n: float
    coulomb_n: float
    load_dependent_n_per_n: float
    is_two_sided: bool
    asymmetry_n: float
    stribeck_n: float
    stribeck_m_per_s: float
    drag_n_s_per_m: float
    more_out_n_s_per_m: float
    stiction_n: float
    stiction_s: float
    breakaway_m: float
    inverse_per_m: tuple[float, float, float]


class SlideState(NamedTuple):
    """What the slide remembers, and the forces of its last step, N. travel_m: of that step; strains: the stiffest first."""

    position_m: float = 0.0
    travel_m: float = 0.0
    stiction_n: float = 0.0
    strains: tuple[float, float, float] = (0.0, 0.0, 0.0)
    force_n: float = 0.0
    friction_n: float = 0.0


def weight_n(mass_kg: float, tilt_deg: float) -> float:
    """Return the part of the weight that presses towards the workpiece, m g cos(tilt)."""
    upright = math.cos(math.radians(tilt_deg))
    return mass_kg * STANDARD_GRAVITY_M_PER_S2 * (0.0 if abs(upright) < _UPRIGHT else upright)


def slide_of(plant: Plant) -> Slide:
    """Return the constants of a plant's slide."""
    contact, friction, cylinder = plant.contact, plant.friction, plant.cylinder
    out, back = directional_drags(friction)
    one, two, three = yield_travels_m(friction.presliding_m)
    slide = Slide(
        area_m2=cylinder.area_m2,
        stroke_m=cylinder.stroke_m,
        gap_m=contact.gap_m,
        stops_in_reach=True,
        most_n=cylinder.area_m2 * plant.regulator.full_scale_pa + contact.mass_kg * STANDARD_GRAVITY_M_PER_S2,
        pad_n_per_m=contact.pad_stiffness_n_per_m,
        pad_n_s_per_m=contact.pad_damping_n_s_per_m,
        mass_kg=contact.mass_kg,
        weight_n=weight_n(contact.mass_kg, contact.tilt_deg),
        coulomb_n=friction.coulomb_n,
        load_dependent_n_per_n=friction.load_dependent_n_per_n,
        is_two_sided=friction.asymmetry_n != 0.0 or has_place(friction),
        asymmetry_n=friction.asymmetry_n,
        stribeck_n=friction.stribeck_n,
        stribeck_m_per_s=friction.stribeck_speed_m_per_s,
        drag_n_s_per_m=0.5 * (out + back),
        more_out_n_s_per_m=0.5 * (out - back),
        stiction_n=friction.dwell_stiction_n,
        stiction_s=friction.dwell_stiction_s,
        breakaway_m=max(friction.presliding_m, BREAKAWAY_M),
        inverse_per_m=(1.0 / one, 1.0 / two, 1.0 / three),
    )
    return with_gap(slide, contact.gap_m)


def with_gap(slide: Slide, gap_m: float) -> Slide:
    """Return a slide whose workpiece stands elsewhere.

    The step looks for the stops only where they can be reached while the pad is pressed. The end stop: twice the full
    thrust covers inertial overshoot. The back stop: only a workpiece that stands behind it (gap < 0) pushes so far.
    """
    reaches_end = slide.pad_n_per_m * (slide.stroke_m - gap_m) < 2.0 * slide.most_n
    return slide._replace(gap_m=gap_m, stops_in_reach=reaches_end or gap_m < 0.0)


def without_motion(slide: Slide) -> Slide:
    """Return a slide that one step brings to rest: without inertia and drag, which are nothing at rest."""
    return slide._replace(
        mass_kg=0.0, pad_n_s_per_m=0.0, stribeck_n=0.0, drag_n_s_per_m=0.0, more_out_n_s_per_m=0.0, stiction_n=0.0
    )


def without_mass(slide: Slide) -> Slide:
    """Return a quasi-static slide, which keeps its weight."""
    return slide._replace(mass_kg=0.0, pad_n_s_per_m=0.0)


@step
def advance_slide(
    slide: Slide, state: SlideState, loads_n: tuple[float, float, float, float], step_s: float, last_step_s: float
) -> SlideState:
    """Return the state after one step.

    loads_n: thrust of the pressure, what surroundings add to the friction's limit, what of it moving out has more and moving
    in less, force from outside towards the workpiece.
    last_step_s: length of the step in which the slide made its last travel.
    """
    thrust_n, side_n, more_out_n, outside_n = loads_n
    limit_n = slide.coulomb_n + side_n + slide.load_dependent_n_per_n * thrust_n + state.stiction_n
    if slide.stribeck_n != 0.0:
        limit_n += stribeck_limit_n(slide.stribeck_n, state.travel_m / (slide.stribeck_m_per_s * last_step_s))
    centre_n, drive_n = 0.0, thrust_n + slide.weight_n + outside_n
    if slide.is_two_sided:
        limit_n, centre_n = two_sided_limit(limit_n, slide.asymmetry_n + more_out_n)
        drive_n -= centre_n
    inertia = slide.mass_kg / step_s
    drive_n += inertia * state.travel_m / last_step_s
    own = inertia / step_s + slide.drag_n_s_per_m / step_s
    more_out = slide.more_out_n_s_per_m / step_s
    share_n = limit_n * (1.0 / 3.0)

    pad_n_per_m = slide.pad_n_per_m + slide.pad_n_s_per_m / step_s
    pad_n = slide.pad_n_per_m * (state.position_m - slide.gap_m)
    pressed = (own + pad_n_per_m, more_out)
    travel_m = travel_against_friction(drive_n - pad_n, pressed, share_n, state.strains, slide.inverse_per_m)
    force_n = pad_n + pad_n_per_m * travel_m
    if slide.stops_in_reach or force_n < 0.0:
        free_m = travel_against_friction(drive_n, (own, more_out), share_n, state.strains, slide.inverse_per_m)
        travel_m = min(max(min(travel_m, free_m), -state.position_m), slide.stroke_m - state.position_m)
        force_n = max(pad_n + pad_n_per_m * travel_m, 0.0)
    strains, stiction_n = strain_elements(state.strains, travel_m, slide.inverse_per_m), state.stiction_n
    friction_n = centre_n + share_n * (strains[0] + strains[1] + strains[2])
    if slide.stiction_n != 0.0:
        rest, travel = step_s / slide.stiction_s, travel_m / slide.breakaway_m
        grown_n, stiction_n = age_stiction(stiction_n, slide.stiction_n, rest, travel)
        strains = relieve_strains(strains, limit_n, grown_n)
    return SlideState(state.position_m + travel_m, travel_m, stiction_n, strains, force_n, friction_n)


@step
def relieve_strains(strains: tuple[float, float, float], limit_n: float, grown_n: float) -> tuple[float, float, float]:
    """Return the strains under a limit that has grown: what a rising limit holds it does not push, so the strains give."""
    held = max(limit_n, _LEAST_N) / max(limit_n + grown_n, _LEAST_N)
    return strains[0] * held, strains[1] * held, strains[2] * held
