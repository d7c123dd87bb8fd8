"""From an extended plant to what control compensates of it, and why it leaves the rest.

Compared with the base plant, the one that rig and calibration were made for: an effect counts where one of its numbers
differs. What control does about an effect, or why nothing, stands in its entry of the catalogue. Inputs are what control
is told besides the load cell; a part whose input is missing stays off and is listed, not refused.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import radians
from typing import Any, Final

from gateway.catalogue.all_effects import EFFECTS
from gateway.catalogue.effect import By, Effect
from gateway.control.compensation.cell_map import CellMap
from gateway.control.compensation.command_map import CommandMap
from gateway.control.compensation.compensation import Compensation, OutsideForce, TimingCompensation
from gateway.twin import Plant
from gateway.twin.plant import with_value

MASTER_INPUTS: Final = ("tilt_deg",)
"""What a master can tell a running gateway (the command block)."""

ALL_INPUTS: Final = ("tilt_deg", "temperature_c", "feed_mm_s")
"""What a program that runs the controller itself can tell it (gateway.control.LineStatus)."""

CALIBRATE: Final = "it is the calibration's: `force-gateway calibrate` measures it"

_NOT_SIMULATED: Final = "a simulated rig is not told how the tool is held"


@dataclass(frozen=True, slots=True)
class FieldTreatment:
    """What control does about one effect: the numbers of a plant that make it, by whom it is compensated, which input that
    needs; why not, where nothing compensates it."""

    name: str
    fields: tuple[str, ...]
    by: By
    needs: tuple[str, ...]
    why_not: str


def treatments_of(effects: Iterable[Effect]) -> tuple[FieldTreatment, ...]:
    """Return the treatments of these entries of the catalogue in its order, those of what is compensated first."""
    treatments = [
        FieldTreatment(
            effect.name,
            treatment.fields or tuple(parameter.path for parameter in effect.parameters),
            treatment.by,
            effect.inputs if treatment.by is not By.NOTHING else (),
            treatment.why_not,
        )
        for effect in effects
        for treatment in effect.treatments
    ]
    return tuple(sorted(treatments, key=lambda each: each.by is By.NOTHING))


TREATMENTS: Final = treatments_of(EFFECTS)


def number_at(plant: Plant, path: str) -> Any:
    """Return the plant's number at a path such as `friction.coulomb_n`."""
    section, name = path.split(".")
    return getattr(getattr(plant, section), name)


def differing_treatments(base: Plant, extended: Plant) -> tuple[FieldTreatment, ...]:
    """Return effects in which the two plants differ, in the catalogue's order of compensation."""
    return tuple(
        treatment
        for treatment in TREATMENTS
        if any(number_at(base, path) != number_at(extended, path) for path in treatment.fields)
    )


def compensation_of(
    base: Plant, extended: Plant, inputs: Iterable[str] = MASTER_INPUTS, *, new_model: bool = False
) -> Compensation:
    """Return what control takes back. new_model: the model in use was identified on the extended plant with this
    compensation, so it speaks straight volts and knows the friction; else what is the model's is left to a calibration.

    An extended plant without any of it gives the null compensation, its effects all in `limited`.
    """
    known_inputs, acting, limited = frozenset(inputs), [], []
    for treatment in differing_treatments(base, extended):
        why_not = _why_not(treatment, known_inputs, new_model)
        if why_not:
            limited.append((treatment.name, why_not))
        else:
            acting.append(treatment)
    names = tuple(treatment.name for treatment in acting)
    by = {treatment.by for treatment in acting}
    return Compensation(
        cell=_cell(extended, names) if By.CELL in by else None,
        command=_command(extended) if By.COMMAND in by else None,
        outside=_outside(extended, names) if By.OUTSIDE in by else None,
        timing=_timing(base, extended) if By.TIMING in by else None,
        acts=names,
        limited=tuple(limited),
    )


