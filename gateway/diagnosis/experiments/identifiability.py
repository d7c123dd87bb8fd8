"""What this recording can show at all, asked before any verdict.

An effect is visible if one of its starts, which are sizes that one would notice, changes the readings beyond what the
base model could absorb and the noise could hide.
"""

from collections.abc import Sequence
from typing import Final

from gateway.catalogue.effect import Effect
from gateway.diagnosis.bench.bench import Bench
from gateway.diagnosis.model_fit.initial_state import with_known_rests
from gateway.diagnosis.model_fit.levenberg_marquardt import FitProblem
from gateway.diagnosis.result import NotIdentifiable
from gateway.diagnosis.search.model_comparison import ModelComparison

_VISIBLE: Final = 30.0  # chi-square that an effect must reach at a noticeable size


def find_invisible_effects(
    bench: Bench, effects: Sequence[Effect], first: ModelComparison, taken: frozenset[str]
) -> tuple[NotIdentifiable, ...]:
    """Return effects that this recording cannot show, with the reason; `taken` are part of the base model or found.

    first: the comparison beside the base model alone.
    """
    is_held = with_known_rests(bench, FitProblem(first.beside.parameters, first.beside.free)) is not None
    strength: dict[str, float] = {}
    share: dict[str, float] = {}
    for score in first.scores:
        name = score.candidate.effect.name
        strength[name] = max(strength.get(name, 0.0), score.power)
        share[name] = max(share.get(name, 0.0), score.alone)
    answers = []
    columns = bench.columns()
    for effect in effects:
        is_hidden = is_held and any(form.like_a_held_start for form in effect.forms)
        if effect.name in taken or effect.direct or (strength.get(effect.name, 0.0) >= _VISIBLE and not is_hidden):
            continue
        why = _why(effect, columns, strength.get(effect.name), share.get(effect.name, 0.0))
        if is_hidden:
            why = f"a force that friction holds at the first row says the same here; it needs {effect.excitation}"
        answers.append(NotIdentifiable(effect.name, why, effect.experiment))
    return tuple(answers)


def _why(effect: Effect, columns: frozenset[str], strength: float | None, share: float) -> str:
    wanted = [form.needs for form in effect.forms if not set(form.needs) <= columns]
    if strength is None and wanted:
        names = sorted({name for needs in wanted for name in needs if name not in columns})
        return f"the recording has no column {' or '.join(names)} that varies; it needs {effect.excitation}"
    if strength is None or strength == 0.0:
        return f"nothing in the recording excites it; it needs {effect.excitation}"
    if share < 0.05:
        absorbed = 100.0 * (1.0 - share)
        return f"the base model's own parameters absorb {absorbed:.0f} % of it; it needs {effect.excitation}"
    return f"at a noticeable size it would stay within the noise; it needs {effect.excitation}"
