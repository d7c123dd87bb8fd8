"""How sure a name may be: no surer than what is still open allows.

Blocks that are drawn anew say how often a name wins among those that were asked. They cannot say that none of them is true:
where the machine's own cause has the wrong form or none, some other name wins nearly always what is left of it. Steps of the
command won 98 % beside a stiction that was not told well, while seven times as much stayed unexplained. So the
share of resampled recordings is bounded by what a cause explains, over that and what may well be another's work: the squared
error that stays above the floor, and a share of what stronger causes explain, for no form is exact.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from gateway.diagnosis.result import Cause

_LEFT_BY_A_FORM: Final = 0.03  # of the squared error that a cause explains: what its form may have left to others


def bound_confidences(causes: Sequence[Cause], unexplained_n2: float) -> list[Cause]:
    """Return the causes, none surer of its name than what is open beside it allows.

    unexplained_n2: squared error above the floor that the causes together leave, N^2.
    """
    explained = [_explained_n2(each) for each in causes]
    return [
        replace(cause, confidence=min(cause.confidence, _share(own, unexplained_n2, _sum_of_stronger(explained, own))))
        for cause, own in zip(causes, explained, strict=True)
    ]


def _explained_n2(cause: Cause) -> float:
    return max(cause.gain.held_out_rms_before_n**2 - cause.gain.held_out_rms_after_n**2, 0.0)


def _sum_of_stronger(explained: Sequence[float], own: float) -> float:
    return sum(each for each in explained if each > own)


def _share(own: float, unexplained_n2: float, stronger_n2: float) -> float:
    open_n2 = unexplained_n2 + _LEFT_BY_A_FORM * stronger_n2
    return own / (own + open_n2) if own + open_n2 > 0.0 else 0.0
