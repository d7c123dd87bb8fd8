"""What a diagnosis answers. Field names are those of the JSON contract (format 1); arrays for the report stand apart."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from gateway.diagnosis.input_checks import Suspect
from gateway.diagnosis.measurement import Floats, Measurement
from gateway.twin.plant import Plant

Interval = tuple[float, float]


class Verdict(StrEnum):
    """How the recording and the model stand to each other."""

    NOTHING_FOUND = "nothing-found"
    CONFIRMED = "confirmed"
    PARTIAL = "partial"
    UNKNOWN = "unknown"


class FloorSource(StrEnum):
    """How a noise floor is known."""

    GIVEN = "given"
    REPLICATES = "replicates"
    RESTS = "rests"
    CALIBRATION = "calibration"
    SEARCH = "search"


@dataclass(frozen=True, slots=True)
class Baseline:
    """The refitted base model against the recording. noise_floor_n: standard deviation that no model could explain;
    noise_floor_source: how it is known, from the search's own noise model where nothing proves it."""

    rms_n: float
    noise_floor_n: float
    samples: int
    duration_s: float
    noise_floor_source: FloorSource = FloorSource.SEARCH


@dataclass(frozen=True, slots=True)
class Estimate:
    """A parameter of an effect. section: where it stands in a plant file (`regulator`, `cell`, ...)."""

    section: str
    value: float
    unit: str
    ci95: Interval


@dataclass(frozen=True, slots=True)
class RefittedNumber:
    """A number of the plant before and after the refit. costs_n: error that it alone makes as it stood, N RMS."""

    section: str
    name: str
    unit: str
    before: float
    value: float
    costs_n: float


@dataclass(frozen=True, slots=True)
class Refit:
    """What the refit of the base model has changed in the plant. as_given_rms_n: error of the plant as it stands, N RMS, beside
    an offset of each recording; gain_n: the part of it that the refit takes away, N RMS; is_own: it is the plant of the
    recordings' own rig, of which it should be right."""

    as_given_rms_n: float
    gain_n: float
    numbers: tuple[RefittedNumber, ...]
    is_own: bool = True


@dataclass(frozen=True, slots=True)
class Gain:
    """What the effect is worth on blocks that the fit did not see; ci95 is that of before minus after, N.

    share_of_excess: share of the squared error above the noise floor that the effect explains, 0..1.
    """

    held_out_rms_before_n: float
    held_out_rms_after_n: float
    ci95: Interval
    share_of_excess: float


@dataclass(frozen=True, slots=True)
class Cause:
    """An accepted effect. group: names that this recording cannot tell apart, its own included; confidence 0..1."""

    name: str
    group: tuple[str, ...]
    confidence: float
    parameters: Mapping[str, Estimate]
    gain: Gain


@dataclass(frozen=True, slots=True)
class Leftover:
    """What no effect explains: the column or quantity it depends on, its form in words and numbers, its share of what is left.

    columns: of the recording that it looks at, both for a product; frequency_hz: of a line; period_s: of a slow wander;
    amplitude_n: of a line, else half the way that it goes; file: the recording that has nearly all of it, of several;
    experiment: what would show its nature.
    """

    depends_on: str
    shape: str
    share: float
    columns: tuple[str, ...] = ()
    frequency_hz: float | None = None
    amplitude_n: float | None = None
    period_s: float | None = None
    file: str = ""
    experiment: str = ""


@dataclass(frozen=True, slots=True)
class NotIdentifiable:
    """An effect that this recording cannot show, why, and what to record."""

    name: str
    why: str
    experiment: str


@dataclass(frozen=True, slots=True)
class Rejected:
    """An effect that competed and lost; gain: held-out RMS before minus after, N."""

    name: str
    gain: float


@dataclass(frozen=True, slots=True)
class Extended:
    """The extended model on blocks that it did not see."""

    held_out_rms_n: float
    reaches_noise_floor: bool


@dataclass(frozen=True, slots=True)
class OwnEffect:
    """An effect that the machine had before, with its parameters."""

    name: str
    parameters: Mapping[str, Estimate]


@dataclass(frozen=True, slots=True)
class Machine:
    """What belongs to the machine, by older recordings of it: no finding. recordings: their names.

    common_error_n: RMS of what its model gets wrong in the same way every time; left_n: RMS that is left in the old recordings
    beside it, the noise floor of the new ones.
    """

    recordings: tuple[str, ...]
    effects: tuple[OwnEffect, ...]
    common_error_n: float
    left_n: float


@dataclass(frozen=True, slots=True)
class Trace:
    """Arrays of one recording for the report: simulated readings of the base and the extended model, N, shape (rows,)."""

    measurement: Measurement
    before_n: Floats
    after_n: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosis:
    """The whole answer. base and plant: the refitted base model and the extended one (its intervals in `causes`).

    suspects: columns that are probably not what their names say: before anything else is believed. machine: what belongs to the
    machine, where its older recordings were given: then causes are changes since, and base is the plant as it was. refit:
    what it has changed in the plant that was given, None where one of its effects was switched off.
    """

    verdict: Verdict
    baseline: Baseline
    causes: tuple[Cause, ...]
    leftover: tuple[Leftover, ...]
    not_identifiable: tuple[NotIdentifiable, ...]
    rejected: tuple[Rejected, ...]
    extended: Extended
    base: Plant
    plant: Plant
    base_parameters: Mapping[str, Estimate] = field(default_factory=dict)
    traces: tuple[Trace, ...] = ()
    experiments: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    suspects: tuple[Suspect, ...] = ()
    machine: Machine | None = None
    refit: Refit | None = None
