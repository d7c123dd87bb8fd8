"""What a term is: one small formula for one effect, with the fields that switch it on and the column that it needs.

The running twin asks once which terms are on, and then calls those only: an effect that is off costs nothing. Replay
calls the same formulas with whole series.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from operator import attrgetter
from typing import Any, TypeAlias

from gateway.twin.elementwise import Real
from gateway.twin.surroundings import TwinConditions

Formula: TypeAlias = Callable[[Any, Real, TwinConditions], Real]
"""(section of the plant, force or pressure, moment) -> force or pressure with the effect."""


@dataclass(frozen=True, slots=True)
class Term:
    """switches: fields of which one must differ from 0; column: of TwinConditions, which must be known; None: needs none."""

    switches: tuple[str, ...]
    column: str | None
    formula: Formula


@cache
def _reader_of_switches(terms: tuple[Term, ...]) -> Callable[[Any], tuple[float, ...]]:
    """Read all switches at once: a search asks for thousands of plants in which nearly all of them are 0."""
    names = [name for term in terms for name in term.switches]
    return attrgetter(*names, names[0])


def is_switched_on(section: Any, names: Sequence[str]) -> bool:
    """Return whether one of these fields is not 0."""
    return any(getattr(section, name) != 0.0 for name in names)


def active_formulas(terms: tuple[Term, ...], section: Any, conditions: TwinConditions) -> tuple[Formula, ...]:
    """Return the formulas that are on for this section, in order."""
    if not any(_reader_of_switches(terms)(section)):
        return ()
    return tuple(
        term.formula
        for term in terms
        if is_switched_on(section, term.switches)
        and (term.column is None or getattr(conditions, term.column) is not None)
    )
