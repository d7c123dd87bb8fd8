"""The parameters of one model in the search: a plant, and an offset for each recording. They are read and moved by name."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Final

from gateway.catalogue.effect import EffectForm, Parameter, Start
from gateway.twin.plant import Plant, with_value
from gateway.twin.replay.drive import Strains

_ZERO: Final = "cell.zero_n"
_UNSTRAINED: Final[Strains] = (0.0, 0.0, 0.0)
STARTS: Final = "start"
"""Section of the parameters that belong to a recording (its beginning, its lines) and to no plant."""


@dataclass(frozen=True, slots=True, init=False)
class InitialStrain(Parameter):
    """Strain of some friction elements, all alike, at the beginning of one recording."""

    recording: int = 0
    elements: tuple[int, ...] = ()

    def __init__(self, recording: int, elements: tuple[int, ...]) -> None:
        name = f"strain_{''.join(str(element) for element in elements)}_of_{recording}"
        Parameter.__init__(self, STARTS, name, "1", 0.0, -1.0, 1.0, 0.05)
        object.__setattr__(self, "recording", recording)
        object.__setattr__(self, "elements", elements)


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

    starts: what friction remembers at the beginning of each recording; None, or none at all: rest without pressure.
    character_s: by which settings of fewer digits are there earlier, for each digit.
    changes: numbers that are others in some recordings than in the plant.
    """

    plant: Plant
    offsets_n: tuple[float, ...]
    starts: tuple[Strains | None, ...] = ()
    character_s: float = 0.0
    changes: tuple[tuple[ChangedValue, float], ...] = ()

    def plant_of(self, recording: int) -> Plant:
        """Return the plant as it is in one recording, with the recording's offset as its zero."""
        plant = with_value(self.plant, "cell", "zero_n", self.offsets_n[recording])
        for parameter, value in self.changes:
            if recording in parameter.recordings:
                plant = with_value(plant, parameter.section, parameter.name, value)
        return plant

    def start(self, recording: int) -> Strains | None:
        """Return what friction remembers at the beginning of one recording; None: rest without pressure."""
        return self.starts[recording] if self.starts else None

    def value(self, parameter: Parameter) -> float:
        """Return what a parameter is now; of the zero, the first recording's offset, which stands for it."""
        if isinstance(parameter, InitialStrain):
            strains = self.start(parameter.recording) or _UNSTRAINED
            return sum(strains[element] for element in parameter.elements) / len(parameter.elements)
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
        if isinstance(parameter, InitialStrain):
            return self._with_strain(parameter, kept)
        if parameter is CHARACTER:
            return replace(self, character_s=kept)
        if isinstance(parameter, ChangedValue):
            return replace(self, changes=tuple((dict(self.changes) | {parameter: kept}).items()))
        if parameter.path == _ZERO:  # of all recordings by as much
            return self.with_offsets([offset_n + kept - self.offsets_n[0] for offset_n in self.offsets_n])
        return replace(self, plant=with_value(self.plant, parameter.section, parameter.name, kept))

    def _with_strain(self, parameter: InitialStrain, value: float) -> "ModelParameters":
        starts = list(self.starts or (None,) * len(self.offsets_n))
        first, second, third = (
            value if element in parameter.elements else strain
            for element, strain in enumerate(starts[parameter.recording] or _UNSTRAINED)
        )
        starts[parameter.recording] = (first, second, third)
        return replace(self, starts=tuple(starts))

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
