"""A point of the search: a plant, and an offset for each recording. Parameters are read and moved by name."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from gateway.diagnosis.effect import Form, Parameter, Start
from gateway.twin.plant import Plant, with_value

_ZERO: Final = "cell.zero_n"


@dataclass(frozen=True, slots=True)
class Point:
    """Everything that a simulation needs; hashable, so that simulations can be remembered."""

    plant: Plant
    offsets_n: tuple[float, ...]

    def value(self, parameter: Parameter) -> float:
        """Of the zero: the first recording's offset, which stands for it."""
        if parameter.path == _ZERO:
            return self.offsets_n[0]
        return float(getattr(getattr(self.plant, parameter.section), parameter.name))

    def moved(self, parameter: Parameter, value: float) -> "Point":
        """The same point with one parameter at `value`, kept within its bounds."""
        kept = min(max(float(value), parameter.low), parameter.high)
        if parameter.path == _ZERO:  # of all recordings by as much
            return self.with_offsets([offset_n + kept - self.offsets_n[0] for offset_n in self.offsets_n])
        return replace(self, plant=with_value(self.plant, parameter.section, parameter.name, kept))

    def with_offsets(self, offsets_n: Sequence[float]) -> "Point":
        return replace(self, offsets_n=tuple(float(offset) for offset in offsets_n))


def started(point: Point, form: Form, start: Start) -> Point:
    """Where a form's start leads: sizes are added to the present values, shapes are taken as they stand."""
    for parameter, number in zip(form.parameters, start, strict=True):
        point = point.moved(parameter, number if parameter.shape else point.value(parameter) + number)
    return point


def back_at(point: Point, before: Point, parameters: Sequence[Parameter]) -> Point:
    """The same point with these parameters where they were before."""
    for parameter in parameters:
        point = point.moved(parameter, before.value(parameter))
    return point
