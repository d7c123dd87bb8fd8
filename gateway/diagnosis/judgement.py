"""From what the search found to the answer: gains on unseen blocks, intervals, the verdict.

The search whitens, for a test needs to know what noise can do. The reported model is the one of the two fits, whitened or
plain, that predicts the held-out blocks better: where a cause is missing from the catalogue, a whitened fit would
sacrifice the slow part of the force to details. Standard errors are the larger of the whitened fit's own and the
jackknife's over blocks, which believes in no noise model.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.random import default_rng
from numpy.typing import NDArray

from gateway.diagnosis.bench import Bench
from gateway.diagnosis.catalogue import BY_NAME, EFFECTS
from gateway.diagnosis.catalogue_cylinder import AREA
from gateway.diagnosis.direct import Direct
from gateway.diagnosis.effect import Effect, Parameter
from gateway.diagnosis.floor import replicate_floor_n
from gateway.diagnosis.gram import HeldOut, covariance, held_out
from gateway.diagnosis.identifiability import invisible
from gateway.diagnosis.noise import Whitener, white
from gateway.diagnosis.point import STARTS
from gateway.diagnosis.refine import Fitted, Problem, refine
from gateway.diagnosis.remarks import remarks, too_high_a_floor
from gateway.diagnosis.result import (
    Baseline,
    Cause,
    Diagnosis,
    Estimate,
    Extended,
    Gain,
    Leftover,
    Rejected,
    Trace,
    Verdict,
)
from gateway.diagnosis.search import Accepted, Found, without
from gateway.twin.plant import Plant, with_value

_REACHED: Final = 1.05  # residual over floor that counts as reached
_ABOVE: Final = 1.1  # residual over a known floor that asks for a cause
_BETTER: Final = 0.995  # plain over whitened held-out RMS from which the plain fit is reported
_LEAST_DIRECT: Final = 0.01  # of the squared error that rows must carry to be a cause
_DEVIATIONS: Final = 2.1  # of a 95 % interval, for some twenty blocks
_SAME_AREA: Final = 0.2
_LEAST_SAVED: Final = 0.02  # of the held-out squared error
_LEFT_AS_LARGE: Final = 0.995  # of the base model's error: what is left of it is all of it
_LEAST_SURE: Final = 0.5  # share of resampled recordings that an effect and its like must win
_PARTS: Final = 100
_LEAST_REJECTED: Final = 5.0e-3  # of the RMS
_SEED: Final = 43


@dataclass(frozen=True, slots=True)
class Reported:
    """The models that are reported: base, extended, and the extended one without each accepted effect."""

    base: Fitted
    fitted: Fitted
    without: tuple[Fitted, ...]
    whiten: Whitener
    held_out: HeldOut


@dataclass(frozen=True, slots=True)
class Dropped:
    """What the search had accepted and the judgement did not; gain_n: of the held-out RMS; why: as a sentence."""

    name: str
    gain_n: float
    why: str

    @property
    def note(self) -> str:
        return f"{self.name} is no finding: {self.why}"


def judged(
    bench: Bench,
    found: Found,
    direct: Sequence[Direct],
    left: Sequence[Leftover],
    effects: Sequence[Effect],
    given_floor_n: float | None,
) -> Diagnosis:
    """The answer, without the account of time. given_floor_n: noise floor that the user knows, N."""
    found, reported, dropped = _worthy(bench, found)
    rms_n = bench.rms_n(reported.base.residual_n)
    too_high = given_floor_n is not None and given_floor_n > rms_n
    known_n = _replicates(bench) if given_floor_n is None or too_high else given_floor_n
    floor_n = min(found.whiten.floor_n if known_n is None else known_n, rms_n, reported.held_out.rms_n)
    reaches = reported.held_out.rms_n <= _REACHED * floor_n
    causes = _causes(bench, found, reported, floor_n) + _direct_causes(bench, reported, direct, floor_n)
    causes.sort(key=lambda cause: -cause.gain.share_of_excess)
    names = frozenset(cause.name for cause in causes)
    fixed = frozenset(effect.name for effect in EFFECTS) - {effect.name for effect in effects}
    unseen = invisible(bench, effects, found.first.scores, names | fixed)
    unexplained = known_n is not None and rms_n > _ABOVE * known_n
    return Diagnosis(
        verdict=_verdict(causes, left, reached=known_n is not None and reaches, unexplained=unexplained),
        baseline=Baseline(rms_n, floor_n, int(bench.judged.sum()), sum(each.duration_s for each in bench.measurements)),
        causes=tuple(causes),
        leftover=tuple(left),
        not_identifiable=unseen,
        rejected=_rejected(bench, found, rms_n, {*names, *_grouped(causes), *(each.name for each in unseen)}, dropped),
        extended=Extended(reported.held_out.rms_n, reaches),
        base=_plant(reported.base),
        plant=_extended(reported, causes),
        base_parameters=_estimates(
            bench, reported.base, [each for each in reported.base.free if each.section != STARTS], reported.whiten
        ),
        traces=_traces(bench, reported),
        experiments=_experiments(causes),
        notes=(
            *remarks(bench.measurements, reported.fitted.point.offsets_n, floor_n),
            *(each.note for each in dropped),
            *((too_high_a_floor(given_floor_n, rms_n),) if too_high and given_floor_n is not None else ()),
        ),
    )


def _worthy(bench: Bench, found: Found) -> tuple[Found, Reported, tuple[Dropped, ...]]:
    """What is reported once everything counts again, without effects that are no finding then, the worst of them first."""
    reported, dropped = _reported(bench, found), list[Dropped]()
    while found.accepted:
        gains = [
            _gain(held_out(bench, without_it, reported.whiten), reported.held_out, 0.0)
            for without_it in reported.without
        ]
        doubts = [_doubt(each, gain) for each, gain in zip(found.accepted, gains, strict=True)]
        rms_n = bench.rms_n(reported.base.residual_n)
        if not any(doubts) and reported.held_out.rms_n > _LEFT_AS_LARGE * rms_n:
            doubts = [f"with it the error is as large on unseen blocks as without: {rms_n:.3g} N"] * len(gains)
        if not any(doubts):
            break
        worst = min((k for k, doubt in enumerate(doubts) if doubt), key=lambda k: gains[k].ci95[0])
        taken, kept = found.accepted[worst], found.accepted[:worst] + found.accepted[worst + 1 :]
        won_n = gains[worst].held_out_rms_before_n - gains[worst].held_out_rms_after_n
        dropped.append(Dropped(taken.effect.name, won_n, doubts[worst]))
        fitted = without(bench, found.fitted, found.base, taken, kept, found.whiten) if kept else found.base
        found = replace(found, fitted=fitted, accepted=kept)
        reported = _reported(bench, found)
    return found, reported, tuple(dropped)


def _doubt(accepted: Accepted, gain: Gain) -> str:
    """Why this is no finding, as a sentence; empty where it is one."""
    name, contest = accepted.effect.name, accepted.contest
    before_n, after_n = gain.held_out_rms_before_n, gain.held_out_rms_after_n
    if gain.ci95[0] <= 0.0:
        return f"what it gains on unseen blocks may be nothing: {gain.ci95[0]:.2g} .. {gain.ci95[1]:.2g} N"
    if after_n**2 > (1.0 - _LEAST_SAVED) * before_n**2:
        return f"it leaves the error as large: {before_n:.3g} N before, {after_n:.3g} N after"
    wins = sum(contest.shares.get(each, 0.0) for each in {name, *BY_NAME[name].group})
    return f"it wins in {100.0 * wins:.0f} % of the ways to resample the recording only" if wins < _LEAST_SURE else ""


def _reported(bench: Bench, found: Found) -> Reported:
    """Every model twice, whitened and plain; the kind whose extended model predicts better.

    Dependences without a name count again: the reported errors are those of the simulation, and of nothing beside it.
    """
    bench.put_back()
    plain = white(bench, found.fitted.residual_n)
    models = [found.base, found.fitted, *(_without(each, found) for each in found.accepted)]
    problems = [Problem(each.point, each.free) for each in models]
    kinds = [(found.whiten, refine(bench, problems, found.whiten, waves=3)), (plain, _plainly(bench, problems, plain))]
    errors = [held_out(bench, fits[1], whiten) for whiten, fits in kinds]
    best = 1 if errors[1].rms_n < _BETTER * errors[0].rms_n else 0
    whiten, fits = kinds[best]
    return Reported(fits[0], fits[1], tuple(fits[2:]), whiten, errors[best])


def _plainly(bench: Bench, problems: Sequence[Problem], plain: Whitener) -> list[Fitted]:
    """Each model at its plain optimum. The whitened one may be far from it in the area, which slow changes tell best:
    then it is looked for from the base model's plain area, too."""
    fits = refine(bench, problems, plain, waves=3)
    area_m2 = fits[0].point.value(AREA)
    if all(abs(each.point.value(AREA) / area_m2 - 1.0) < _SAME_AREA for each in fits):
        return fits
    again = [Problem(each.point.moved(AREA, area_m2), each.free) for each in fits]
    others = refine(bench, again, plain, waves=12)
    return [min(pair, key=lambda each: each.chi2) for pair in zip(fits, others, strict=True)]


