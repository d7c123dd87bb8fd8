"""An experiment: what to put out and for how long, so that a recording shows what the last one could not.

A plan is made of parts, a part of moves. Levels are shares of what the rig may use (0: the lowest allowed voltage, 1: the
highest that nears no limit), newtons by the calibration in use, or volts; so one plan fits every rig, and its time is
known before one is. Nothing is clipped: a level beyond the rig's limits refuses the whole plan.
A ladder here stays on each stair for a given time; the calibration's own ladder, which waits until a stair has settled, is
gateway.control.runs.ladder_stairs'.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from enum import StrEnum
from typing import Annotated, Final

from annotated_types import Ge, Gt, Le, MinLen

from gateway.defaults import STRICT

LONGEST_S: Final = 7200.0
MOST_SEGMENTS: Final = 20_000

Seconds = Annotated[float, Ge(0), Le(3600)]


class MoveKind(StrEnum):
    """What a move does, from the level where the one before has ended (the first from the lowest)."""

    STEP = "step"  # at once to a level, then hold_s there
    DWELL = "dwell"  # stay where it is for hold_s
    RAMP = "ramp"  # evenly to a level in over_s, then hold_s there
    LADDER = "ladder"  # in so many even stairs to a level, hold_s on each
    REVERSALS = "reversals"  # so many times half of size up and half of it down, over_s for size, hold_s at each turn


@dataclass(frozen=True, slots=True, kw_only=True)
class Move:
    """One item of a part. A level is given in one of three ways, a size in one of two."""

    __pydantic_config__ = STRICT
    do: MoveKind
    to_share: Annotated[float, Ge(0), Le(1)] | None = None  # of the range that the rig may use
    to_n: Annotated[float, Ge(0)] | None = None  # by the rising branch of the calibration in use
    to_v: Annotated[float, Ge(0)] | None = None
    size_share: Annotated[float, Gt(0), Le(1)] | None = None  # from turn to turn
    size_v: Annotated[float, Gt(0)] | None = None
    stairs: Annotated[int, Ge(1), Le(1000)] | None = None
    times: Annotated[int, Ge(1), Le(1000)] | None = None
    over_s: Annotated[float, Gt(0), Le(3600)] | None = None  # left out in reversals: they are steps
    hold_s: Seconds | None = None

    @property
    def duration_s(self) -> float:
        """Seconds of the move."""
        over_s, hold_s = self.over_s or 0.0, self.hold_s or 0.0
        if self.do is MoveKind.LADDER:
            return (self.stairs or 0) * hold_s
        if self.do is MoveKind.REVERSALS:
            return 2.0 * (self.times or 0) * (over_s + hold_s)
        return over_s + hold_s

    @property
    def segments(self) -> int:
        """Number of stairs, turns and waits that are made of it."""
        if self.do is MoveKind.LADDER:
            return self.stairs or 1
        return 2 * (self.times or 0) + 1 if self.do is MoveKind.REVERSALS else 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """Moves that belong together, and what they are for."""

    __pydantic_config__ = STRICT
    name: Annotated[str, MinLen(1)]
    why: str = ""
    moves: tuple[Move, ...]

    @property
    def duration_s(self) -> float:
        """Duration of all moves, s."""
        return sum(move.duration_s for move in self.moves)


@dataclass(frozen=True, slots=True, kw_only=True)
class ExperimentPlan:
    """What to run and record. It makes no calibration."""

    __pydantic_config__ = STRICT
    name: Annotated[str, MinLen(1)]
    description: str = ""
    shows: tuple[str, ...] = ()  # effects of the catalogue that it is meant to show or to tell apart
    columns: tuple[str, ...] = ()  # to record besides time_s, command_v and force_n
    by_hand: tuple[str, ...] = ()  # what a person has to do while it runs
    check: bool = (
        True  # begin with the calibration's coarse cycle, which stops at a wrong sign, a wrong scale or no air
    )
    tare: bool = False  # take the force at rest as zero first
    parts: tuple[Part, ...]

    @property
    def duration_s(self) -> float:
        """Duration of the parts, s; zero and check come before."""
        return sum(part.duration_s for part in self.parts)

    @property
    def segments(self) -> int:
        """Number of stairs, turns and waits of all parts."""
        return sum(move.segments for part in self.parts for move in part.moves)


_LEVEL: Final = ("to_share", "to_n", "to_v")
_SIZE: Final = ("size_share", "size_v")
_NEEDED: Final[dict[MoveKind, tuple[tuple[str, ...], ...]]] = {
    MoveKind.STEP: (_LEVEL,),
    MoveKind.DWELL: (("hold_s",),),
    MoveKind.RAMP: (_LEVEL, ("over_s",)),
    MoveKind.LADDER: (_LEVEL, ("stairs",), ("hold_s",)),
    MoveKind.REVERSALS: (_SIZE, ("times",)),
}
"""One of each group must stand there."""
_ALLOWED: Final[dict[MoveKind, tuple[str, ...]]] = {
    MoveKind.STEP: ("hold_s",),
    MoveKind.DWELL: (),
    MoveKind.RAMP: ("hold_s",),
    MoveKind.LADDER: (),
    MoveKind.REVERSALS: ("over_s", "hold_s"),
}
"""May stand there besides."""


def move_faults(move: Move) -> Iterator[tuple[str, str]]:
    """Return (key, sentence) for what this kind of move lacks, has twice, or does not take; key empty for the move itself."""
    given = [field.name for field in fields(move) if field.name != "do" and getattr(move, field.name) is not None]
    known = {name for group in _NEEDED[move.do] for name in group} | set(_ALLOWED[move.do])
    for name in given:
        if name not in known:
            yield name, f"means nothing in a {move.do}"
    for group in _NEEDED[move.do]:
        chosen = [name for name in given if name in group]
        if not chosen:
            yield "", f"a {move.do} needs {' or '.join(group)}"
        for name in chosen[1:]:
            yield name, f"{chosen[0]} is given already: one of the two"
    if move.do is MoveKind.REVERSALS and not move.duration_s:
        yield "", "reversals take no time: give hold_s or over_s"


def _unprintable_names(plan: ExperimentPlan) -> Iterator[tuple[tuple[str | int, ...], str]]:
    """Return (path, sentence) for each text that is shown on a terminal, or in the log, and may not be."""
    lists = {"columns": plan.columns, "by_hand": plan.by_hand}
    shown = [(("name",), plan.name), *((("parts", p, "name"), part.name) for p, part in enumerate(plan.parts))]
    shown += [((key, place), text) for key, texts in lists.items() for place, text in enumerate(texts)]
    for path, text in shown:
        if not text.isprintable():
            yield path, "has signs that cannot be printed on one line"


def plan_faults(plan: ExperimentPlan) -> Iterator[tuple[tuple[str | int, ...], str]]:
    """Return (path, sentence) for everything that the types cannot say. Turns are counted, not made: a plan of a few lines may
    mean a million, and who asks is the loop that holds a force."""
    yield from _unprintable_names(plan)
    for p, part in enumerate(plan.parts):
        if not part.moves:
            yield ("parts", p, "moves"), "is empty: a part has at least one move"
        for m, move in enumerate(part.moves):
            for key, sentence in move_faults(move):
                yield ("parts", p, "moves", m, *((key,) if key else ())), sentence
    if not plan.parts:
        yield ("parts",), "is empty: a plan has at least one part"
    elif not 0.0 < plan.duration_s <= LONGEST_S:
        yield ("parts",), f"the parts take {plan.duration_s:g} s, allowed up to {LONGEST_S:g} s"
    elif plan.segments > MOST_SEGMENTS:
        yield ("parts",), f"the parts have {plan.segments} stairs and turns, at most {MOST_SEGMENTS}"
