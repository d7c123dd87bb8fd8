"""What an extended plant is worth to the controller: the error in commanded force, before and after, on the twin.

The extended plant is the truth. Before: the model of the base plant and nothing else, as a rig runs that nobody has diagnosed.
After: the model identified anew on the extended plant, and everything that control can compensate of it. Both meet the same
seeds: same wishes, same surroundings, same noise. Trim and lead are on in both, so what the load cell sees and the trim takes
back anyway is not counted as a gain.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.random import default_rng

from gateway import defaults
from gateway.bsfm import Bsfm
from gateway.bsfm.fit.projected_problem import Floats
from gateway.control import NO_COMPENSATION, Compensation, ControlSettings
from gateway.profiles import Rig, load_rig
from gateway.profiles.rigs.compensated_effects import ALL_INPUTS, CALIBRATE, compensation_of
from gateway.service.closed_loop.identified_model import identify_model, remove_compensated
from gateway.service.closed_loop.schedule import LARGEST_N, draw_schedule
from gateway.service.closed_loop.simulated_run import ControlSetup, SimulatedRun, simulate_run
from gateway.twin import Plant

SEEDS: Final = 5
TRIAL_SEED_OFFSET: Final = 10_000  # from the first seed to that of the trial run, which is not judged
RESAMPLES: Final = 4000
HEADROOM: Final = 0.94  # of the largest voltage: the ladder's top, so that the trim has room above it
REACH: Final = 0.92  # of the force that the model reaches at its top
DEFAULT_RIG: Final = defaults.RIG


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosedLoopGain:
    """Errors of the true force against the commanded one, N, over all seeds. rms_ratio: after over before, with a 95 %
    interval over seeds; settled_s: mean time until within 1 N for good, a step that never gets there counts as its hold;
    faults: of runs that supervision stopped."""

    before_rms_n: float
    after_rms_n: float
    before_max_n: float
    after_max_n: float
    before_settled_s: float
    after_settled_s: float
    rms_ratio: float
    rms_ratio_ci95: tuple[float, float]
    seeds: tuple[int, ...]
    compensated: tuple[str, ...]
    not_compensated: tuple[tuple[str, str], ...]
    before_faults: tuple[str, ...] = ()
    after_faults: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def closed_loop_gain(
    base: Plant,
    extended: Plant,
    rig: Rig | None = None,
    *,
    seeds: Sequence[int] = range(SEEDS),
    inputs: Iterable[str] = ALL_INPUTS,
) -> ClosedLoopGain:
    """Return what knowing the extended plant gains in closed loop.

    rig: whose limits, trim and lead are used, None for the demo rig's; seeds: of the schedules and the noise, at least one;
    inputs: what the controller is told besides the load cell. ValueError where the base plant gives no model at all.
    """
    settings, known_inputs = (rig or load_rig(DEFAULT_RIG)).control, frozenset(inputs)
    top_v = HEADROOM * settings.limits.voltage_max_v
    before = ControlSetup(settings, identify_model(base, top_v), NO_COMPENSATION)
    after = _compensate(before, base, extended, known_inputs, seeds[0] + TRIAL_SEED_OFFSET)
    notes = () if after.model is before.model else ("the model was identified anew on the extended plant",)
    force_max_n = _reach_n(settings, (before.model, after.model))
    if force_max_n < LARGEST_N:
        notes = (*notes, f"the schedule goes up to {force_max_n:.1f} N: model and limits allow no more")
    runs = [
        [
            simulate_run(driver, extended, draw_schedule(base, extended, one, force_max_n), one, known_inputs)
            for one in seeds
        ]
        for driver in ((before,) if base == extended else (before, after))
    ]
    return _summarize(runs[0], runs[-1], tuple(seeds), after.compensation, notes)


def _compensate(
    before: ControlSetup, base: Plant, extended: Plant, known_inputs: frozenset[str], seed: int
) -> ControlSetup:
    """With everything that can be known. A model that the extended plant does not give, or that does worse on a trial run of
    its own seed, is not used: some friction (rigid, and wide) is beyond what the model's stops can follow."""
    on_new_model, on_old_model = (compensation_of(base, extended, known_inputs, new_model=new) for new in (True, False))
    old = ControlSetup(before.settings, before.model, on_old_model)
    try:
        model = identify_model(
            remove_compensated(extended, on_new_model), HEADROOM * before.settings.limits.voltage_max_v
        )
    except ValueError as error:
        return _without_model(old, f"the extended plant gives no model: {error}")
    new = ControlSetup(before.settings, model, on_new_model)
    if model is before.model:
        return new
    wishes = draw_schedule(base, extended, seed, _reach_n(before.settings, (model, before.model)))
    rms_n = [simulate_run(driver, extended, wishes, seed, known_inputs).rms_n for driver in (old, new)]
    return (
        new if rms_n[1] <= rms_n[0] else _without_model(old, "a model identified on the extended plant does no better")
    )