def without_compensable(plant: Plant) -> Plant:
    """Return the same plant with the effects off that a controller without compensation knows nothing of, whatever plant its
    calibration was made on: those of the cell, of the command map and from outside."""
    null = Plant()
    for treatment in TREATMENTS:
        if treatment.by in (By.CELL, By.COMMAND, By.OUTSIDE):
            for path in treatment.fields:
                section, name = path.split(".")
                plant = with_value(plant, section, name, number_at(null, path))
    return plant


def in_simulation(compensation: Compensation) -> Compensation:
    """Return the compensation without the forces from outside.
    A simulated rig is not told how the tool is held, so its plant does not feel them."""
    outside = {treatment.name for treatment in TREATMENTS if treatment.by is By.OUTSIDE}
    off = tuple((name, _NOT_SIMULATED) for name in compensation.acts if name in outside)
    if not off:
        return compensation
    acts = tuple(name for name in compensation.acts if name not in outside)
    return replace(compensation, outside=None, acts=acts, limited=(*compensation.limited, *off))


def compensation_words(compensation: Compensation) -> tuple[str, ...]:
    """Return what is compensated and what is not, for those who start the rig."""
    acts = f"compensated: {', '.join(compensation.acts) or 'nothing'}"
    return (acts, *(f"not compensated: {name}: {why}" for name, why in compensation.limited))


def _why_not(treatment: FieldTreatment, known_inputs: frozenset[str], new_model: bool) -> str:
    if treatment.by is By.NOTHING:
        return treatment.why_not
    if missing := [name for name in treatment.needs if name not in known_inputs]:
        return f"needs {' and '.join(missing)}, which nobody tells the controller"
    return CALIBRATE if treatment.by is By.MODEL and not new_model else ""


def _cell(plant: Plant, names: tuple[str, ...]) -> CellMap:
    """Of the effects that act alone: a warm cell without a thermometer keeps its bend."""
    cell = plant.cell
    return CellMap(
        quadratic_per_n=cell.quadratic_per_n if "sensor-quadratic" in names else 0.0,
        cubic_per_n2=cell.cubic_per_n2 if "sensor-cubic" in names else 0.0,
        span_per_k=cell.span_per_k if "thermal-span-drift" in names else 0.0,
        zero_n_per_k=cell.zero_n_per_k if "thermal-zero-drift" in names else 0.0,
        reference_c=cell.reference_c,
        crosstalk_n_per_v=cell.crosstalk_n_per_v if "valve-crosstalk" in names else 0.0,
        zero_n=cell.zero_n,
    )


def _command(plant: Plant) -> CommandMap:
    regulator = plant.regulator
    return CommandMap(bow=regulator.command_bow, s=regulator.command_s, full_scale_v=regulator.full_scale_v)


def _outside(plant: Plant, names: tuple[str, ...]) -> OutsideForce:
    contact, drags = plant.contact, "feed-drag" in names
    return OutsideForce(
        tilt_n=contact.tilt_n if "tilt-gravity" in names else 0.0,
        tilt_zero_rad=radians(contact.tilt_zero_deg),
        feed_drag_n_s_per_mm=contact.feed_drag_n_s_per_mm if drags else 0.0,
        feed_drag_n=contact.feed_drag_n if drags else 0.0,
        feed_drag_abs_n_s_per_mm=contact.feed_drag_abs_n_s_per_mm if drags else 0.0,
    )


def _timing(base: Plant, extended: Plant) -> TimingCompensation:
    before, now = base.regulator, extended.regulator
    return TimingCompensation(
        delay_s=now.delay_s,
        lags_s=now.lag_s + now.second_lag_s + extended.cell.filter_s,
        more_s=_answer_s(extended) - _answer_s(base),
        more_lag_s=now.lag_s - before.lag_s,
        more_second_lag_s=now.second_lag_s - before.second_lag_s,
    )


def _answer_s(plant: Plant) -> float:
    """From command to reading: delay and lags."""
    return plant.regulator.delay_s + plant.regulator.lag_s + plant.regulator.second_lag_s + plant.cell.filter_s
