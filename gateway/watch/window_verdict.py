"""From a diagnosis of a window to a finding: which change of the plant matters most to the force, by its name.

The diagnosis takes a refit of gain, lag and Coulomb friction for granted; here they are differences from the rig's plant
like any other. What counts is the force: each change is undone by itself in the replay, and the root mean square of
what that does to the force is its weight, and no more than what it saves. A change of less than a quarter of the tolerance
band disturbs nobody, and neither does one in a window whose force is where the reference says.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Final

import numpy as np

from gateway.diagnosis import Diagnosis, Measurement
from gateway.diagnosis.result import Gain
from gateway.registers.residual_cause import ResidualCause
from gateway.robust import noise_from_second_differences
from gateway.twin.plant import Plant, with_value
from gateway.watch.reference import WatchReference, residuals, rms_of
from gateway.watch.warning_filter import WindowVerdict
from gateway.watch.window import Window

Diagnose = Callable[[Sequence[Measurement], Plant], Diagnosis]

BASE: Final = {
    "coulomb-friction": ("friction", "coulomb_n", "N"),
    "extra-lag": ("regulator", "lag_s", "s"),
    "gain": ("cylinder", "area_m2", "m2"),
}
"""What the diagnosis fits anyway, by the name that a change of it has; a gain has none in the catalogue."""
EXCESS_WITHOUT_A_NAME: Final = 2.0
"""How many times as much must be off where no cause explains it: a busy machine delays samples by some milliseconds."""
_OF_TWO_CLOCKS: Final = ("clock-offset", "clock-skew")


@dataclass(frozen=True, slots=True)
class PlantChange:
    """A named difference from the reference: what it was, what it is, and what it does to the force."""

    name: str
    parameters: tuple[tuple[str, str, str], ...]  # section, field, unit
    others: tuple[str, ...] = ()
    force_n: float = 0.0


def judge_window(window: Window, diagnosis: Diagnosis, reference: WatchReference, least_n: float) -> WindowVerdict:
    """Return the strongest difference of this window from the reference; least_n: what a difference must do to the force, N."""
    excess_n = excess_of(window, reference)
    changes = [change for change in weigh_changes(window, diagnosis, reference.plant) if change.force_n >= least_n]
    if changes and excess_n >= least_n:
        best = max(changes, key=lambda change: change.force_n)
        sentence = _sentence(best, diagnosis.plant, reference.plant)
        return WindowVerdict(ResidualCause.of_effect(best.name), sentence, window.excitation_v, best.others)
    if excess_n >= EXCESS_WITHOUT_A_NAME * least_n:
        sentence = f"{_DIFFERS} {excess_n:.2f} N (rms): {describe_leftover(diagnosis)}"
        return WindowVerdict(ResidualCause.UNKNOWN, sentence, window.excitation_v)
    return WindowVerdict(excitation_v=window.excitation_v)


def excess_of(window: Window, reference: WatchReference) -> float:
    """Return what of the residual is neither usual nor the readings' own noise, N: that is seen in their second differences."""
    rms_n, usual_n = reference.rms_n(window), reference.floor_n(window) or 0.0
    force_n = window.measurement.force_n[window.measurement.usable]
    noise_n = noise_from_second_differences(force_n)
    return sqrt(max(rms_n**2 - max(noise_n, usual_n) ** 2, 0.0))


def describe_leftover(diagnosis: Diagnosis) -> str:
    """Return what no effect, or no change of one, explains, in the words of the screen."""
    if diagnosis.suspects:
        return diagnosis.suspects[0].sentence
    if not diagnosis.leftover:
        return "nothing of the catalogue explains it"
    largest = max(diagnosis.leftover, key=lambda each: each.share)
    return f"{largest.shape}, depending on {largest.depends_on}"


def weigh_changes(window: Window, diagnosis: Diagnosis, plant: Plant) -> list[PlantChange]:
    """Return every change that the diagnosis found, with its weight: no more than it saves in rows that its fit did not see."""
    changes = [PlantChange(name, (parameter,)) for name, parameter in BASE.items()]
    for cause in diagnosis.causes:
        parameters = tuple((each.section, name, each.unit) for name, each in cause.parameters.items())
        changes.append(PlantChange(plausible_name(cause.name, cause.group), parameters, cause.group))
    undone = [_undo_change(diagnosis.plant, plant, change) for change in changes]
    forces = residuals(window.measurement, [diagnosis.plant, *undone])
    refit_n = sqrt(max(rms_of(window.measurement, plant) ** 2 - rms_of(window.measurement, diagnosis.plant) ** 2, 0.0))
    most_n = [refit_n] * len(BASE) + [min(_gain_n(cause.gain), refit_n) for cause in diagnosis.causes]
    weights = np.minimum(np.std(forces[1:] - forces[0], axis=1), most_n)
    return [
        PlantChange(change.name, change.parameters, change.others, float(weight))
        for change, weight in zip(changes, weights, strict=True)
    ]


def _gain_n(gain: Gain) -> float:
    return sqrt(max(gain.held_out_rms_before_n**2 - gain.held_out_rms_after_n**2, 0.0))


def plausible_name(name: str, group: Sequence[str]) -> str:
    """Return the name to publish: one clock stamps readings and commands here, so that a late reading is a late machine."""
    others = [other for other in group if other not in _OF_TWO_CLOCKS]
    return others[0] if name in _OF_TWO_CLOCKS and others else name


def _undo_change(plant_with: Plant, reference: Plant, change: PlantChange) -> Plant:
    for section, name, _ in change.parameters:
        plant_with = with_value(plant_with, section, name, getattr(getattr(reference, section), name))
    return plant_with


_DIFFERS: Final = "the force differs from the rig's plant by"


def _sentence(change: PlantChange, plant_now: Plant, plant: Plant) -> str:
    """`the force differs from the rig's plant by 0.85 N (rms): coulomb-friction, coulomb_n 1 -> 2.4 N`."""
    values = ", ".join(
        f"{name} {getattr(getattr(plant, section), name):.4g} -> {getattr(getattr(plant_now, section), name):.4g} {unit}"
        for section, name, unit in change.parameters
    )
    others = [name for name in change.others if name != change.name]
    group = f"; this run cannot tell it from {', '.join(others)}" if others else ""
    return f"{_DIFFERS} {change.force_n:.2f} N (rms): {change.name}, {values}{group}"