def _without_model(driver: ControlSetup, why: str) -> ControlSetup:
    limited = tuple((name, why if reason == CALIBRATE else reason) for name, reason in driver.compensation.limited)
    return replace(driver, compensation=replace(driver.compensation, limited=limited))


def _reach_n(settings: ControlSettings, models: Iterable[Bsfm]) -> float:
    return min(settings.limits.force_max_n, *(REACH * model.force_range_n[1] for model in models))


def _summarize(
    before: list[SimulatedRun],
    after: list[SimulatedRun],
    seeds: tuple[int, ...],
    compensation: Compensation,
    notes: tuple[str, ...],
) -> ClosedLoopGain:
    squares = np.array([[one.rms_n**2 for one in runs] for runs in (before, after)])
    rms_n = np.sqrt(squares.mean(axis=1))
    low, high = np.quantile(_ratios(squares), (0.025, 0.975)).tolist()
    return ClosedLoopGain(
        before_rms_n=float(rms_n[0]),
        after_rms_n=float(rms_n[1]),
        before_max_n=_largest_n(before),
        after_max_n=_largest_n(after),
        before_settled_s=_mean_settled_s(before),
        after_settled_s=_mean_settled_s(after),
        rms_ratio=float(rms_n[1] / rms_n[0]),
        rms_ratio_ci95=(low, high),
        seeds=seeds,
        compensated=compensation.acts,
        not_compensated=compensation.limited,
        before_faults=tuple(one.fault for one in before if one.fault),
        after_faults=tuple(one.fault for one in after if one.fault),
        notes=notes,
    )


def _ratios(squares: Floats) -> Floats:
    """RMS after over before for seeds drawn with replacement; both runs of a seed stay together."""
    count = squares.shape[1]
    resamples = default_rng(0).integers(0, count, (RESAMPLES, count))
    sums = squares[:, resamples].sum(axis=2)
    ratios: Floats = np.sqrt(sums[1] / sums[0])
    return ratios


def _largest_n(runs: list[SimulatedRun]) -> float:
    return max(float(np.abs(one.error_n).max()) for one in runs)


def _mean_settled_s(runs: list[SimulatedRun]) -> float:
    return float(np.mean([settled_s for one in runs for settled_s in one.settled_s]))


def answer_sentence(gain: ClosedLoopGain) -> str:
    """Return whether the commanded force gets better, for terminal and page."""
    low, high = gain.rms_ratio_ci95
    said = "gains nothing certain" if low <= 1.0 <= high else "makes it better" if high < 1.0 else "makes it worse"
    return (
        f"Error of the commanded force, on the twin: to compensate what was found {said}: {gain.before_rms_n:.2f} N before, "
        f"{gain.after_rms_n:.2f} N after"
    )


def format_gain(gain: ClosedLoopGain) -> list[str]:
    """Return the lines that tell the gain, the answer first."""
    low, high = gain.rms_ratio_ci95
    lines = [
        answer_sentence(gain),
        f"after / before: {gain.rms_ratio:.2f}, 95 % interval {low:.2f} .. {high:.2f}, {len(gain.seeds)} seeds",
        f"largest error {_change(gain.before_max_n, gain.after_max_n)} N",
        f"a step is within 1 N for good after {_change(gain.before_settled_s, gain.after_settled_s)} s",
        f"compensated: {', '.join(gain.compensated) or 'nothing'}",
        *(f"not compensated: {name}: {why}" for name, why in gain.not_compensated),
    ]
    for when, faults in (("before", gain.before_faults), ("after", gain.after_faults)):
        if faults:
            stopped = f"{len(faults)} of {len(gain.seeds)} runs {when}"
            lines.append(f"stopped by supervision: {stopped} ({', '.join(sorted(set(faults)))})")
    return [*lines, *gain.notes]


def _change(before: float, after: float) -> str:
    return f"{before:.2f} -> {after:.2f}"
