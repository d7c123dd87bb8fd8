"""The catalogue as changes: every effect, and what a base model fits, as numbers that are others in the new recordings."""

from collections.abc import Callable
from dataclasses import replace
from typing import Final

from gateway.catalogue.all_effects import BY_NAME, EFFECTS
from gateway.catalogue.cylinder import AREA, DRAG_ASYMMETRY
from gateway.catalogue.effect import Effect, EffectForm, Parameter, Recipe, SearchHints, Start, fixed_starts
from gateway.catalogue.regulator import LAG
from gateway.catalogue.sensing import CLOCK_OFFSET
from gateway.diagnosis.bench.parameters import ChangedValue, ModelParameters

GAIN: Final = "gain"
"""Name of a change of the machine's area, which belongs to every model and has no entry in the catalogue."""
_LAG_STARTS: Final = ((0.01,), (-0.01,))  # s
_AREA_STARTS: Final = ((2.0e-6,),)  # m2; the response is proportional
_OF_THE_START: Final = ("warm-up",)
"""A decay from the first row on: what friction, pads and lags remember there is each recording's own, and no change."""
_OF_THE_CONVERTER: Final = ("command-quantisation",)
"""Steps of the command do not wear in, and with hundreds of steps to choose from a saw tooth fits what other changes leave."""
_SHARES: Final = (0.3, -0.3, -0.65, 1.0)  # of a size that the machine has already
_GAIN_CHANGE: Final = Effect(
    name=GAIN,
    number=0,
    family="machine",
    what="the force that a pressure gives: area, or the sensitivity of the cell",
    signature="the residual is in proportion to the force",
    excitation="the force goes over the whole range",
    experiment="dead weights on the load cell tell whether it is the cell",
    recipe=Recipe(parts=()),
    treatments=(),
    forms=(EffectForm(parameters=(AREA,), probes=fixed_starts(*_AREA_STARTS), proportional=True),),
    group=("thermal-span-drift",),
)
_LAG_FORM: Final = EffectForm(parameters=(LAG,), probes=fixed_starts(*_LAG_STARTS))


def change_effects(machine: ModelParameters, recordings: frozenset[int], late_s: float) -> tuple[Effect, ...]:
    """Return every effect as a change in these recordings. late_s: see Options."""
    lag = BY_NAME["extra-lag"]
    entries = [replace(each, forms=(*each.forms, _LAG_FORM)) if each is lag else each for each in EFFECTS]
    unknown = {CLOCK_OFFSET.path, DRAG_ASYMMETRY.path} if late_s > 0.0 else set()
    found = []
    for effect in (*entries, _GAIN_CHANGE):
        forms = [form for form in effect.forms if not unknown & {each.path for each in form.parameters}]
        if forms and not effect.direct and effect.name not in (*_OF_THE_START, *_OF_THE_CONVERTER):
            found.append(replace(effect, forms=tuple(_change_form(form, machine, recordings) for form in forms)))
    return tuple(found)


def _change_form(form: EffectForm, machine: ModelParameters, recordings: frozenset[int]) -> EffectForm:
    parameters = tuple(ChangedValue(each, recordings) for each in form.parameters)
    return replace(form, parameters=parameters, probes=_probes(form, machine))


def _probes(form: EffectForm, machine: ModelParameters) -> Callable[[SearchHints], tuple[Start, ...]]:
    """The form's own starts, where the machine has nothing of it; else some share more and less of what it has."""
    size = form.parameters[0]
    there = machine.value(size) - size.null
    if there == 0.0 or form.quadrature or _is_of_every_model(size):
        return form.probes
    value = machine.value(size)
    shapes = tuple(machine.value(each) if each.shape else 0.0 for each in form.parameters[1:])
    return lambda hints: tuple((share * value, *shapes) for share in _SHARES)


def _is_of_every_model(parameter: Parameter) -> bool:
    return parameter.path in {AREA.path, LAG.path}
