"""From what the search found to the answer: gains on unseen blocks, intervals, the verdict.

What is a finding is decided in search/significance.py. Standard errors are the larger of the whitened fit's own and the
jackknife's over blocks, which believes in no noise model.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.catalogue.all_effects import BY_NAME, EFFECTS
from gateway.catalogue.effect import Effect, Parameter
from gateway.diagnosis.bench.bench import Bench
from gateway.diagnosis.bench.parameters import STARTS
from gateway.diagnosis.bench.recording_drive import rows_after_unseen_settings
from gateway.diagnosis.confidence import bound_confidences
from gateway.diagnosis.experiments.identifiability import find_invisible_effects
from gateway.diagnosis.measurement import Measurement
from gateway.diagnosis.model_fit.levenberg_marquardt import FittedModel
from gateway.diagnosis.model_fit.normal_equations import covariance, held_out_errors
from gateway.diagnosis.noise.noise_floor import NoiseFloor, find_floor
from gateway.diagnosis.noise.whitening import Whitener
from gateway.diagnosis.notes import recording_notes, too_high_a_floor
from gateway.diagnosis.result import (
    Baseline,
    Cause,
    Diagnosis,
    Estimate,
    Extended,
    FloorSource,
    Gain,
    Leftover,
    NotIdentifiable,
    Rejected,
    Trace,
    Verdict,
)
from gateway.diagnosis.search.direct_evidence import DirectEvidence
from gateway.diagnosis.search.search import SearchResult
from gateway.diagnosis.search.significance import (
    DoubtfulEffect,
    ReportedModels,
    drop_doubtful_effects,
    gain_of,
    share_of_excess,
)
from gateway.twin.plant import Plant, with_value

_SURE: Final = 0.95  # confidence of a name
_REACHED_RATIO: Final = 1.05  # residual over floor that counts as reached
_ABOVE_FLOOR_RATIO: Final = 1.1  # residual over a known floor that asks for a cause
_LEAST_DIRECT: Final = 0.01  # of the squared error that rows must carry to be a cause
_DEVIATIONS: Final = 2.1  # of a 95 % interval, for some twenty blocks
_LEAST_REJECTED: Final = 5.0e-3  # of the RMS


@dataclass(frozen=True, slots=True)
class SearchFindings:
    """What was found before anything is decided. bench: without rows that are no witness; evidence: what the readings tell by
    themselves; left: what the residual still depends on; effects: those that were searched for."""

    bench: Bench
    found: SearchResult
    evidence: Sequence[DirectEvidence]
    left: Sequence[Leftover]
    effects: Sequence[Effect]


@dataclass(frozen=True, slots=True)
class _Noise:
    """known: None where only the search has an idea; floor_n: that, or what the search found, no more than what is left.

    too_high_n: what the user gave, where it is more than the base model leaves; rms_n: of the base model.
    """

    rms_n: float
    known: NoiseFloor | None
    floor_n: float
    too_high_n: float | None

    @property
    def source(self) -> FloorSource:
        return self.known.source if self.known else FloorSource.SEARCH

    def is_reached(self, rms_n: float) -> bool:
        """Is this no more than the floor, as well as it is known?"""
        return rms_n <= (_REACHED_RATIO + (self.known.error_share if self.known else 0.0)) * self.floor_n

    def confirms(self, causes: Sequence[Cause]) -> bool:
        """Is the floor known well enough for these causes? Rests and a calibration do not see the slowest noise, so under
        them a name that does not nearly always win may be a wander that has none."""
        return self.is_sure or (self.known is not None and all(each.confidence >= _SURE for each in causes))

    @property
    def asks_for_a_cause(self) -> bool:
        """Is the base model's error above a floor that is sure? Rests do not see the slowest noise, nor a calibration."""
        return self.known is not None and self.is_sure and self.rms_n > _ABOVE_FLOOR_RATIO * self.known.value_n

    @property
    def is_sure(self) -> bool:
        """Was it given, or proven by cycles that hold all noise?"""
        return self.source in (FloorSource.GIVEN, FloorSource.REPLICATES)


