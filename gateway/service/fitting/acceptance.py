"""May a fit be offered for use? Judged by its error on all that was measured: against the rig's band, and what is in use.

Two bounds. The band: beyond an RMS error of in_band_tolerance_n a settled force is out of band about as often as in it, before
the trim has done anything. The calibration in use, on the same data: a fit that is worse by more than a tenth, and by more than
a twentieth of the band (below that nobody feels it), would be a step back. Where no gateway's state is asked, the rig's own
calibration takes its place. A fit that fails is kept with the reason, for data and figures are of use, but it is not offered.
"""

from dataclasses import dataclass
from typing import Any, Final

from gateway.bsfm import Calibration
from gateway.bsfm.fit.evaluation import Evaluation
from gateway.bsfm.fit.model_error import Error, measured_error_n

WORSE_BY: Final = 1.1
WORSE_SHARE: Final = 0.05  # of the band: a smaller difference is none


@dataclass(frozen=True, slots=True)
class Acceptance:
    """Whether a fit is offered, and what it was compared with."""

    error: Error  # on all measured points
    allowed_n: float | None  # of its RMS; None: the rig is not known
    other: Error | None  # the same data by another calibration; None: the rig is not known
    in_use: int | None  # number of the other one; None: nobody has said that it is in use
    named: str  # which the other one is, in words
    rejected: str  # why the fit is not offered; empty where it is
    has_walk: bool  # partial reversals are among the points

    def facts(self) -> dict[str, Any]:
        """Return the decision as entries of the JSON document."""
        return {
            "rms_n": self.error.rms_n,
            "max_n": self.error.max_n,
            "points": self.error.points,
            "reversals": self.has_walk,
            "allowed_rms_n": self.allowed_n,
            "in_use": self.in_use,
            "in_use_rms_n": self.other.rms_n if self.other and self.in_use is not None else None,
            "compared_with": self.named,
            "compared_rms_n": self.other.rms_n if self.other else None,
            "rejected": self.rejected,
        }


def judge_fit(
    evaluation: Evaluation, tolerance_n: float | None, reference: Calibration | None, *, is_in_use: bool = True
) -> Acceptance:
    """Decide whether a fit is offered, offered with notes, or kept but not offered. tolerance_n: the rig's
    in_band_tolerance_n, None where nobody knows the rig; reference: what is active on it, or not is_in_use, its own one."""
    error = Error.of(measured_error_n(evaluation.model, evaluation.checked))
    has_walk = len(evaluation.checked.minor_v) > 1
    if reference is None:
        other, in_use, named = None, None, ""
    else:
        other = Error.of(measured_error_n(reference.model(), evaluation.checked))
        in_use = reference.number if is_in_use else None
        named = f"calibration {reference.number} {'in use' if is_in_use else 'of the rig file'}"
    bounds: tuple[str, ...] = ()
    if tolerance_n is not None:
        bounds = (*_beyond_band(error, tolerance_n), *(_worse(error, other, named, tolerance_n) if other else ()))
    return Acceptance(error, tolerance_n, other, in_use, named, _sentence(error, bounds), has_walk)


def _sentence(error: Error, bounds: tuple[str, ...]) -> str:
    """Return why a fit that misses these bounds is rejected; empty where it misses none."""
    if not bounds:
        return ""
    return (
        f"{error.rms_n:.3f} N RMS on all {error.points} measured points, {' and '.join(bounds)}; finer stairs, more groups or "
        "a reversal part describe the rig better"
    )


def _beyond_band(error: Error, tolerance_n: float) -> tuple[str, ...]:
    return () if error.rms_n <= tolerance_n else (f"allowed {tolerance_n:.3f} N (in_band_tolerance_n of the rig)",)


def _worse(error: Error, other: Error, named: str, tolerance_n: float) -> tuple[str, ...]:
    bound_n = max(WORSE_BY * other.rms_n, other.rms_n + WORSE_SHARE * tolerance_n)
    comparison = f"{other.rms_n:.3f} N by {named} on the same data"
    return () if error.rms_n <= bound_n else (comparison,)
