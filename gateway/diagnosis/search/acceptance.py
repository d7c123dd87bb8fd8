"""When the search accepts an effect, and what counts as more than a trifle.

It accepts one that passes all of these:
- Chi-square at 1 % over the number of starts, also under the noise that the effect's own model leaves.
- A gain over blocks of time that the fit did not see: in nearly all ways to resample them, and without the blocks that still
  feel how the recording began.
- That gain is at least 4 % of the held-out squared error, or 2 % where chi-square is overwhelming.
- Every effect after the first explains a few percent of what the others do, or much of the error that is left. No form is
  exact, and what a cause's wrong form leaves must not be named. What oscillates does not count there: the rest of a sine is
  no bent line.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.random import default_rng
from numpy.typing import NDArray

from gateway.catalogue.effect import Effect, EffectForm, SearchHints
from gateway.diagnosis.bench.bench import Bench
from gateway.diagnosis.model_fit.levenberg_marquardt import FittedModel
from gateway.diagnosis.model_fit.normal_equations import block_sums, held_out_errors, model_span, orthonormal
from gateway.diagnosis.noise.whitening import Whitener, coloured_whitener
from gateway.diagnosis.residuals.dependence_tests import Dependence
from gateway.diagnosis.search.model_comparison import (
    ModelComparison,
    RefinedEffect,
    is_significant,
)

_CLEARLY_STRONGER: Final = 1.15  # a nameless dependence must explain this much more than the best effect ...
_CLEARLY_STRONGER_ON_ITS_COLUMN: Final = 1.3  # ... or this much more, where both look at one column ...
CHI2_MARGIN: Final = 10.0  # ... and this much more in chi-square
_SAVING_QUANTILE: Final = 0.15  # of resampled blocks may see no gain: an effect may show in two blocks of twenty only
_EXTREME_BLOCKS: Final = 2  # best and worst blocks without which an effect that acts everywhere ...
_LEAST_SHARE_ELSEWHERE: Final = 0.3  # ... must save this much of what it saves with them
_OVERWHELMING_CHI2: Final = 80.0
_SEED: Final = 21
_RESAMPLES: Final = 400  # draws of blocks: the 15 % quantile is then uncertain by 2 %
_LEAST_GAIN: Final = 0.04  # of the held-out squared error; less is a trifle ...
_LEAST_SURE_GAIN: Final = 0.02  # ... unless chi-square overwhelms
_LEAST_BESIDE: Final = 0.05  # of the chi-square that the effects before it explain ...
_MUCH_SAVED: Final = 0.15  # ... unless it saves this much of the held-out squared error


@dataclass(frozen=True, slots=True)
class AcceptedEffect:
    """An effect of the extended model, and the model comparison that it won."""

    effect: Effect
    form: EffectForm
    comparison: ModelComparison


def explained_chi2(base: FittedModel, fitted: FittedModel, accepted: Sequence[AcceptedEffect]) -> float:
    """Return the chi-square that causes explain whose wrong form could look like another one: oscillations do not count."""
    gains = [(each.comparison.winner.gain, each.form.quadrature) for each in accepted]
    total = sum(gain for gain, _oscillates in gains)
    shapes = sum(gain for gain, oscillates in gains if not oscillates)
    return max(base.chi2 - fitted.chi2, 0.0) * (shapes / total if total > 0.0 else 1.0)


def is_more_than_a_wrong_form(refined: RefinedEffect, saved: float, explained: float) -> bool:
    """Return whether an effect gains more than what the wrong forms of those before it, which explain so much, may leave.

    saved: share of the held-out squared error that it saves.
    """
    return refined.gain > _LEAST_BESIDE * explained or saved > _MUCH_SAVED


def is_clearly_stronger(dependence: Dependence, strongest: RefinedEffect | None, explained: float) -> bool:
    """Return whether a nameless dependence is more than what the effects before it leave, and clearly more than the strongest.

    One on the effect's own column may be no more than the effect's form, which is never exact.
    """
    if strongest is None:
        return dependence.gain > _LEAST_BESIDE * explained
    times = (
        _CLEARLY_STRONGER_ON_ITS_COLUMN
        if dependence.regressors.depends_on in strongest.form.needs
        else _CLEARLY_STRONGER
    )
    return dependence.gain > times * strongest.gain + CHI2_MARGIN


def saves_enough(refined: RefinedEffect, saved: float) -> bool:
    """Return whether what an effect saves of the held-out squared error is no trifle."""
    return saved > (_LEAST_SURE_GAIN if refined.gain > _OVERWHELMING_CHI2 else _LEAST_GAIN)


def stands_in_its_own_noise(
    bench: Bench, before: FittedModel, winner: RefinedEffect, starts: int, whiten: Whitener
) -> bool:
    """Return whether an effect is significant under the noise that its own model leaves, too.

    The search's noise is what a hundred candidates leave together. Of slow noise they leave next to nothing, so that its slow
    end is a guess, measured at a sixth to all of what it is, 0.6 in the middle: half a minute of it passed for warm-up and
    for steps of the command. What only one effect took a share of has all of it; but the causes that are not found yet as
    well. So an effect whose chi-square overwhelms is believed.
    """
    if winner.gain > _OVERWHELMING_CHI2:
        return True
    after = winner.fitted
    own = coloured_whitener(bench, after.residual_n, orthonormal(after.jacobian), whiten.weights)
    left_before, left_after = (float(np.sum(model_span(each, own).left ** 2)) for each in (before, after))
    return is_significant(replace(winner, gain=left_before - left_after), starts)


def saved_share(bench: Bench, before: FittedModel, winner: RefinedEffect, whiten: Whitener, explained: float) -> float:
    """Return the share of the held-out squared error that an effect saves.

    0 unless it saves in nearly all ways to resample the blocks.

    An effect that shows in one block only (a slide that rests once, a force that is negative once) cannot be resampled;
    an overwhelming chi-square stands for it, also beside what the effects before it have `explained`. Not so for a saw
    tooth: it is there all the time, and among so many teeth some meet the few moments that another form got wrong.
    """
    old = _blocks_past_the_start(bench)
    error_before = held_out_errors(bench, before, whiten).errors[old]
    saved = error_before - held_out_errors(bench, winner.fitted, whiten).errors[old]
    weights = default_rng(_SEED).multinomial(saved.size, np.full(saved.size, 1.0 / saved.size), size=_RESAMPLES)
    if winner.form.everywhere:
        sure = float(np.sum(np.sort(saved)[_EXTREME_BLOCKS:-_EXTREME_BLOCKS])) > _LEAST_SHARE_ELSEWHERE * float(
            np.sum(saved)
        )
    else:
        overwhelming = winner.gain > max(_OVERWHELMING_CHI2, 0.5 * explained)
        sure = overwhelming or float(np.quantile(weights @ saved, _SAVING_QUANTILE)) > 0.0
    return max(float(np.sum(saved)), 0.0) / float(np.sum(error_before)) if sure else 0.0


def _blocks_past_the_start(bench: Bench) -> NDArray[np.intp]:
    """Return the blocks that do not feel any more how their recording began: a cause must show without them."""
    counted = block_sums(bench, bench.judged.astype(np.float64))
    unsettled = block_sums(bench, (bench.judged & bench.unsettled).astype(np.float64))
    return np.flatnonzero(unsettled <= 0.5 * counted)


def is_noticeable(
    named: tuple[Effect, EffectForm], after: FittedModel, before: FittedModel, hints: SearchHints
) -> bool:
    """Return whether an effect's size, or the change of a size that the plant had already, is more than every machine has."""
    effect, form = named
    size = form.parameters[0]
    channels_s = 0.0 if "command_v" in hints.columns else effect.least_rows * hints.row_s
    least = max(effect.least, form.least, channels_s)
    return abs(after.parameters.value(size) - before.parameters.value(size)) >= least