def _without(accepted: Accepted, found: Found) -> Fitted:
    return found.base if len(found.accepted) == 1 else accepted.contest.beside


def _verdict(causes: Sequence[Cause], left: Sequence[Leftover], *, reached: bool, unexplained: bool) -> Verdict:
    if not causes:
        return Verdict.UNKNOWN if left or unexplained else Verdict.NOTHING_FOUND
    return Verdict.CONFIRMED if reached and not left else Verdict.PARTIAL


def _replicates(bench: Bench) -> float | None:
    floors = [floor for each in bench.measurements if (floor := replicate_floor_n(each)) is not None]
    return max(floors) if len(floors) == len(bench.measurements) else None


def _causes(bench: Bench, found: Found, reported: Reported, floor_n: float) -> list[Cause]:
    return [
        Cause(
            accepted.effect.name,
            accepted.contest.group(accepted.effect.name),
            accepted.contest.shares.get(accepted.effect.name, 0.0),
            _estimates(bench, reported.fitted, accepted.form.parameters, reported.whiten),
            _gain(held_out(bench, without, reported.whiten), reported.held_out, floor_n),
        )
        for accepted, without in zip(found.accepted, reported.without, strict=True)
    ]


def _gain(before: HeldOut, after: HeldOut, floor_n: float) -> Gain:
    errors_before, errors_after, counts = (
        np.add.reduceat(values, _edges(before)) for values in (before.squares, after.squares, before.squares > 0.0)
    )
    blocks = counts.size
    weights = default_rng(_SEED).multinomial(blocks, np.full(blocks, 1.0 / blocks), size=400)
    rms_before = np.sqrt((weights @ errors_before) / (weights @ counts))
    rms_after = np.sqrt((weights @ errors_after) / (weights @ counts))
    low, high = np.quantile(rms_before - rms_after, (0.025, 0.975))
    return Gain(before.rms_n, after.rms_n, (float(low), float(high)), _share(before.rms_n, after.rms_n, floor_n))


