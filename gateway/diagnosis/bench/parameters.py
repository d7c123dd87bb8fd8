"""The parameters of one model in the search: a plant, and an offset for each recording. They are read and moved by name."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Final

from gateway.catalogue.effect import EffectForm, Parameter, Start
from gateway.twin.plant import Plant, with_value
from gateway.twin.replay.drive import AT_REST, StartState, Strains

_ZERO: Final = "cell.zero_n"
_UNSTRAINED: Final[Strains] = (0.0, 0.0, 0.0)
STARTS: Final = "start"
"""Section of the parameters that belong to a recording (its beginning, its lines) and to no plant."""


@dataclass(frozen=True, slots=True)
class StartParameter(Parameter):
    """A number of the state in which one recording begins. elements: of the strains; empty for `field` of StartState."""

    recording: int = 0
    field: str = ""
    elements: tuple[int, ...] = ()

    def read(self, start: StartState) -> float:
        """Return its value in a state."""
        if not self.elements:
            return float(getattr(start, self.field))
        strains = start.strains or _UNSTRAINED
        return sum(strains[element] for element in self.elements) / len(self.elements)

    def write(self, start: StartState, value: float) -> StartState:
        """Return the state with another value; elements become alike."""
        if not self.elements:
            changed: dict[str, Any] = {self.field: value}
            return start._replace(**changed)
        one, two, three = (
            value if element in self.elements else strain for element, strain in enumerate(start.strains or _UNSTRAINED)
        )
        return start._replace(strains=(one, two, three))


def initial_strain(recording: int, elements: tuple[int, ...]) -> StartParameter:
    """Return the strain of some friction elements, all alike, at the beginning of one recording."""
    name = f"strain_{''.join(str(element) for element in elements)}_of_{recording}"
    return StartParameter(STARTS, name, "1", 0.0, -1.0, 1.0, 0.05, recording=recording, elements=elements)


def initial_pressure(recording: int) -> StartParameter:
    """Return what the pressure is ahead of the first command at the beginning of one recording."""
    return _initial(recording, "ahead_pa", "Pa", (-1.0e6, 1.0e6), 2.0e3)


def initial_second_pressure(recording: int) -> StartParameter:
    """Return what the pressure behind a second lag is ahead of that before it at the beginning of one recording."""
    return _initial(recording, "second_ahead_pa", "Pa", (-1.0e6, 1.0e6), 2.0e3)


def initial_command(recording: int) -> StartParameter:
    """Return what is under way in the regulator's delay at the beginning of one recording, ahead of the first command."""
    return _initial(recording, "coming_pa", "Pa", (-1.0e6, 1.0e6), 2.0e3)


def initial_stiction(recording: int) -> StartParameter:
    """Return the share of stiction that has grown before one recording begins."""
    return _initial(recording, "stiction_share", "1", (0.0, 1.0), 0.1)


def initial_creep(recording: int) -> StartParameter:
    """Return what the pad's creep is ahead of the first force at the beginning of one recording."""
    return _initial(recording, "creep_n", "N", (-100.0, 100.0), 0.5)


def _initial(recording: int, field: str, unit: str, bounds: tuple[float, float], step: float) -> StartParameter:
    name = f"{field}_of_{recording}"
    return StartParameter(STARTS, name, unit, 0.0, *bounds, step, recording=recording, field=field)


CHARACTER: Final = Parameter(STARTS, "character_s", "s", 0.0, 0.0, 4.2e-3, 1.0e-4)
"""Time of a character on the line that carries settings, for all recordings; at most 10 bits at 2400 baud."""


@dataclass(frozen=True, slots=True, init=False)
class ChangedValue(Parameter):
    """A number of the plant as it is in some of the recordings, while the others have the plant's own."""

    recordings: frozenset[int] = frozenset()

    def __init__(self, parameter: Parameter, recordings: frozenset[int]) -> None:
        Parameter.__init__(self, *(getattr(parameter, each.name) for each in fields(Parameter)))
        object.__setattr__(self, "recordings", recordings)

    @property
    def path(self) -> str:
        """`changed.section.name`: it moves beside the plant's own."""
        return f"changed.{self.section}.{self.name}"


