"""Contact and tool: what the force on the workpiece gains besides thrust and friction. One function per effect.

The terms act on the force after the slide: the slide does not feel them. That is what makes them cheap in a search, and it
is right where the robot, not the slide, takes the load; a disturbance that the slide does feel is Twin.set_disturbance.
Backlash and creep have a memory and stand in contact.py.
"""

import math
from typing import Final

from gateway.twin.effects.term import Term
from gateway.twin.elementwise import Real, larger, root, sign, sine
from gateway.twin.sections import Contact
from gateway.twin.surroundings import TwinConditions

HARDENING_AT_N: Final = 10.0
_RADIAN_PER_DEGREE: Final = math.pi / 180.0


def add_hardening(contact: Contact, force_n: Real, conditions: TwinConditions) -> Real:
    """Add contact-nonlinearity, a pad that stiffens: return F + h F sqrt(|F| / 10 N), N."""
    return force_n + contact.hardening * force_n * root(abs(force_n) / HARDENING_AT_N)


def close_backlash(contact: Contact, force_n: Real, conditions: TwinConditions) -> Real:
    """Return the force behind a backlash, N: a gap that the thrust closes first, so that none passes below `lost_n`."""
    return larger(force_n - contact.lost_n, 0.0)


def apply_wear(contact: Contact, force_n: Real, conditions: TwinConditions) -> Real:
    """Apply pad-wear: return the force, N, which falls with the distance ground, m."""
    distance_m = conditions.distance_m
    return force_n * (1.0 - contact.wear_per_m * distance_m) + contact.wear_n_per_m * distance_m


def add_tilt(contact: Contact, force_n: Real, conditions: TwinConditions) -> Real:
    """Add tilt-gravity: return the force, N, with the weight that the measured tilt brings onto the workpiece."""
    from_zero_rad = (conditions.tilt_deg - contact.tilt_zero_deg) * _RADIAN_PER_DEGREE
    return force_n + contact.tilt_n * sine(from_zero_rad + 0.5 * math.pi)


def add_feed_drag(contact: Contact, force_n: Real, conditions: TwinConditions) -> Real:
    """Add feed-drag: return the force, N, with what the feed under the tool, mm/s, brings."""
    feed = conditions.feed_mm_s
    along = contact.feed_drag_n_s_per_mm * feed + contact.feed_drag_n * sign(feed)
    return force_n + along + contact.feed_drag_abs_n_s_per_mm * abs(feed)


def add_position_dependence(contact: Contact, force_n: Real, conditions: TwinConditions) -> Real:
    """Add position-dependence: return the force, N, with a slope and a curvature along the path, mm from where both are 0."""
    aside_mm = conditions.aside_mm
    return force_n + (contact.position_n_per_mm + contact.position_n_per_mm2 * aside_mm) * aside_mm


def add_ripple(contact: Contact, force_n: Real, conditions: TwinConditions) -> Real:
    """Add position-ripple: return the force, N, with what a screw or a tooth belt repeats along the path."""
    turn_rad = (2.0 * math.pi) * conditions.position_mm / contact.ripple_pitch_mm
    return force_n + contact.ripple_n * sine(turn_rad + contact.ripple_phase_rad)


def apply_stop(contact: Contact, force_n: Real, conditions: TwinConditions) -> Real:
    """Apply end-stop where the position is measured: return the force, N, with an elastic stop beyond stop_mm."""
    return force_n + contact.stop_stiffness_n_per_mm * larger(conditions.position_mm - contact.stop_mm, 0.0)


def spindle_amplitude_n(contact: Contact, spindle_rpm: Real) -> Real:
    """Return the amplitude of the spindle's vibration at a speed, N."""
    thousands = spindle_rpm * 1.0e-3
    return contact.spindle_n + contact.spindle_n_per_krpm2 * (thousands * thousands)


def add_vibration(contact: Contact, force_n: Real, conditions: TwinConditions) -> Real:
    """Add spindle-vibration: return the force, N, with one of n times a turn whose unbalance grows with the speed squared."""
    angle_rad = contact.spindle_order * conditions.spindle_rad + contact.spindle_phase_rad
    return force_n + spindle_amplitude_n(contact, conditions.spindle_rpm) * sine(angle_rad)


SPINDLE: Final = Term(("spindle_n", "spindle_n_per_krpm2"), "spindle_rpm", add_vibration)
"""Apart from the others: it is faster than a recording's rows, so replay must not interpolate it."""

SLOW: Final = (
    Term(("lost_n",), None, close_backlash),
    Term(("hardening",), None, add_hardening),
    Term(("wear_per_m", "wear_n_per_m"), "distance_m", apply_wear),
    Term(("tilt_n",), "tilt_deg", add_tilt),
    Term(("feed_drag_n_s_per_mm", "feed_drag_n", "feed_drag_abs_n_s_per_mm"), "feed_mm_s", add_feed_drag),
    Term(("position_n_per_mm", "position_n_per_mm2"), "aside_mm", add_position_dependence),
    Term(("ripple_n",), "position_mm", add_ripple),
    Term(("stop_stiffness_n_per_mm",), "position_mm", apply_stop),
)
"""In the order in which they act."""
