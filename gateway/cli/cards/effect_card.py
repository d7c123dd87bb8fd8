"""The card of one effect: what it does, its numbers, how it shows, what to record, and what control does about it."""

from collections.abc import Iterator
from typing import Final

from gateway.catalogue.effect import By, Effect, Parameter, Treatment
from gateway.cli.cards.card import Fact

_BY: Final = {
    By.MODEL: "by the model: a calibration made on the rig, or on the twin of the extended plant, contains it",
    By.COMMAND: "in the command: what is sent is bent so that the wanted volts arrive",
    By.CELL: "at the cell: a reading becomes the force that made it before anything looks at it",
    By.OUTSIDE: "as a force from outside, added to what the model expects",
    By.TIMING: "in the timing: the trim and the lead know of the delay",
}
"""What of the controller compensates it, in words."""


def effect_facts(effect: Effect) -> Iterator[Fact]:
    """Yield the facts of the card in reading order."""
    yield "family", effect.family
    yield "what", effect.what
    yield "signature", effect.signature
    yield from _several("parameter", (_describe_parameter(one) for one in effect.parameters))
    yield "to show it", effect.excitation
    yield "columns", _describe_columns(effect)
    yield "experiment", effect.experiment
    yield "recipe", _describe_recipe(effect)
    yield from _several("control", (_describe_treatment(effect, one) for one in effect.treatments))
    others = [name for name in effect.group if name != effect.name]
    yield "looks like", ", ".join(others)
    if effect.parameters:
        yield "try it", f"force-gateway sim set {effect.name}=on    (on a simulated rig; force-gateway sim clear)"


def _several(keyword: str, sentences: Iterator[str]) -> Iterator[Fact]:
    for place, sentence in enumerate(sentences):
        yield ("" if place else keyword), sentence


def _describe_parameter(parameter: Parameter) -> str:
    unit = f" {parameter.unit}" if parameter.unit else ""
    return f"{parameter.path}: off at {parameter.null:g}, searched {parameter.low:g} .. {parameter.high:g}{unit}"


def _describe_columns(effect: Effect) -> str:
    """Return which columns a recording must have for it, and which help."""
    helps = [name for name in effect.columns if name not in effect.needs]
    needed = " and ".join(effect.needs)
    return "; ".join(part for part in (needed and f"needs {needed}", helps and f"{', '.join(helps)} help") if part)


def _describe_recipe(effect: Effect) -> str:
    """Return what a gateway puts out to show it, and what a person does meanwhile."""
    parts = ", ".join(part.value for part in effect.recipe.parts)
    words = [f"the gateway puts out {parts}"] if parts else []
    words += [f"meanwhile {effect.recipe.meanwhile}"] if effect.recipe.meanwhile else []
    words += [f"apart from the run: {effect.recipe.apart}"] if effect.recipe.apart else []
    return "; ".join(words)


def _describe_treatment(effect: Effect, treatment: Treatment) -> str:
    fields = f" ({', '.join(treatment.fields)})" if treatment.fields else ""
    if treatment.by is By.NOTHING:
        return f"not compensated{fields}: {treatment.why_not}"
    asks = f"; control must be told {' and '.join(effect.inputs)}" if effect.inputs else ""
    return f"compensated {_BY[treatment.by]}{fields}{asks}"
