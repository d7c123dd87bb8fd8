"""What one entry of the catalogue holds: names, parameters of the plant, where a search begins, experiment and cure.

An effect is told by one or more forms: ways in which it may show, for nobody says whether a dead band swallows small
commands or leaves the pressure short of its target. A form moves parameters of the plant away from where they are.
`probes` gives the starts: for each parameter of the form a number, which a size adds to the present value and a shape
(a time constant, a pitch, a frequency) takes as it stands. The response to a size is taken as a secant, so starts of
one form differ in size only where the response is not proportional to it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

Start = tuple[float, ...]

RECORDED: Final = frozenset({"time_s", "command_v", "force_n", "pressure_kpa"})
"""What a gateway records by itself, pressure where its output device measures it."""
PRESSURE: Final = ("pressure_kpa",)


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
        """`section.name` within the plant."""
        return f"{self.section}.{self.name}"


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchHints:
    """What a form may know of a recording to place its starts. Empty tuples where there is nothing."""

    duration_s: float
    row_s: float  # median distance of rows
    pressures_pa: tuple[float, ...]  # 50, 70, 85, 95 and 100 % quantiles of the simulated pressure
    forces_n: tuple[float, ...]  # the same of the simulated force
    pressure_rate_pa_per_s: float  # fastest change of the simulated pressure
    positions_mm: tuple[float, ...] = ()  # 50, 70, 85 and 95 % quantiles
    lines_hz: tuple[float, ...] = ()  # strongest lines of the remainder
    mains_hz: tuple[float, ...] = ()  # 50 and 60 Hz, as far off as the remainder shows
    pitches_mm: tuple[float, ...] = ()  # strongest periods of the remainder along the position
    command_steps_v: tuple[float, ...] = ()  # steps of the command whose saw tooth the remainder shows most
    dead_bands_pa: tuple[float, ...] = ()  # dead bands of the target that the remainder shows most
    columns: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True, kw_only=True)
class EffectForm:
    """One way in which an effect shows."""

    parameters: tuple[Parameter, ...]
    probes: Callable[[SearchHints], tuple[Start, ...]]
    needs: tuple[str, ...] = ()
    proportional: bool = False  # the response is proportional to the sizes together, whatever their signs
    quadrature: bool = False  # amplitude first, phase last: a start is two columns, a quarter turn apart
    exact: bool = False  # a start is right as it stands or not at all, like the teeth of a saw
    everywhere: bool = False  # acts at all times: what shows in a few moments only is something else
    least: float = 0.0  # of the first parameter, as of the effect
    like_a_held_start: bool = False  # shows nothing in a rest at the beginning, as if friction held a force there


class PartName(StrEnum):
    """Parts of which experiments are made; gateway.diagnosis.experiments.blocks says what each does."""

    STAIRCASE = "staircase"
    DWELLS = "dwells"
    REVERSALS = "reversals"
    STEPS = "steps"
    RAMPS = "ramps"
    FINE = "fine stairs"
    RESTS = "rests"
    STROKES = "strokes"
    SLOW_RAMP = "slow ramp"
    TOUCHES = "touches"
    CYCLES = "cycles"
    LASTING = "steps throughout"
    REST = "rest"
    LONG_REST = "long rest"
    LEVEL = "one level"
    THREE_LEVELS = "three levels"


@dataclass(frozen=True, slots=True, kw_only=True)
class Recipe:
    """How a gateway makes an effect show. columns: to record besides command, force and what the effect needs.

    What a person does: `apart` from the run (dead weights on the cell), or `meanwhile` (turn the tool). check: the coarse
    cycle may come first.
    """

    parts: tuple[PartName, ...]
    columns: tuple[str, ...] = ()
    apart: str = ""
    meanwhile: str = ""
    check: bool = True


class By(StrEnum):
    """What of the controller compensates an effect."""

    MODEL = "model"
    COMMAND = "command"
    CELL = "cell"
    OUTSIDE = "outside"
    TIMING = "timing"
    NOTHING = "nothing"


@dataclass(frozen=True, slots=True, kw_only=True)
class Treatment:
    """What control does about an effect. fields: numbers of the plant that make it, `section.name`; none: its parameters.

    why_not: what stands in the way where nothing compensates it, as the end of a sentence.
    """

    by: By = By.NOTHING
    why_not: str = ""
    fields: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """One entry of the catalogue; names and numbers are contracts."""

    name: str
    number: int  # in the register residual_cause, frozen within a version of the map
    family: str
    what: str  # it is, as part of a sentence
    signature: str  # how it shows, as part of a sentence
    excitation: str  # what a recording must contain
    experiment: str  # what to do next, in words
    recipe: Recipe  # the experiment for the gateway
    treatments: tuple[Treatment, ...]  # what control does about it
    forms: tuple[EffectForm, ...]
    group: tuple[str, ...] = ()  # names it is easily confused with
    rarity: float = 0.0  # chi-square by which it must beat a commoner cause that explains as much
    least: float = 0.0  # of the first parameter, below which it is part of every machine
    least_rows: float = 0.0  # the same in rows of a table that a gauge drives: its channels are read one after another
    direct: bool = False  # told by the readings themselves, not by what the model leaves
    marks: tuple[Parameter, ...] = ()  # parameters that only the direct way sets

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Every parameter of every form, once."""
        by_path = {parameter.path: parameter for form in self.forms for parameter in form.parameters}
        return tuple((by_path | {parameter.path: parameter for parameter in self.marks}).values())

    @property
    def needs(self) -> tuple[str, ...]:
        """Columns without which no form can show."""
        common = set.intersection(*(set(form.needs) for form in self.forms)) if self.forms else set()
        return tuple(sorted(common))

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns that at least one form needs."""
        return tuple(sorted({name for form in self.forms for name in form.needs}))

    @property
    def inputs(self) -> tuple[str, ...]:
        """Columns that it needs and a gateway does not record by itself: somebody has to tell it."""
        return tuple(name for name in self.needs if name not in RECORDED)


def fixed_starts(*starts: Start) -> Callable[[SearchHints], tuple[Start, ...]]:
    """Return a `probes` whose starts do not depend on the recording."""
    return lambda hints: starts
