"""What a fit hands over: curves, residuals, what can be said about the parameters, and the verdicts.

Never judge or compare fits by their parameters: from n = 3 on the data do not pin them down though they pin down the
curve. So the covariance is given only where every weight is known to better than a factor of e^0.5 and none lies on the
box.
"""

from dataclasses import dataclass
from enum import StrEnum

from gateway.bsfm.branches import Branches, Crossing
from gateway.bsfm.fit.projected_problem import Floats
from gateway.bsfm.model import Bsfm
from gateway.bsfm.slip.reversal import LinearBlend

NOT_IDENTIFIABLE = "not identifiable"


class ModelName(StrEnum):
    """The paper's four: polynomial or rational Bezier, one curve for both directions or one each."""

    PFM = "pfm"
    PSFM = "psfm"
    BFM = "bfm"
    BSFM = "bsfm"

    @property
    def rational(self) -> bool:
        """True where its curves have weights."""
        return self in (ModelName.BFM, ModelName.BSFM)

    @property
    def per_direction(self) -> bool:
        """True where each direction has a curve of its own."""
        return self in (ModelName.PSFM, ModelName.BSFM)


class Ties(StrEnum):
    """How two branches meet at their ends. tied: the continuous form, both branches share their end handles. free: each has
    its own.
    """

    TIED = "tied"
    FREE = "free"


@dataclass(frozen=True, slots=True)
class ModelForm:
    """Which model of which order."""

    model: ModelName
    order: int
    ties: Ties

    @property
    def curves(self) -> int:
        """Number of curves: 2 with one per direction, else 1."""
        return 2 if self.model.per_direction else 1

    @property
    def tied(self) -> bool:
        """True where two curves share their end handles."""
        return self.model.per_direction and self.ties is Ties.TIED

    @property
    def coefficients(self) -> int:
        """Free numbers: handles, and weights with w_0 = 1."""
        handles = self.curves * (self.order + 1) - (2 if self.tied else 0)
        return handles + (self.curves * self.order if self.model.rational else 0)


@dataclass(frozen=True, slots=True)
class Residuals:
    """Measured minus model in N, of `count` samples; weights do not enter."""

    rms_n: float
    max_n: float
    mean_n: float
    count: int


@dataclass(frozen=True, slots=True, eq=False)
class Covariance:
    """Of the free numbers, in the order of `names`: handles in N, then log weights."""

    names: tuple[str, ...]
    matrix: Floats


@dataclass(frozen=True, slots=True)
class Verdicts:
    """May this fit drive a plant? crossing: None or where; steep: slope floor kept on both branches."""

    rising_monotone: bool
    falling_monotone: bool
    crossing: Crossing | None
    steep: bool
    slope_floor_n_per_v: float

    @property
    def usable(self) -> bool:
        """True where all exact tests have passed."""
        return self.rising_monotone and self.falling_monotone and self.crossing is None and self.steep

    @property
    def sentences(self) -> tuple[str, ...]:
        """Sentences that speak against it, if anything does."""
        sentences = []
        for name, monotone in (("rising", self.rising_monotone), ("falling", self.falling_monotone)):
            if not monotone:
                sentences.append(f"the {name} branch is not increasing")
        if self.crossing is not None:
            sentences.append(str(self.crossing))
        if not self.steep:
            sentences.append(f"the slope falls below {self.slope_floor_n_per_v:g} N/V")
        return tuple(sentences)


@dataclass(frozen=True, slots=True, eq=False)
class FitResult:
    """A fit of one form. Pooled models have the same curve on both branches.

    covariance: Covariance, or NOT_IDENTIFIABLE. rejected: samples left out as
    outliers, not counted elsewhere. paper_norm: the paper's normalised figure (per data set 2-norm of the group means'
    residuals / number of points, data sets added), an extra for comparison with its tables: not newtons of anything.
    """

    form: ModelForm
    branches: Branches
    overall: Residuals
    rising: Residuals
    falling: Residuals
    rejected: int
    covariance: Covariance | str
    verdicts: Verdicts
    paper_norm: float
    log_weights: Floats  # (curves, order): where a fit of other data may start

    @property
    def model(self) -> ModelName:
        """Name of the model."""
        return self.form.model

    @property
    def order(self) -> int:
        """Order of its curves."""
        return self.form.order

    @property
    def rms_n(self) -> float:
        """RMS of all residuals, N."""
        return self.overall.rms_n

    @property
    def max_n(self) -> float:
        """Largest residual, N."""
        return self.overall.max_n

    @property
    def count(self) -> int:
        """Number of samples that were fitted."""
        return self.overall.count

    def bsfm(self, blend_span_n: float) -> Bsfm:
        """Return the model for control. ValueError if a branch is not increasing."""
        return Bsfm(self.branches, LinearBlend(blend_span_n))


def verdicts_of(branches: Branches, slope_floor_n_per_v: float) -> Verdicts:
    """Return what the exact tests say of two branches."""
    rising, falling = branches.rising, branches.falling
    steep = all(curve.slope_is_at_least(slope_floor_n_per_v) for curve in (rising, falling))
    return Verdicts(
        rising.is_increasing(), falling.is_increasing(), branches.crossing_fault(), steep, slope_floor_n_per_v
    )
