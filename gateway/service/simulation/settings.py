"""What is set on a simulated rig now: judged as a whole, and what the plant becomes by it. Pure."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any, Final

from gateway.catalogue.all_effects import BY_NAME, EFFECTS
from gateway.catalogue.effect import Effect
from gateway.profiles import Rig
from gateway.profiles.strict_yaml.text import Document
from gateway.profiles.strict_yaml.typed import adapter, build
from gateway.service.simulation.setting_names import Value, find_parameter, list_cleared_names, parse_assignment
from gateway.service.socket_requests import SimulationRequest
from gateway.twin import Plant, Surroundings
from gateway.twin.plant import with_value
from gateway.twin.surroundings import COLUMNS

adapter(Plant)  # with this module, not with the first request: it takes milliseconds
_SURROUNDING: Final = "around."


@dataclass(frozen=True, slots=True)
class SimulationSettings:
    """Name -> value of what is not as in the rig's own files; in the order in which it was set."""

    values: Mapping[str, Value] = field(default_factory=dict)

    def is_on(self, name: str) -> bool:
        """Decide whether this fault is on."""
        return bool(self.values.get(name, False))

    def number(self, name: str) -> float:
        """Return a number that is 0 where it is not set."""
        return float(self.values.get(name, 0.0))

    def changed(self, request: SimulationRequest) -> "SimulationSettings":
        """Return the settings after a request. ValueError: E132, E133."""
        values = {} if request.clear_all else dict(self.values)
        for name in request.clear:
            for whole in list_cleared_names(name):
                values.pop(whole, None)
        for name, told in request.set.items():
            for whole, value in parse_assignment(name, told).items():
                values.pop(whole, None)
                if value is not None:
                    values[whole] = value
        return SimulationSettings(values)

    def plant_of(self, plant: Plant) -> Plant:
        """Return the plant with the effects that are set, and the cell's noise. ValueError: E133 for what no plant has."""
        effects = {name: parameter for name in self.values if (parameter := find_parameter(name))}
        for name, parameter in effects.items():
            plant = with_value(plant, parameter.section, parameter.name, float(self.values[name]))
        if "cell.noise" in self.values:
            plant = with_value(plant, "cell", "noise_n", self.number("cell.noise"))
        if effects:
            _check_plant(plant)
        return plant

    def surroundings(self) -> Surroundings:
        """Return what is around the tool; what is not set is not known."""
        around = {
            entry.name: float(self.values[_SURROUNDING + entry.name])
            for entry in fields(Surroundings)
            if _SURROUNDING + entry.name in self.values
        }
        return replace(Surroundings(), **around) if around else Surroundings()

    def notes(self) -> tuple[str, ...]:
        """Return what is set and does nothing yet: effects that act by a column which nobody has told."""
        effects = dict.fromkeys(name.partition(".")[0] for name in self.values)
        return tuple(
            f"{name} acts by {column}: set {_SURROUNDING}{column} too"
            for name in effects
            if (effect := BY_NAME.get(name))
            for column in effect.inputs
            if _SURROUNDING + column not in self.values
        )

    def idle_notes(self, plant: Plant) -> tuple[str, ...]:
        """Return what is set around the tool and moves nothing: no effect of this plant acts by it."""
        set_plant = self.plant_of(plant)
        acting = {column: [one for one in EFFECTS if column in one.columns] for column in COLUMNS}
        return tuple(
            f"{_SURROUNDING}{column} moves no force: nothing that acts by it is on ({', '.join(one.name for one in effects)})"
            for column, effects in acting.items()
            if _SURROUNDING + column in self.values and not any(_is_in(set_plant, one) for one in effects)
        )

    def check(self, rig: Rig) -> None:
        """Refuse what this rig does not have. ValueError: E133."""
        if rig.valve is None and (named := [name for name in self.values if name.startswith("valve.")]):
            raise ValueError(f"E133 {named[0]}: rig {rig.name} has no valve")
        if rig.plant:
            self.plant_of(rig.plant)

    def as_answer(self, rig: Rig) -> dict[str, Any]:
        """Return what a caller is told."""
        idle = self.idle_notes(rig.plant) if rig.plant else ()
        return {"rig": rig.name, "set": dict(self.values), "notes": [*self.notes(), *idle]}


def restore_settings(document: Mapping[str, Any]) -> SimulationSettings:
    """Return settings that were kept. ValueError, TypeError where they are none."""
    return SimulationSettings().changed(SimulationRequest(set=dict(document)))


def _is_in(plant: Plant, effect: Effect) -> bool:
    sizes = (one for one in effect.parameters if not one.shape)
    return any(getattr(getattr(plant, one.section), one.name) != one.null for one in sizes)


def _check_plant(plant: Plant) -> None:
    _, faults = build(Plant, Document("plant", asdict(plant), {}))
    if faults:
        raise ValueError(f"E133 {faults[0].path} {faults[0].message}")
