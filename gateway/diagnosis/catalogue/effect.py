"""What an effect is to the diagnosis: names, parameters of the plant, and where a search begins.

An effect is told by one or more forms: ways in which it may show, for nobody says whether a dead band swallows small
commands or leaves the pressure short of its target. A form moves parameters of the plant away from where they are.
`probes` gives the starts: for each parameter of the form a number, which a size adds to the present value and a shape
(a time constant, a pitch, a frequency) takes as it stands. The response to a size is taken as a secant, so starts of
one form differ in size only where the response is not proportional to it.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

Start = tuple[float, ...]

ANY: Final = 1.0e12


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number of the plant. low, high: what a fit may try; step: secant, absolute; shape: no effect of its own.

    settled: it is there as a start has it or not at all, nothing between: not fitted.
    """

    section: str
    name: str
    unit: str
    null: float
    low: float
    high: float
    step: float
    shape: bool = False
    settled: bool = False

    @property
    def path(self) -> str:
        return f"{self.section}.{self.name}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """What a form may know of a recording to place its starts. Empty tuples where there is nothing."""

    duration_s: float
    row_s: float  # median distance of rows
    pressures_pa: tuple[float, ...]  # 50, 70, 85, 95 and 100 % quantiles of the simulated pressure
    forces_n: tuple[float, ...]  # the same of the simulated force
    pressure_rate_pa_per_s: float  # fastest change of the simulated pressure
    coulomb_n: float
    positions_mm: tuple[float, ...] = ()  # 50, 70, 85 and 95 % quantiles
    lines_hz: tuple[float, ...] = ()  # strongest lines of the remainder
    mains_hz: tuple[float, ...] = ()  # 50 and 60 Hz, as far off as the remainder shows
    pitches_mm: tuple[float, ...] = ()  # strongest periods of the remainder along the position
    command_steps_v: tuple[float, ...] = ()  # steps of the command whose saw tooth the remainder shows most
    dead_bands_pa: tuple[float, ...] = ()  # dead bands of the target that the remainder shows most
    columns: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True, kw_only=True)
class Form:
    """One way in which an effect shows.

    proportional: the response is proportional to the sizes together, whatever their signs; quadrature: the first size is
    an amplitude and the last parameter a phase, so a start means two columns, a quarter turn apart; exact: a start is
    right as it stands or not at all, like the teeth of a saw; everywhere: it acts at all times, so what shows in a few
    moments only is something else; least: of the first parameter, as of the effect.
    """

    parameters: tuple[Parameter, ...]
    probes: Callable[[Scene], tuple[Start, ...]]
    needs: tuple[str, ...] = ()
    proportional: bool = False
    quadrature: bool = False
    exact: bool = False
    everywhere: bool = False
    least: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """One entry of the catalogue. group: names it is easily confused with; excitation: what a recording must contain."""

    name: str
    family: str
    what: str
    signature: str
    excitation: str
    experiment: str
    forms: tuple[Form, ...]
    group: tuple[str, ...] = ()
    rarity: float = 0.0  # chi-square by which it must beat a commoner cause that explains as much
    least: float = 0.0  # of the first parameter, below which it is part of every machine
    direct: bool = False  # told by the readings themselves, not by what the model leaves
    marks: tuple[Parameter, ...] = field(default=())  # parameters that only the direct way sets

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Every parameter of every form, once."""
        found = {parameter.path: parameter for form in self.forms for parameter in form.parameters}
        return tuple((found | {parameter.path: parameter for parameter in self.marks}).values())

    @property
    def needs(self) -> tuple[str, ...]:
        """Columns without which no form can show."""
        common = set.intersection(*(set(form.needs) for form in self.forms)) if self.forms else set()
        return tuple(sorted(common))


def fixed(*starts: Start) -> Callable[[Scene], tuple[Start, ...]]:
    """Starts that do not depend on the recording."""
    return lambda scene: starts
