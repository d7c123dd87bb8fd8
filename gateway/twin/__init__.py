"""The simulated world: regulator, slide with friction, pad on a workpiece, load cell. Pure: time and seed are arguments.

`Twin(plant, seed)` takes voltages and lets time pass; `Plant` names the physics, one field per effect, each with a null
value that is the default. Modules in the order of the signal: regulator, slide (with friction), contact, load_cell;
simulation joins them. Each formula stands once: a step with a memory as a plain function of floats (regulator, friction,
slide, lags), one without as a formula for floats or series (gateway/twin/effects). experiment does to the twin what one
does to a rig.

`Replay(drive).run(plants)` runs plants over a recording, for the diagnosis: the same functions, compiled. It is loaded when
it is asked for, and with it numba when it runs: the real-time twin knows neither.
"""

from typing import TYPE_CHECKING, Any

from gateway.defaults import UNLIMITED
from gateway.twin.plant import Contact, Cylinder, Friction, LoadCell, Plant, Regulator
from gateway.twin.simulation import STEP_S, Twin
from gateway.twin.surroundings import Surroundings

if TYPE_CHECKING:
    from gateway.twin.replay.replay import Drive, Replay, ReplayResult

__all__ = [
    "STEP_S",
    "UNLIMITED",
    "Contact",
    "Cylinder",
    "Drive",
    "Friction",
    "LoadCell",
    "Plant",
    "Regulator",
    "Replay",
    "ReplayResult",
    "Surroundings",
    "Twin",
]


def __getattr__(name: str) -> Any:
    if name in ("Drive", "Replay", "ReplayResult"):
        from gateway.twin.replay import replay

        return getattr(replay, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