def compose_diagnosis(
    findings: SearchFindings, given_floor_n: float | None, calibration_noise_n: float | None = None
) -> Diagnosis:
    """Return the diagnosis. given_floor_n: noise floor that the user knows, N; calibration_noise_n: see Options."""
    bench, left = findings.bench, findings.left
    found, reported, dropped = drop_doubtful_effects(bench, findings.found)
    noise = _noise_floor(bench, found, reported, (given_floor_n, calibration_noise_n))
    reaches = noise.is_reached(reported.held_out.rms_n)
    named_causes = _causes(bench, found, reported, noise.floor_n)
    causes = bound_confidences(named_causes, 0.0 if reaches else reported.held_out.rms_n**2 - noise.floor_n**2)
    is_doubted = any(
        now.confidence < min(_SURE, each.confidence) for now, each in zip(causes, named_causes, strict=True)
    )
    causes = _strongest_first([*causes, *_direct_causes(bench, reported, findings.evidence, noise.floor_n)])
    unseen = _unseen(findings, found, causes)
    told = {*_names_in_groups(causes), *(each.name for each in causes), *(each.name for each in unseen)}
    duration_s = sum(each.duration_s for each in bench.measurements)
    return Diagnosis(
        verdict=_decide_verdict(
            causes,
            left,
            reached=reaches and noise.confirms(causes) and not is_doubted,
            unexplained=noise.asks_for_a_cause,
        ),
        baseline=Baseline(noise.rms_n, noise.floor_n, int(bench.judged.sum()), duration_s, noise.source),
        causes=tuple(causes),
        leftover=tuple(left),
        not_identifiable=unseen,
        rejected=_rejected_effects(bench, found, noise.rms_n, told, dropped),
        extended=Extended(reported.held_out.rms_n, reaches),
        base=_plant_of(reported.base),
        plant=_extended_plant(reported, causes),
        base_parameters=_base_estimates(bench, reported),
        traces=_traces(bench, reported),
        experiments=_experiments_for_groups(causes),
        notes=tuple(_notes(bench, reported, noise, dropped)),
    )


def _strongest_first(causes: Sequence[Cause]) -> list[Cause]:
    def squared_gain_n2(cause: Cause) -> float:
        return cause.gain.held_out_rms_before_n**2 - cause.gain.held_out_rms_after_n**2

    return sorted(causes, key=squared_gain_n2, reverse=True)


def _noise_floor(
    bench: Bench, found: SearchResult, reported: ReportedModels, known_floors_n: tuple[float | None, float | None]
) -> _Noise:
    """Return the floor, and what is known of it. known_floors_n: from the user and from the calibration, N."""
    given_n, calibration_n = known_floors_n
    rms_n = bench.rms_n(reported.base.residual_n)
    too_high_n = given_n if given_n is not None and given_n > rms_n else None
    if given_n is not None and too_high_n is None:
        known: NoiseFloor | None = NoiseFloor(given_n, FloorSource.GIVEN)
    else:
        known = find_floor(bench, reported.fitted.residual_n, calibration_n)
    floor_n = min(known.value_n if known else found.whiten.floor_n, rms_n, reported.held_out.rms_n)
    return _Noise(rms_n, known, floor_n, too_high_n)


def _unseen(findings: SearchFindings, found: SearchResult, causes: Sequence[Cause]) -> tuple[NotIdentifiable, ...]:
    """Effects that the recording cannot show: not those found, and not those that the base model has anyway."""
    fixed = frozenset(effect.name for effect in EFFECTS) - {effect.name for effect in findings.effects}
    names = frozenset(cause.name for cause in causes)
    return find_invisible_effects(findings.bench, findings.effects, found.first, names | fixed)


def _notes(bench: Bench, reported: ReportedModels, noise: _Noise, dropped: Sequence[DoubtfulEffect]) -> Iterator[str]:
    yield from recording_notes(bench.measurements, reported.fitted.parameters.offsets_n, noise.floor_n)
    yield from (each.note for each in dropped)
    if noise.too_high_n is not None:
        yield too_high_a_floor(noise.too_high_n, noise.rms_n)


def _base_estimates(bench: Bench, reported: ReportedModels) -> dict[str, Estimate]:
    of_plant = [each for each in reported.base.free if each.section != STARTS]
    return estimates_of(bench, reported.base, of_plant, reported.whiten)


def _decide_verdict(causes: Sequence[Cause], left: Sequence[Leftover], *, reached: bool, unexplained: bool) -> Verdict:
    if not causes:
        return Verdict.UNKNOWN if left or unexplained else Verdict.NOTHING_FOUND
    return Verdict.CONFIRMED if reached and not left else Verdict.PARTIAL


def _causes(bench: Bench, found: SearchResult, reported: ReportedModels, floor_n: float) -> list[Cause]:
    return [
        Cause(
            accepted.effect.name,
            accepted.comparison.group(accepted.effect.name),
            accepted.comparison.shares.get(accepted.effect.name, 0.0),
            estimates_of(bench, reported.fitted, accepted.form.parameters, reported.whiten),
            gain_of(held_out_errors(bench, without, reported.whiten), reported.held_out, floor_n),
        )
        for accepted, without in zip(found.accepted, reported.without, strict=True)
    ]


