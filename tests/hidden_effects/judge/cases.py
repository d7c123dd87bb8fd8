"""What is asked of a diagnosis: one effect alone, two or three at once, a cause outside the catalogue, or nothing.
Drawn from a seed; the same seed gives the same cases."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from generator.catalogue import NAMES, OUTSIDE, physical_group
from generator.recording import Wish

KINDS = ("alone", "two", "three", "outside", "null")
GATE_S = 40.0
SEVERAL_SIZE = 0.7  # two or three effects together at 0.7 times the noise


@dataclass(frozen=True, slots=True)
class Case:
    kind: str
    wish: Wish


@dataclass(frozen=True, slots=True)
class Plan:
    """seeds per effect (or per kind); sizes: empty draws one of 0.3 .. 2 for each recording; colours: of the noise, empty
    draws one."""

    names: tuple[str, ...] = NAMES
    seeds: int = 1
    first_seed: int = 1
    sizes: tuple[float, ...] = ()
    excitation: str = "rich"
    colours: tuple[str, ...] = ()


def cases(plan: Plan) -> Iterator[Case]:
    """For each name its seeds and sizes. Names may also be the kinds null, two and three. Seeds outside, so that a run
    that is cut short has seen every name."""
    for seed in range(plan.first_seed, plan.first_seed + plan.seeds):
        for name in plan.names:
            for case in of_name(name, seed, plan):
                yield from (Case(case.kind, replace(case.wish, colour=one)) for one in plan.colours or (None,))


def of_name(name: str, seed: int, plan: Plan) -> Iterator[Case]:
    if name == "null":
        yield Case("null", Wish(seed=seed, size=0.0, excitation=plan.excitation))
    elif name in ("two", "three"):
        effects = some_together(seed, 2 if name == "two" else 3)
        yield Case(name, Wish(effects, plan.sizes[0] if plan.sizes else SEVERAL_SIZE, seed, plan.excitation))
    else:
        kind = "outside" if name in OUTSIDE else "alone"
        for size in plan.sizes or (drawn_size(seed, name),):
            yield Case(kind, Wish((name,), size, seed, plan.excitation))


def drawn_size(seed: int, name: str) -> float:
    """0.3 .. 2 times the noise, small as often as large."""
    rng = np.random.default_rng([seed, len(name), sum(map(ord, name))])
    return float(np.round(np.exp(rng.uniform(np.log(0.3), np.log(2.0))), 2))


def some_together(seed: int, count: int) -> tuple[str, ...]:
    """Effects of which no two are one picture by the page or by physics, nor spoil single rows of each other; without
    coulomb-friction, which has to be switched off in the base model to be seen."""
    rng, chosen = np.random.default_rng([seed, count, 77]), []  # type: ignore[var-annotated]
    for name in rng.permutation([name for name in NAMES if name != "coulomb-friction"]).tolist():
        if all(name not in physical_group(other) for other in chosen):
            chosen.append(name)
        if len(chosen) == count:
            break
    return tuple(chosen)


def gate_sample(seed: int) -> list[Case]:
    """Nine recordings for every push: 4 effects at drawn sizes, a pair and a three, a cause outside, two nulls, one of
    which is the paper's ladder. Shorter ones than a long run's, for they are answered in two thirds of its time."""
    rng = np.random.default_rng([seed, 24])
    alone = rng.choice(NAMES, 4, replace=False).tolist()
    outside = rng.choice(OUTSIDE, 1, replace=False).tolist()
    found = list(cases(Plan((*alone, *outside, "null"), first_seed=seed)))
    found += cases(Plan(("two",), first_seed=seed))
    found += cases(Plan(("three",), first_seed=seed + 4))
    found.append(Case("null", Wish(seed=seed, size=0.0, excitation="ladder")))
    return [replace(one, wish=replace(one.wish, duration_s=GATE_S)) for one in found]


def long_plan(seeds: int, nulls: int, first_seed: int) -> list[Case]:
    """Every effect and every outside cause as often as asked, as many nulls, twos and threes beside them."""
    groups: Sequence[Plan] = (
        Plan((*NAMES, *OUTSIDE), seeds, first_seed),
        Plan(("null",), nulls, first_seed),
        Plan(("two", "three"), 3 * seeds, first_seed),
    )
    return [case for plan in groups for case in cases(plan)]
