"""The named physical parameters of the twin. profiles/plants/*.yaml fills them, field by field, with source and range.

Every effect has a null value, which is the default: off equals absent. Fields without a null value are the dimensions
of the machine (full scales, area, pad stiffness); their defaults are those of the ITV2050 and the 100 mm2 slide.
A bound that is never met is UNLIMITED rather than infinity, which JSON (and so the schema for editors) cannot say.

For many parameter sets at once, `stack` makes one Plant whose fields are arrays of lanes.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Annotated, Any, Final

import numpy as np
from annotated_types import Ge, Gt, Le

from gateway.twin.elementwise import Real

UNLIMITED: Final = 1.0e12
STRICT: Final = {"extra": "forbid"}  # read by pydantic in gateway.profiles

NotNegative = Annotated[float, Ge(0)]
Positive = Annotated[float, Gt(0)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Regulator:
    """Electro-pneumatic regulator: command voltage in, gauge pressure out."""

    __pydantic_config__ = STRICT
    full_scale_v: Positive = 10.0  # command at full scale
    full_scale_pa: Positive = 0.9e6  # gauge pressure at full scale
    command_step_v: NotNegative = 0.0  # one step of the command input; 10/1023 V for SMC's 10 bits
    dead_band_pa: NotNegative = 0.0  # a change of the target smaller than this is not noticed
    hysteresis_pa: NotNegative = 0.0  # full width of the loop target -> pressure (play)
    supply_pa: NotNegative = UNLIMITED  # the air line: no pressure above it
    delay_s: Annotated[float, Ge(0), Le(2)] = 0.0  # wire, converter and valve before anything moves
    slew_pa_per_s: Positive = UNLIMITED  # fastest change of pressure
    lag_s: NotNegative = 0.0  # first-order lag
    second_lag_s: NotNegative = 0.0  # another one behind it


@dataclass(frozen=True, slots=True, kw_only=True)
class Cylinder:
    """The slide that turns pressure into thrust. It rests on its back stop at 0 m."""

    __pydantic_config__ = STRICT
    area_m2: Positive = 1.0e-4  # effective, of all pistons
    stroke_m: Positive = UNLIMITED  # travel from the back stop to the end stop


@dataclass(frozen=True, slots=True, kw_only=True)
class Friction:
    """Friction of seals and guide: limit = coulomb + load_dependent x |thrust| + stribeck / (1 + (v / v_s)^2)."""

    __pydantic_config__ = STRICT
    coulomb_n: NotNegative = 0.0  # at any load and speed
    load_dependent_n_per_n: Annotated[float, Ge(0), Le(1)] = 0.0  # per newton of pressure thrust
    stribeck_n: NotNegative = 0.0  # what standing adds to sliding
    stribeck_speed_m_per_s: Positive = 0.01  # scale of the above, no effect of its own
    viscous_n_s_per_m: NotNegative = 0.0  # per speed
    presliding_m: NotNegative = 0.0  # travel until the last Maxwell-slip element slides; 0: rigid Coulomb


@dataclass(frozen=True, slots=True, kw_only=True)
class Contact:
    """End effector and pad against the workpiece. The pad pushes, it never pulls."""

    __pydantic_config__ = STRICT
    pad_stiffness_n_per_m: Positive = 4.1e4  # pad and workpiece together
    pad_damping_n_s_per_m: NotNegative = 0.0  # of the same
    gap_m: NotNegative = 0.0  # travel from the back stop to the workpiece
    mass_kg: NotNegative = 0.0  # what moves: end effector and slide
    tilt_deg: float = 0.0  # 0: the tool points down and its weight presses; 90: level, no weight; 180: up


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadCell:
    """Load cell and amplifier, under the workpiece: it reads the contact force."""

    __pydantic_config__ = STRICT
    filter_s: NotNegative = 0.0  # first-order lag of the amplifier
    noise_n: NotNegative = 0.0  # standard deviation of one reading
    quantum_n: NotNegative = 0.0  # one count of the converter
    range_n: Positive = UNLIMITED  # readings stop at +- this
    zero_n: float = 0.0  # reading without force


@dataclass(frozen=True, slots=True, kw_only=True)
class Plant:
    """One rig's physics. `Plant()` is an ideal machine: force = area x pressure, at once."""

    __pydantic_config__ = STRICT
    regulator: Regulator = field(default_factory=Regulator)
    cylinder: Cylinder = field(default_factory=Cylinder)
    friction: Friction = field(default_factory=Friction)
    contact: Contact = field(default_factory=Contact)
    cell: LoadCell = field(default_factory=LoadCell)


def values(plant: Plant) -> Iterator[tuple[str, str, Real]]:
    """Every (section, field, value) of a plant, in the order of the file."""
    for section in fields(plant):
        part = getattr(plant, section.name)
        for entry in fields(part):
            yield section.name, entry.name, getattr(part, entry.name)


def with_value(plant: Plant, section: str, name: str, value: Real) -> Plant:
    """The same plant with one field changed; AttributeError or TypeError for a name that it does not have."""
    changed: dict[str, Any] = {section: replace(getattr(plant, section), **{name: value})}
    return replace(plant, **changed)


def stack(plants: Sequence[Plant]) -> Plant:
    """One plant whose fields are arrays with one value per lane; ValueError when there is none."""
    if not plants:
        raise ValueError("a stack needs at least one plant")
    stacked = plants[0]
    for section, name, _ in values(plants[0]):
        column = np.array([getattr(getattr(plant, section), name) for plant in plants], dtype=np.float64)
        stacked = with_value(stacked, section, name, column)
    return stacked


def plain(plant: Plant) -> Plant:
    """The same plant with Python floats where it has integers or numpy scalars: those would be slow, or taken for lanes."""
    for section, name, value in values(plant):
        if not isinstance(value, np.ndarray) and type(value) is not float:
            plant = with_value(plant, section, name, float(value))
    return plant


def lane_count(plant: Plant) -> int | None:
    """How many lanes a stacked plant has; None for a plant of plain floats. ValueError when lanes differ in number."""
    counts = {value.size for _, _, value in values(plant) if isinstance(value, np.ndarray)}
    if len(counts) > 1:
        raise ValueError(f"fields of one plant have different numbers of lanes: {sorted(counts)}")
    return counts.pop() if counts else None
