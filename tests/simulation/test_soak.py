"""One gateway for a long time, in virtual time, under masters, faults and accidents that no process dies of: what it holds
does not grow, no law is broken, and in the end the force comes back.

For longer than a day: SOAK_SECONDS=604800 and `--long`.
"""

import asyncio
import gc
import os
import resource
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from gateway.profiles.strict_yaml.text import parse
from tests.conftest import READERS
from tests.simulation.draws.event import Event
from tests.simulation.draws.events import draw_events
from tests.simulation.draws.harmless_events import draw_harmless_events
from tests.simulation.kernel.edges import simulated_edges
from tests.simulation.kernel.fits import SimulatedFit
from tests.simulation.schedule import Simulation

PUSH_S, LONG_S = 200.0, float(os.environ.get("SOAK_SECONDS", "86400"))
HELD_S = 7500.0
SEED = 15
DEADLY = frozenset(("kill", "stop", "freeze", "kill_guardian", "terminate"))
MOST_MORE_BYTES = 4_000_000
PAGE = resource.getpagesize()


@dataclass(frozen=True)
class Held:
    """What a gateway, and the simulation around it, hold at one time."""

    at_s: float
    memory_bytes: int
    descriptors: int
    tasks: int
    stored_bytes: int


def measure(simulation: Simulation, folder: Path, at_s: float) -> Held:
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    assert simulation.service.inside
    return Held(
        at_s,
        pages * PAGE,
        len(list(Path("/proc/self/fd").iterdir())),
        len(asyncio.all_tasks(simulation.service.inside)),
        sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()),
    )


@pytest.fixture(autouse=True)
def keep_no_parsed_documents(monkeypatch: pytest.MonkeyPatch) -> None:
    """What other tests keep of documents that they read again and again would be counted as the gateway's: it stores new ones
    all day long."""
    for name in READERS:
        monkeypatch.setattr(f"{name}.parse", parse)


@pytest.fixture
def simulation(tmp_path: Path) -> Iterator[Simulation]:
    gc.freeze()  # what the tests before have left is not walked through at each measurement
    with simulated_edges(SimulatedFit):
        simulation = Simulation(SEED, tmp_path)
        with simulation.clock.as_the_kernels():
            yield simulation
            simulation.close()


def test_what_a_gateway_holds_does_not_grow_with_time(simulation: Simulation, tmp_path: Path, budget: int) -> None:
    duration_s = LONG_S if budget > 1 else PUSH_S
    held: list[Held] = []

    def events() -> Iterator[Event]:
        marks_s = [duration_s * eighth / 8 for eighth in range(2, 8)] + [0.99 * duration_s]
        for event in draw_events(SEED, duration_s):
            if marks_s and event.at_s >= marks_s[0]:
                held.append(measure(simulation, tmp_path, marks_s.pop(0)))
                print(held[-1])
            if event.what not in DEADLY:
                yield event

    print(f"seed {SEED}")
    outcome = simulation.run(events(), duration_s)
    assert not outcome.broken
    assert simulation.service.restarts == 0 and simulation.service.births == 1, "it is one process all the time"
    first, last = held[0], held[-1]
    assert last.memory_bytes - first.memory_bytes <= MOST_MORE_BYTES
    assert last.descriptors <= first.descriptors + len(simulation.masters)
    assert last.tasks <= first.tasks
    assert outcome.settings > duration_s, "something has happened"


@pytest.mark.long
def test_a_force_is_held_for_hours_beside_all_that_may_not_cost_it(simulation: Simulation) -> None:
    """Two hours and a few minutes, so that a heartbeat of 16 bits begins anew."""
    assert not simulation.run(draw_harmless_events(SEED, HELD_S), HELD_S).broken
