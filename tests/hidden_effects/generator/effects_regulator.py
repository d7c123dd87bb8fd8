"""Eleven causes between the command and the pressure, as a textbook on pneumatics would write them."""

from itertools import pairwise

import numpy as np
from generator.plant import PA_PER_V, Effect, World
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def delayed(setpoint: Floats, delay_s: float, world: World) -> Floats:
    """The same later, between fine steps, too."""
    return np.interp(world.fine_s - delay_s, world.fine_s, setpoint)


def lagged_again(pressure: Floats, lag_s: float, world: World) -> Floats:
    """A hose and a volume: a second first-order lag."""
    return world.lagged(pressure, lag_s)


def ignored_when_small(volts: Floats, band_v: float, _world: World) -> Floats:
    """The regulator keeps its setpoint until the command is further away than the band; then it follows all the way."""
    kept, accepted = [], 0.0
    for wanted in volts.tolist():
        if abs(wanted - accepted) > band_v:
            accepted = wanted
        kept.append(accepted)
    return np.array(kept)


def played(values: Floats, half_width: float) -> Floats:
    """Play operator, from a state of rest at 0."""
    followed, state = [], 0.0
    for value in values.tolist():
        state = min(max(state, value - half_width), value + half_width)
        followed.append(state)
    return np.array(followed)


def hysteresis(volts: Floats, half_pa: float, _world: World) -> Floats:
    return played(volts, half_pa / PA_PER_V)


def quantised(volts: Floats, step_v: float, _world: World) -> Floats:
    return np.asarray(np.round(volts / step_v) * step_v) if step_v > 0.0 else volts


def bowed(volts: Floats, bow_v: float, world: World) -> Floats:
    """The linearity error of a data sheet: nothing at both ends of 0 .. 10 V, most between; a bow or an S."""
    share = volts / 10.0
    shape = world.rng("command-nonlinearity").choice(["bow", "s"])
    bend = 4.0 * share * (1.0 - share) if shape == "bow" else np.sin(2.0 * np.pi * share)
    return np.asarray(np.maximum(volts + bow_v * bend, 0.0))


def saturated(pressure: Floats, missing_pa: float, world: World) -> Floats:
    """No more than the supply gives: that much less than the highest setpoint, with a knee of 4 kPa."""
    limit, knee = world.command_v.max() * PA_PER_V - missing_pa, 4.0e3
    return np.asarray(
        limit - knee * np.logaddexp(0.0, (limit - pressure) / knee) + knee * np.log1p(np.exp(-limit / knee))
    )


def drooped(pressure: Floats, per_kpa: float, world: World) -> Floats:
    """The supply's swing comes through: in proportion to the pressure, or added wherever the valve is open."""
    swing_kpa = world.fine("supply_kpa") - world.columns["supply_kpa"].mean()
    if world.rng("supply-droop").random() < 0.5:
        return np.asarray(pressure * (1.0 + per_kpa * swing_kpa))
    return np.asarray(pressure + per_kpa * 3.0e5 * swing_kpa * pressure / (pressure + 2.0e4))


def leaking(pressure: Floats, loss_pa: float, _world: World) -> Floats:
    """A hole behind the valve's finite conductance: subsonic flow sqrt(p (p + 1 bar)) below 0.9 bar, choked above."""
    absolute = np.maximum(pressure, 0.0) + 1.0e5
    ratio = np.clip(1.0e5 / absolute, 0.0, 1.0)
    flow = absolute * np.sqrt(np.clip(1.0 - (np.maximum(ratio, 0.528) - 0.528) ** 2 / 0.472**2, 0.0, None))
    return np.asarray(pressure - loss_pa * flow / 4.0e5)


def hunting(pressure: Floats, swing_pa: float, world: World) -> Floats:
    """The pilot never rests: a limit cycle while there is pressure."""
    rng = world.rng("regulator-hunting")
    frequency_hz, phase = rng.uniform(0.8, 6.0), rng.random()
    cycle = np.sin(2.0 * np.pi * (frequency_hz * world.fine_s + phase))
    return np.asarray(pressure + swing_pa * cycle * np.tanh(pressure / 2.0e4))


def slew_limited(pressure: Floats, s_per_mpa: float, world: World) -> Floats:
    """A valve that is too small: so many seconds for each MPa, up and down."""
    most = world.rig.dt_s / (s_per_mpa * 1.0e-6)
    if np.abs(np.diff(pressure)).max() <= most:
        return pressure
    reached, state = [float(pressure[0])], float(pressure[0])
    for _last, wanted in pairwise(pressure.tolist()):
        state += min(max(wanted - state, -most), most)
        reached.append(state)
    return np.array(reached)


EFFECTS = (
    Effect("transport-delay", "setpoint", delayed, 0.01, "s"),
    Effect("extra-lag", "pressure", lagged_again, 0.01, "s"),
    Effect("dead-band", "command", ignored_when_small, 0.03, "V", most=0.6),
    Effect("regulator-hysteresis", "command", hysteresis, 3.0e3, "Pa"),
    Effect("command-quantisation", "command", quantised, 0.05, "V", most=0.6),
    Effect("command-nonlinearity", "command", bowed, 0.1, "V", most=1.5),
    Effect("supply-saturation", "pressure", saturated, 1.0e4, "Pa", most=4.0e5),
    Effect("supply-droop", "pressure", drooped, 1.0e-4, "1/kPa", needs=("supply_kpa",)),
    Effect("leak", "pressure", leaking, 2.0e4, "Pa", most=3.0e5),
    Effect("regulator-hunting", "pressure", hunting, 2.0e3, "Pa"),
    Effect("slew-limit", "pressure", slew_limited, 0.3, "s/MPa", most=20.0),
)