@dataclass(frozen=True, slots=True)
class ModelParameters:
    """Everything that a simulation needs; hashable, so that simulations can be remembered.

    starts: what is remembered at the beginning of each recording; none at all: rest without pressure.
    character_s: by which settings of fewer digits are there earlier, for each digit.
    changes: numbers that are others in some recordings than in the plant.
    """

    plant: Plant
    offsets_n: tuple[float, ...]
    starts: tuple[StartState, ...] = ()
    character_s: float = 0.0
    changes: tuple[tuple[ChangedValue, float], ...] = ()

    def plant_of(self, recording: int) -> Plant:
        """Return the plant as it is in one recording, with the recording's offset as its zero."""
        plant = with_value(self.plant, "cell", "zero_n", self.offsets_n[recording])
        for parameter, value in self.changes:
            if recording in parameter.recordings:
                plant = with_value(plant, parameter.section, parameter.name, value)
        return plant

    def start(self, recording: int) -> StartState:
        """Return what is remembered at the beginning of one recording."""
        return self.starts[recording] if self.starts else AT_REST

    def value(self, parameter: Parameter) -> float:
        """Return what a parameter is now; of the zero, the first recording's offset, which stands for it."""
        if isinstance(parameter, StartParameter):
            return parameter.read(self.start(parameter.recording))
        if parameter is CHARACTER:
            return self.character_s
        if parameter.path == _ZERO:
            return self.offsets_n[0]
        if isinstance(parameter, ChangedValue) and parameter in (changes := dict(self.changes)):
            return changes[parameter]
        return float(getattr(getattr(self.plant, parameter.section), parameter.name))

    def with_value(self, parameter: Parameter, value: float) -> "ModelParameters":
        """Return the same model with one parameter at `value`, kept within its bounds."""
        kept = min(max(float(value), parameter.low), parameter.high)
        if isinstance(parameter, StartParameter):
            starts = list(self.starts or (AT_REST,) * len(self.offsets_n))
            starts[parameter.recording] = parameter.write(starts[parameter.recording], kept)
            return replace(self, starts=tuple(starts))
        if parameter is CHARACTER:
            return replace(self, character_s=kept)
        if isinstance(parameter, ChangedValue):
            return replace(self, changes=tuple((dict(self.changes) | {parameter: kept}).items()))
        if parameter.path == _ZERO:  # of all recordings by as much
            return self.with_offsets([offset_n + kept - self.offsets_n[0] for offset_n in self.offsets_n])
        return replace(self, plant=with_value(self.plant, parameter.section, parameter.name, kept))

    def with_offsets(self, offsets_n: Sequence[float]) -> "ModelParameters":
        """Return the same model with these offsets, N, one for each recording."""
        return replace(self, offsets_n=tuple(float(offset) for offset in offsets_n))


def apply_start(parameters: ModelParameters, form: EffectForm, start: Start) -> ModelParameters:
    """Return the model where a form's start leads: sizes are added to the present values, shapes are taken as they stand."""
    for parameter, number in zip(form.parameters, start, strict=True):
        parameters = parameters.with_value(
            parameter, number if parameter.shape else parameters.value(parameter) + number
        )
    return parameters


def reset_parameters(
    parameters: ModelParameters, before: ModelParameters, chosen: Sequence[Parameter]
) -> ModelParameters:
    """Return the same model with these parameters where they were before."""
    known = dict(before.changes)
    gone = {each for each in chosen if isinstance(each, ChangedValue) and each not in known}
    parameters = replace(parameters, changes=tuple(each for each in parameters.changes if each[0] not in gone))
    for parameter in (each for each in chosen if each not in gone):
        parameters = parameters.with_value(parameter, before.value(parameter))
    return parameters
