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


def hardened(contact: Contact, force_n: Real, moment: TwinConditions) -> Real:
    """contact-nonlinearity: a pad that stiffens, F + h F sqrt(|F| / 10 N)."""
    return force_n + contact.hardening * force_n * root(abs(force_n) / HARDENING_AT_N)


def closed(contact: Contact, force_n: Real, moment: TwinConditions) -> Real:
    """backlash: a gap that the thrust closes first, so that no force passes below `lost_n`."""
    return larger(force_n - contact.lost_n, 0.0)


def worn(contact: Contact, force_n: Real, moment: TwinConditions) -> Real:
    """pad-wear: the force falls with the distance ground."""
    distance_m = moment.distance_m
    return force_n * (1.0 - contact.wear_per_m * distance_m) + contact.wear_n_per_m * distance_m


def tilted(contact: Contact, force_n: Real, moment: TwinConditions) -> Real:
    """tilt-gravity: weight that the measured tilt brings onto the workpiece."""
    from_zero_rad = (moment.tilt_deg - contact.tilt_zero_deg) * _RADIAN_PER_DEGREE
    return force_n + contact.tilt_n * sine(from_zero_rad + 0.5 * math.pi)


def dragged(contact: Contact, force_n: Real, moment: TwinConditions) -> Real:
    """feed-drag: force that the feed under the tool brings."""
    feed = moment.feed_mm_s
    along = contact.feed_drag_n_s_per_mm * feed + contact.feed_drag_n * sign(feed)
    return force_n + along + contact.feed_drag_abs_n_s_per_mm * abs(feed)


def placed(contact: Contact, force_n: Real, moment: TwinConditions) -> Real:
    """position-dependence: slope and curvature along the path."""
    aside_mm = moment.aside_mm
    return force_n + (contact.position_n_per_mm + contact.position_n_per_mm2 * aside_mm) * aside_mm


def rippled(contact: Contact, force_n: Real, moment: TwinConditions) -> Real:
    """position-ripple: a screw or a tooth belt repeats itself along the path."""
    turn_rad = (2.0 * math.pi) * moment.position_mm / contact.ripple_pitch_mm
    return force_n + contact.ripple_n * sine(turn_rad + contact.ripple_phase_rad)


def stopped(contact: Contact, force_n: Real, moment: TwinConditions) -> Real:
    """end-stop, where the position is measured: an elastic stop beyond stop_mm."""
    return force_n + contact.stop_stiffness_n_per_mm * larger(moment.position_mm - contact.stop_mm, 0.0)


def spindle_amplitude_n(contact: Contact, spindle_rpm: Real) -> Real:
    thousands = spindle_rpm * 1.0e-3
    return contact.spindle_n + contact.spindle_n_per_krpm2 * (thousands * thousands)


def vibrating(contact: Contact, force_n: Real, moment: TwinConditions) -> Real:
    """spindle-vibration: n times a turn, with an unbalance that grows with the speed squared."""
    angle_rad = contact.spindle_order * moment.spindle_rad + contact.spindle_phase_rad
    return force_n + spindle_amplitude_n(contact, moment.spindle_rpm) * sine(angle_rad)


SPINDLE: Final = Term(("spindle_n", "spindle_n_per_krpm2"), "spindle_rpm", vibrating)
"""Apart from the others: it is faster than a recording's rows, so replay must not interpolate it."""

SLOW: Final = (
    Term(("lost_n",), None, closed),
    Term(("hardening",), None, hardened),
    Term(("wear_per_m", "wear_n_per_m"), "distance_m", worn),
    Term(("tilt_n",), "tilt_deg", tilted),
    Term(("feed_drag_n_s_per_mm", "feed_drag_n", "feed_drag_abs_n_s_per_mm"), "feed_mm_s", dragged),
    Term(("position_n_per_mm", "position_n_per_mm2"), "aside_mm", placed),
    Term(("ripple_n",), "position_mm", rippled),
    Term(("stop_stiffness_n_per_mm",), "position_mm", stopped),
)
"""In the order in which they act."""