def _edges(held: HeldOut) -> NDArray[np.intp]:
    """Where parts begin that are drawn anew for an interval: finer than the blocks that are left out, for an effect may show
    in one of these only, and then a fifth of all ways to draw blocks would not have it."""
    counted = np.cumsum(held.squares > 0.0)
    parts = min(_PARTS, int(counted[-1]) // 2)
    return np.asarray(np.searchsorted(counted, np.arange(parts) * counted[-1] // parts, side="right"))


def _share(before_n: float, after_n: float, floor_n: float) -> float:
    excess = before_n**2 - min(floor_n, after_n) ** 2
    return float(min(max((before_n**2 - after_n**2) / excess, 0.0), 1.0)) if excess > 0.0 else 0.0


def _direct_causes(bench: Bench, reported: Reported, direct: Sequence[Direct], floor_n: float) -> list[Cause]:
    """Findings of the readings themselves, as far as they matter beside the extended model."""
    residual = bench.raw_n - bench.simulate([reported.fitted.point])[0]
    after_n = float(np.sqrt(np.mean(residual[bench.judged] ** 2)))
    causes = []
    for each in direct:
        before_n = float(np.sqrt(np.mean(residual[bench.judged | each.rows] ** 2)))
        if each.name == "sensor-quantisation":
            before_n, now_n = after_n, float(np.sqrt(max(after_n**2 - each.values[0][1] ** 2 / 12.0, 0.0)))
        else:
            now_n = after_n
        least = 0.0 if each.name == "repeated-samples" else _LEAST_DIRECT  # few copies are no chance either
        if before_n**2 - now_n**2 > least * before_n**2:
            gain = Gain(before_n, now_n, (before_n - now_n, before_n - now_n), _share(before_n, now_n, floor_n))
            causes.append(Cause(each.name, (each.name,), 0.99, _direct_estimates(each), gain))
    return causes


def _direct_estimates(direct: Direct) -> dict[str, Estimate]:
    return {
        parameter.name: Estimate(parameter.section, value, parameter.unit, _interval(value, error))
        for parameter, value, error in direct.values
    }


def _interval(value: float, error: float) -> tuple[float, float]:
    return value - _DEVIATIONS * error, value + _DEVIATIONS * error


def _estimates(bench: Bench, fitted: Fitted, parameters: Sequence[Parameter], whiten: Whitener) -> dict[str, Estimate]:
    own = np.sqrt(np.maximum(np.diag(covariance(fitted, whiten)), 0.0))
    errors = np.maximum(own, held_out(bench, fitted, whiten).jackknife)[len(fitted.point.offsets_n) :]
    settled = [(each, 0.0) for each in parameters if each.settled]
    estimates = {}
    for parameter, error in (*zip(fitted.free, errors, strict=True), *settled):
        if parameter in parameters:
            value = fitted.point.value(parameter)
            low, high = _interval(value, float(error))
            within = (max(low, parameter.low), min(high, parameter.high))
            estimates[parameter.name] = Estimate(parameter.section, value, parameter.unit, within)
    return estimates


def _plant(fitted: Fitted) -> Plant:
    return with_value(fitted.point.plant, "cell", "zero_n", float(np.mean(fitted.point.offsets_n)))


def _extended(reported: Reported, causes: Sequence[Cause]) -> Plant:
    """The extended plant, with what the readings told by themselves."""
    plant = _plant(reported.fitted)
    for cause in causes:
        if BY_NAME[cause.name].direct:
            for name, estimate in cause.parameters.items():
                plant = with_value(plant, estimate.section, name, estimate.value)
    return plant


def _grouped(causes: Sequence[Cause]) -> set[str]:
    return {name for cause in causes for name in cause.group}


def _rejected(
    bench: Bench, found: Found, rms_n: float, told: set[str], dropped: Sequence[Dropped]
) -> tuple[Rejected, ...]:
    """Losers of the first contest and of the last, by the part of the RMS that they would save of unseen blocks, N."""
    gains = {each.name: each.gain_n for each in dropped}
    for contest in (found.first, found.last):
        before_n = held_out(bench, contest.beside, found.whiten).rms_n
        for finalist in contest.finalists:
            if finalist.effect.name not in {*told, *(each.name for each in dropped)}:
                share = 1.0 - held_out(bench, finalist.fitted, found.whiten).rms_n / before_n
                gains[finalist.effect.name] = rms_n * share
    best = sorted(gains.items(), key=lambda item: -item[1])
    known = {each.name for each in dropped}
    return tuple(Rejected(name, gain_n) for name, gain_n in best if name in known or gain_n > _LEAST_REJECTED * rms_n)


def _traces(bench: Bench, reported: Reported) -> tuple[Trace, ...]:
    before, after = bench.simulate([reported.base.point, reported.fitted.point])
    return tuple(
        Trace(bench.measurements[segment.recording], before[segment.rows], after[segment.rows])
        for segment in bench.segments
        if segment.is_force
    )


def _experiments(causes: Sequence[Cause]) -> tuple[str, ...]:
    """What to record to tell the members of each group apart."""
    names = [name for cause in causes if len(cause.group) > 1 for name in cause.group]
    return tuple(dict.fromkeys(BY_NAME[name].experiment for name in names))
