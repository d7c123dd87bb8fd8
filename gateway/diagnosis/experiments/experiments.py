"""What to record next: for each effect of the catalogue an experiment that shows it, and one plan for several of them.

The catalogue's recipes say which blocks the gateway runs by itself, which columns must be recorded, and what a person has
to do. What is done meanwhile changes what every other block would show, so such a run stands alone.
Why an experiment shows its effect is the catalogue's own signature.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import inf
from typing import Final

from gateway.catalogue.all_effects import EFFECTS
from gateway.catalogue.effect import RECORDED, Effect
from gateway.control.runs.experiment_plan import ExperimentPlan, Part
from gateway.diagnosis.experiments.blocks import BLOCKS
from gateway.diagnosis.result import Diagnosis

USUAL_LONGEST_S: Final = 600.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment:
    """How one effect is made to show. columns: to record besides command and force; check: the coarse cycle may come
    first."""

    name: str
    why: str
    parts: tuple[Part, ...]
    columns: tuple[str, ...] = ()
    apart: str = ""
    meanwhile: str = ""
    check: bool = True

    @property
    def duration_s(self) -> float:
        """Duration of its parts together."""
        return sum(part.duration_s for part in self.parts)

    @property
    def is_alone(self) -> bool:
        """The gateway can do it without anybody's help, with what it records itself."""
        return not self.meanwhile and not self.apart and set(self.columns) <= RECORDED


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """A plan for several effects. left_out: (effect, why it needs a run of its own); apart: what a person does besides."""

    experiment: ExperimentPlan
    left_out: tuple[tuple[str, str], ...] = ()
    apart: tuple[str, ...] = ()

    @property
    def total_s(self) -> float:
        """Duration of the whole plan."""
        return self.experiment.duration_s


def experiment_of(effect: Effect) -> Experiment:
    """Return the experiment that an entry of the catalogue describes."""
    recipe = effect.recipe
    return Experiment(
        name=effect.name,
        why=f"{effect.what}: {effect.signature}",
        parts=tuple(BLOCKS[name] for name in recipe.parts),
        columns=tuple(dict.fromkeys((*effect.inputs, *recipe.columns))),
        apart=recipe.apart,
        meanwhile=recipe.meanwhile,
        check=recipe.check,
    )


EXPERIMENTS: Final[dict[str, Experiment]] = {effect.name: experiment_of(effect) for effect in EFFECTS}
"""By name of the effect, in the catalogue's order."""


def plan_for(names: Iterable[str], *, besides: Iterable[str] = (), longest_s: float = inf) -> Plan:
    """Plan one run that shows each of these effects, or tells them apart: blocks that several need once, shortest first.

    Where some need a person meanwhile and others do not, those that do are left out. Those of `besides` are taken as far as
    longest_s goes, those of `names` whatever the time.
    KeyError for a name that the catalogue does not have, ValueError for none.
    """
    first = tuple(dict.fromkeys(names))
    asked = [EXPERIMENTS[name] for name in dict.fromkeys((*first, *besides))]
    if not asked:
        raise ValueError("a plan needs at least one effect")
    together = [each for each in asked if not each.meanwhile] or [
        each for each in asked if each.meanwhile == asked[0].meanwhile
    ]
    left_out = [(each.name, f"needs a run of its own: {each.meanwhile}") for each in asked if each not in together]
    chosen, parts = _choose_within_time(together, first, longest_s)
    left_out += [
        (each.name, f"would take {_extra_s(each, parts):.0f} s more") for each in together if each not in chosen
    ]
    return Plan(
        experiment=_merge_experiments(chosen, parts),
        left_out=tuple(left_out),
        apart=tuple(dict.fromkeys(each.apart for each in chosen if each.apart)),
    )


def plan_next(diagnosis: Diagnosis) -> Plan | None:
    """Return what to record after this: what tells the groups apart, and shows what the recording could not; None for nothing.

    Groups come first and may take what time they need. Of the effects that the recording could not show, those are taken
    that the gateway can do alone, as far as the time goes; the others only where there is nothing else.
    """
    groups = [name for cause in diagnosis.causes if len(cause.group) > 1 for name in cause.group]
    unseen = [each.name for each in diagnosis.not_identifiable if each.name not in groups]
    alone = [name for name in unseen if EXPERIMENTS[name].is_alone]
    names = [*groups, *alone] or unseen
    if not names:
        return None
    plan = plan_for(groups or (alone or unseen)[:1], besides=names, longest_s=USUAL_LONGEST_S)
    left = [(name, _describe_needs(EXPERIMENTS[name])) for name in unseen if name not in names]
    return Plan(experiment=plan.experiment, left_out=(*plan.left_out, *left), apart=plan.apart)


def _describe_needs(experiment: Experiment) -> str:
    wanted = [name for name in experiment.columns if name not in RECORDED]
    columns = [f"record {' and '.join(wanted)}"] if wanted else []
    return "; ".join([*columns, *(text for text in (experiment.meanwhile, experiment.apart) if text)])


def _choose_within_time(
    experiments: Sequence[Experiment], must: Sequence[str], longest_s: float
) -> tuple[list[Experiment], list[Part]]:
    """What must be, then greedily what adds least; of equals the first one asked for."""
    chosen = [each for each in experiments if each.name in must]
    parts = list(dict.fromkeys(part for each in chosen for part in each.parts))
    rest = [each for each in experiments if each not in chosen]
    while rest:
        best = min(rest, key=lambda each: _extra_s(each, parts))
        if chosen and _extra_s(best, parts) + sum(part.duration_s for part in parts) > longest_s:
            break
        rest.remove(best)
        chosen.append(best)
        parts += [part for part in best.parts if part not in parts]
    return chosen, sorted(parts, key=lambda part: part.duration_s)


def _extra_s(experiment: Experiment, parts: Sequence[Part]) -> float:
    return sum(part.duration_s for part in experiment.parts if part not in parts)


def _merge_experiments(experiments: Sequence[Experiment], parts: Sequence[Part]) -> ExperimentPlan:
    names = tuple(each.name for each in experiments)
    return ExperimentPlan(
        name=f"{names[0]} and {len(names) - 1} more" if len(names) > 2 else " and ".join(names),
        description=experiments[0].why if len(names) == 1 else "",
        shows=names,
        columns=tuple(dict.fromkeys(column for each in experiments for column in each.columns)),
        by_hand=tuple(dict.fromkeys(each.meanwhile for each in experiments if each.meanwhile)),
        check=all(each.check for each in experiments),
        parts=tuple(parts),
    )