def _direct_causes(
    bench: Bench, reported: ReportedModels, direct: Sequence[DirectEvidence], floor_n: float
) -> list[Cause]:
    """Findings of the readings themselves, as far as they matter beside the extended model."""
    residual = bench.raw_n - bench.simulate([reported.fitted.parameters])[0]
    after_n = float(np.sqrt(np.mean(residual[bench.judged] ** 2)))
    causes = []
    for each in direct:
        before_n = float(np.sqrt(np.mean(residual[bench.judged | each.rows] ** 2)))
        if each.name == "sensor-quantisation":
            before_n, now_n = after_n, float(np.sqrt(max(after_n**2 - each.values[0][1] ** 2 / 12.0, 0.0)))
        else:
            now_n = after_n
        if bench.witnesses is not None:  # what belongs to the machine is in no simulation
            before_n, now_n = each.before_n, each.after_n
        least = 0.0 if each.name == "repeated-samples" else _LEAST_DIRECT  # few copies are no chance either
        if before_n**2 - now_n**2 > least * before_n**2:
            gain = Gain(
                before_n, now_n, (before_n - now_n, before_n - now_n), share_of_excess(before_n, now_n, floor_n)
            )
            causes.append(Cause(each.name, (each.name,), 0.99, _direct_estimates(each), gain))
    return causes


def _direct_estimates(direct: DirectEvidence) -> dict[str, Estimate]:
    intervals = [_interval(value, error) for _, value, error in direct.values]
    return {
        parameter.name: Estimate(parameter.section, value, parameter.unit, (max(low, parameter.low), high))
        for (parameter, value, _), (low, high) in zip(direct.values, intervals, strict=True)
    }


def _interval(value: float, error: float) -> tuple[float, float]:
    return value - _DEVIATIONS * error, value + _DEVIATIONS * error


def estimates_of(
    bench: Bench, fitted: FittedModel, parameters: Sequence[Parameter], whiten: Whitener
) -> dict[str, Estimate]:
    """Return the parameters of a fit by name, each with its interval of 95 %, within the bounds of the catalogue."""
    own = np.sqrt(np.maximum(np.diag(covariance(fitted, whiten)), 0.0))
    errors = np.maximum(own, held_out_errors(bench, fitted, whiten).jackknife)[len(fitted.parameters.offsets_n) :]
    settled = [(each, 0.0) for each in parameters if each.settled]
    estimates: dict[str, Estimate] = {}
    for parameter, error in (*zip(fitted.free, errors, strict=True), *settled):
        if parameter in parameters:
            value = fitted.parameters.value(parameter)
            low, high = _interval(value, float(error))
            within = (max(low, parameter.low), min(high, parameter.high))
            estimates[parameter.name] = Estimate(parameter.section, value, parameter.unit, within)
    return estimates


def _plant_of(fitted: FittedModel) -> Plant:
    return with_value(fitted.parameters.plant_of(0), "cell", "zero_n", float(np.mean(fitted.parameters.offsets_n)))


def _extended_plant(reported: ReportedModels, causes: Sequence[Cause]) -> Plant:
    """The extended plant, with what the readings told by themselves."""
    plant = _plant_of(reported.fitted)
    for cause in causes:
        if cause.name in BY_NAME and BY_NAME[cause.name].direct:
            for name, estimate in cause.parameters.items():
                plant = with_value(plant, estimate.section, name, estimate.value)
    return plant


def _names_in_groups(causes: Sequence[Cause]) -> set[str]:
    return {name for cause in causes for name in cause.group}


def _rejected_effects(
    bench: Bench, found: SearchResult, rms_n: float, named: set[str], dropped: Sequence[DoubtfulEffect]
) -> tuple[Rejected, ...]:
    """Effects that lost the first comparison and the last, by the part of the RMS that they would save of unseen blocks, N."""
    gains = {each.name: each.gain_n for each in dropped}
    for comparison in (found.first, found.last):
        before_n = held_out_errors(bench, comparison.beside, found.whiten).rms_n
        for refined in comparison.ranked:
            if refined.effect.name not in {*named, *(each.name for each in dropped)}:
                share = 1.0 - held_out_errors(bench, refined.fitted, found.whiten).rms_n / before_n
                gains[refined.effect.name] = rms_n * share
    best = sorted(gains.items(), key=lambda item: -item[1])
    known = {each.name for each in dropped}
    return tuple(Rejected(name, gain_n) for name, gain_n in best if name in known or gain_n > _LEAST_REJECTED * rms_n)


def _traces(bench: Bench, reported: ReportedModels) -> tuple[Trace, ...]:
    before, after = bench.simulate([reported.base.parameters, reported.fitted.parameters])
    judged = [_judged_part(each) for each in bench.measurements]
    return tuple(
        Trace(judged[channel.recording], before[channel.rows], after[channel.rows])
        for channel in bench.channels
        if channel.is_force
    )


def _judged_part(measurement: Measurement) -> Measurement:
    """Rows behind an unseen setting were not judged: in the report's figures they were a residual that the answer denied."""
    unseen = rows_after_unseen_settings(measurement)
    return replace(measurement, usable=measurement.usable & ~unseen) if unseen.any() else measurement


def _experiments_for_groups(causes: Sequence[Cause]) -> tuple[str, ...]:
    """What to record to tell the members of each group apart."""
    names = [name for cause in causes if len(cause.group) > 1 for name in cause.group]
    return tuple(dict.fromkeys(BY_NAME[name].experiment for name in names if name in BY_NAME))
