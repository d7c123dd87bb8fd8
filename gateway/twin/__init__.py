"""The simulated world: regulator, slide with friction, pad on a workpiece, load cell. Pure: time and seed are arguments.

`Twin(plant, seed)` takes voltages and lets time pass; `Plant` names the physics, one field per effect, each with a null
value that is the default; `stack` runs many plants in one twin, as numpy lanes. Modules in the order of the signal:
regulator, slide (with friction), load_cell; simulation joins them; experiment does to the twin what one does to a rig.
"""

from gateway.twin.plant import UNLIMITED, Contact, Cylinder, Friction, LoadCell, Plant, Regulator, stack
from gateway.twin.simulation import STEP_S, Twin

__all__ = [
    "STEP_S",
    "UNLIMITED",
    "Contact",
    "Cylinder",
    "Friction",
    "LoadCell",
    "Plant",
    "Regulator",
    "Twin",
    "stack",
]
