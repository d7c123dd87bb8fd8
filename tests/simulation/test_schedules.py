"""Schedules of masters, faults and accidents, from seeds, against the whole control process in virtual time.

Another range: SIMULATION_SEEDS=1000:1200 (and SIMULATION_SECONDS=10). What a seed breaks is shrunk before it is told; what was
found so and mended stays in kept/, by theme.
"""

import gc
import os
from collections.abc import Iterator

import pytest

from tests.simulation.draws.event import Event
from tests.simulation.draws.events import draw_events
from tests.simulation.draws.schedules import draw_schedule
from tests.simulation.kept import load_cell, masters, output_line, people_at_the_machine, stopped_processes
from tests.simulation.schedule import Outcome, run_schedule
from tests.simulation.shrinking import shrink

PUSH_SEEDS, LONG_SEEDS = 500, 50_000
SHARD = 25
"""So many seeds are one test, ten times as many in a long run."""
SHRUNK = 3
"""Of a shard's broken seeds so many are shrunk, which takes a minute each; the others are told as they are."""
SECONDS = float(os.environ.get("SIMULATION_SECONDS", "23"))
"""Of events; with its start and its healing a schedule is one of 30 s."""
KEPT = [
    kept for theme in (masters, output_line, load_cell, people_at_the_machine, stopped_processes) for kept in theme.KEPT
]
"""Those that were found and kept: the seed of the machine, and what happened to it."""
KEPT_SECONDS = 24.0
"""Of each of them."""


def laws(outcome: Outcome) -> set[str]:
    return {line.partition(" at ")[0] for line in outcome.broken}


def tell(seed: int, events: list[Event], outcome: Outcome, *, shortest: bool) -> str:
    """What a seed broke, and the shortest list of events that breaks one of the same laws."""
    told = [f"seed {seed}, {SECONDS:g} s (again: SIMULATION_SEEDS={seed}:{seed + 1})", *outcome.broken]
    if shortest:
        was = laws(outcome)
        few = shrink(events, lambda some: bool(laws(run_schedule(seed, some, SECONDS)) & was))
        told += ["the shortest that breaks it:", *map(repr, few)]
    return "\n".join(told)


def shards(*, is_long: bool) -> list[range]:
    """The seeds of each test."""
    chosen = os.environ.get("SIMULATION_SEEDS", f"0:{LONG_SEEDS if is_long else PUSH_SEEDS}")
    first, end = map(int, chosen.split(":"))
    size = 10 * SHARD if is_long else SHARD
    return [range(start, min(start + size, end)) for start in range(first, end, size)]


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "shard" in metafunc.fixturenames:
        is_long = metafunc.config.getoption("--long")
        metafunc.parametrize("shard", shards(is_long=is_long), ids=lambda seeds: f"{seeds.start}-{seeds.stop - 1}")


def test_whatever_happens_no_law_is_broken_and_the_force_comes_back(shard: range) -> None:
    commits, broken = 0, list[str]()
    for seed in shard:
        events = list(draw_schedule(seed, SECONDS))
        outcome = run_schedule(seed, events, SECONDS)
        if outcome.broken:
            broken.append(tell(seed, events, outcome, shortest=len(broken) < SHRUNK))
        commits += outcome.commits
    assert not broken, "\n\n".join(broken)
    assert commits or len(shard) < 20, "uploads are refused, or not told as committed"


def test_a_seed_gives_the_same_run_bit_for_bit_and_another_one_another() -> None:
    first, again, other = (run_schedule(seed, draw_events(seed, 4.0), 4.0) for seed in (3, 3, 4))
    assert first == again
    assert first.fingerprint != other.fingerprint
    assert first.settings > 20 and first.largest_v > 1.0, "something has happened"


def test_no_garbage_is_collected_in_the_depth_of_a_schedule() -> None:
    """What closes the coroutines of a killed process must not run where a nested JSON has used up the recursion."""
    collects = set[bool]()

    def events() -> Iterator[Event]:
        for event in draw_events(3, 4.0):
            collects.add(gc.isenabled())
            yield event

    run_schedule(3, events(), 4.0)  # type: ignore[arg-type]
    assert collects == {False} and gc.isenabled()


@pytest.mark.parametrize(("seed", "events"), KEPT)
def test_what_was_found_and_mended_stays_so(seed: int, events: list[Event]) -> None:
    assert run_schedule(seed, events, KEPT_SECONDS).broken == ()
