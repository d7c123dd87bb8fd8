"""Right, wrong, or honest about not knowing: the score of one answer, one recording at a time."""

from collections.abc import Sequence
from dataclasses import dataclass

from generator.catalogue import page_group
from judge.engine import Answer, Blamed

SURE = 0.95


@dataclass(frozen=True, slots=True)
class Score:
    """right: every hidden effect is named, by itself or in a group that the page allows, and nothing else is.
    honest: the same, where any group that holds the truth counts. wrong: something else was blamed without a doubt.
    alarm: anything was blamed where nothing is. described: it said that something is left, or that it does not know.
    """

    right: bool
    honest: bool
    named: bool
    wrong: bool
    alarm: bool
    described: bool


def score(kind: str, truth: Sequence[str], answer: Answer) -> Score:
    """kind: of cases.KINDS. For one effect `right` allows further causes: those are counted by `wrong`, if sure."""
    inside = truth if kind != "outside" else ()
    strict, loose = (matched(inside, answer.causes, page) for page in (True, False))
    enough = exact if kind in ("two", "three") else covers
    return Score(
        right=bool(inside) and enough(strict, inside, answer.causes),
        honest=bool(inside) and enough(loose, inside, answer.causes),
        named=bool(inside) and set(inside) <= {cause.name for cause in answer.causes},
        wrong=any(sure(cause, answer) and not holds(cause, inside) for cause in answer.causes),
        alarm=not truth and (bool(answer.causes) or answer.verdict in ("confirmed", "partial")),
        described=bool(answer.leftover) or answer.verdict in ("partial", "unknown"),
    )


def sure(cause: Blamed, answer: Answer) -> bool:
    return answer.verdict == "confirmed" or cause.confidence >= SURE


def holds(cause: Blamed, truth: Sequence[str]) -> bool:
    return any(name == cause.name or name in cause.group for name in truth)


def fits(cause: Blamed, name: str, page_only: bool) -> bool:
    """The name itself, or a group with it in it (page_only: whose first name the page lets stand for it)."""
    if cause.name == name:
        return True
    return name in cause.group and (not page_only or cause.name in page_group(name))


def matched(truth: Sequence[str], causes: Sequence[Blamed], page_only: bool) -> dict[str, int]:
    """Hidden effect -> place of the cause that stands for it; each cause stands for one effect. Exact names first."""
    found: dict[str, int] = {}
    pairs = [(cause.name != name, name, place) for name in truth for place, cause in enumerate(causes)]
    for _inexact, name, place in sorted(pairs):
        if name not in found and place not in found.values() and fits(causes[place], name, page_only):
            found[name] = place
    return found


def covers(found: dict[str, int], truth: Sequence[str], _causes: Sequence[Blamed]) -> bool:
    return len(found) == len(truth)


def exact(found: dict[str, int], truth: Sequence[str], causes: Sequence[Blamed]) -> bool:
    return len(found) == len(truth) == len(causes)
