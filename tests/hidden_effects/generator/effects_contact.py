"""Eleven causes between the piston and the workpiece. A pneumatic piston gives force whatever the pad does, so a pad shows
itself only where it takes or keeps part of that force: a parallel guide, an end stop, lost motion, a slow share."""

from dataclasses import replace

import numpy as np
from generator.friction import Extra, Friction
from generator.plant import Effect, World
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def soft_above(values: Floats, knee: float) -> Floats:
    """max(values, 0) with a rounded corner."""
    return np.asarray(knee * np.logaddexp(0.0, values / knee))


def creeping(force: Floats, share: float, world: World) -> Floats:
    """A visco-elastic share of the force comes late."""
    return force + share * world.lagged(force, float(world.rng("creep").uniform(4.0, 15.0)))


def hardening(force: Floats, guide_n: float, world: World) -> Floats:
    """The guide's spring takes what the pad's travel asks; a pad that hardens travels as log(1 + force)."""
    bend_n = float(world.rng("contact-nonlinearity").uniform(8.0, 25.0))
    return np.asarray(force - guide_n * np.log1p(np.maximum(force, 0.0) / bend_n))


def stopped(force: Floats, taken_n: float, _world: World) -> Floats:
    """At the end of the stroke the cylinder's cap carries the rest, so many newtons at the most."""
    limit = force.max() - taken_n
    return np.asarray(force - soft_above(force - limit, 0.1))


def side_load(both: tuple[Friction, Extra], share: float, world: World) -> tuple[Friction, Extra]:
    """While the tool is dragged along, the surface's grip presses the piston against its guide."""
    friction, extra = both
    load = share * np.tanh(np.abs(world.fine("feed_mm_s")) / 2.0)
    return friction, replace(extra, load=load if extra.load is None else extra.load + load)


def weighed(force: Floats, weight_n: float, world: World) -> Floats:
    """The tool's weight along the cell's axis; 90 degrees is level."""
    return np.asarray(force + weight_n * np.cos(np.radians(world.columns["tilt_deg"])))


def dragged(force: Floats, drag_n: float, world: World) -> Floats:
    """The surface pulls at the cell: by the direction of feed, or in proportion to it."""
    feed = world.columns["feed_mm_s"]
    dry = world.rng("feed-drag").random() < 0.5
    return np.asarray(force + drag_n * (np.tanh(feed / 1.0) if dry else feed / 10.0))


def vibrating(force: Floats, swing_n: float, world: World) -> Floats:
    """An imbalance: one wave for each turn, growing with the square of the speed."""
    rpm = world.columns["spindle_rpm"]
    turns = np.cumsum(rpm / 60.0 * np.diff(world.time_s, prepend=0.0))
    phase = world.rng("spindle-vibration").random()
    return np.asarray(force + swing_n * (rpm / 3900.0) ** 2 * np.sin(2.0 * np.pi * (turns + phase)))


def worn(force: Floats, loss_n: float, world: World) -> Floats:
    """The pad is ground away with the distance."""
    distance = world.columns["distance_m"]
    return np.asarray(force - loss_n * distance / max(distance[-1], 1e-9))


def place_dependent(force: Floats, bow_n: float, world: World) -> Floats:
    """A surface that is not where the program thinks: a slope and a bow over the place."""
    place = world.columns["position_mm"]
    share = 2.0 * (place - place.min()) / max(float(np.ptp(place)), 1e-9) - 1.0
    slope = world.rng("position-dependence").uniform(0.6, 1.0)
    return np.asarray(force + bow_n * (slope * share + (1.0 - slope) * share**2))


def rippled(force: Floats, swing_n: float, world: World) -> Floats:
    """Marks of an earlier pass, at one pitch."""
    rng = world.rng("position-ripple")
    pitch_mm, phase = rng.uniform(4.0, 15.0), rng.random()
    return np.asarray(force + swing_n * np.sin(2.0 * np.pi * (world.columns["position_mm"] / pitch_mm + phase)))


def lost_motion(force: Floats, gap_n: float, _world: World) -> Floats:
    """A loose joint hangs open while there is no force and closes first: no force until the gap is taken up."""
    return soft_above(force - gap_n, 0.05)


EFFECTS = (
    Effect("creep", "contact", creeping, 0.03, "N/N"),
    Effect("contact-nonlinearity", "contact", hardening, 1.0, "N", most=12.0),
    Effect("end-stop", "contact", stopped, 2.0, "N", most=40.0),
    Effect("side-load", "friction", side_load, 0.02, "N/N", needs=("feed_mm_s",), most=0.5),
    Effect("tilt-gravity", "cell", weighed, 0.5, "N", needs=("tilt_deg",)),
    Effect("feed-drag", "cell", dragged, 0.3, "N", needs=("feed_mm_s",)),
    Effect("spindle-vibration", "cell", vibrating, 0.3, "N", needs=("spindle_rpm",)),
    Effect("pad-wear", "cell", worn, 0.5, "N", needs=("distance_m",)),
    Effect("position-dependence", "cell", place_dependent, 0.3, "N", needs=("position_mm",)),
    Effect("position-ripple", "cell", rippled, 0.3, "N", needs=("position_mm",)),
    Effect("backlash", "contact", lost_motion, 0.5, "N", most=12.0),
)
