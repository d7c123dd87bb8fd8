"""What the watch takes of the machine: a small share of the processor in the long run, and memory that does not grow."""

import gc
import os
import subprocess
import sys
import tracemalloc
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import pytest

from gateway.diagnosis import Diagnosis
from gateway.profiles import load_rig
from gateway.recording.ring import RingReader, SampleRing
from gateway.service.running_rig.recording.recorded_row import COLUMNS
from gateway.twin.plant import plain_section
from gateway.watch.memory import return_memory
from gateway.watch.plant_comparison import PlantComparison
from gateway.watch.processor_budget import SHARE, STORE_S, ProcessorBudget
from gateway.watch.reference import WatchReference
from gateway.watch.residual_watch import Watch, WatchSettings

EVERY_S = 20.0
DAY_S = 86_400.0


def spend(look_s: float, until_s: float, budget: ProcessorBudget) -> tuple[float, list[float]]:
    """Look on and on, each time for so many seconds of a processor of our own; seconds spent, and the pauses."""
    now_s, spent_s, lasted_s, pauses_s = 0.0, 0.0, 0.0, list[float]()
    while now_s < until_s:
        pauses_s.append(budget.pause_s(EVERY_S, lasted_s, look_s))
        lasted_s = pauses_s[-1] + look_s
        now_s, spent_s = now_s + lasted_s, spent_s + look_s
    return spent_s, pauses_s


@pytest.mark.parametrize("look_s", [0.1, 1.0, 6.0, 40.0, 200.0])
def test_a_day_costs_no_more_than_its_share(look_s: float) -> None:
    spent_s, _ = spend(look_s, DAY_S, ProcessorBudget())
    assert spent_s <= SHARE * DAY_S + STORE_S + look_s
    assert SHARE <= 0.03


def test_cheap_looks_come_in_time_and_a_change_is_searched_for_at_once() -> None:
    budget = ProcessorBudget()
    _, pauses_s = spend(0.15, 1800.0, budget)
    assert {pause_s + 0.15 for pause_s in pauses_s} == {EVERY_S}
    searches = [budget.pause_s(EVERY_S, EVERY_S, 6.0) for _ in range(4)]
    assert searches == pytest.approx([24.0 - 6.0] * 4), "a quarter of a core, while the store lasts"
    assert max(budget.pause_s(EVERY_S, EVERY_S, 6.0) for _ in range(4)) > 200.0


def test_a_watch_that_waits_for_the_processor_is_not_charged_for_it() -> None:
    budget = ProcessorBudget(saved_s=0.0)
    assert budget.pause_s(EVERY_S, 1000.0, 6.0) == pytest.approx(18.0)


class Ring:
    """A gateway that moves between settings, 100 rows a second, as fast as somebody looks at them."""

    def __init__(self, descriptor: int) -> None:
        self.ring = SampleRing(descriptor, COLUMNS, capacity=1 << 12)
        self.row = 0

    def go_on(self, seconds: float) -> None:
        """Write rows of a force that the plant has nothing against."""
        for _ in range(round(100 * seconds)):
            self.row += 1
            level = 1.0 + self.row // 97 % 5
            facts = {"time_s": self.row / 100, "command_v": level, "force_n": 8.5 * level + self.row % 3 * 0.05}
            self.ring.append(tuple(facts.get(name, 0.0) for name in COLUMNS))


@pytest.fixture
def ring() -> Iterator[tuple[Ring, RingReader]]:
    descriptor = os.memfd_create("ring")
    ring, reader = Ring(descriptor), RingReader(descriptor)
    ring.go_on(30.0)
    yield ring, reader
    ring.ring.close()
    reader.close()
    os.close(descriptor)


def watch_of(reader: RingReader) -> Watch:
    """A watch that never searches."""
    plant = load_rig("demo", simulated=True).plant
    assert plant is not None

    def diagnose(*_: object) -> Diagnosis:
        raise AssertionError("a floor is known")

    reference = WatchReference(plant, is_settled=True, floors_n=dict.fromkeys(range(-8, 4), 1e3))
    return Watch(reader, PlantComparison(reference, diagnose, 0.25), WatchSettings(5.0, EVERY_S), lambda: 0.0)


def traced_bytes() -> int:
    """Memory that Python objects hold, but for a cache that has a bound of its own."""
    plain_section.cache_clear()
    gc.collect()
    return tracemalloc.get_traced_memory()[0]


@pytest.mark.long
def test_memory_does_not_grow_over_a_day_of_looks(ring: tuple[Ring, RingReader]) -> None:
    rows, reader = ring
    watch = watch_of(reader)

    def look(times: int) -> None:
        for _ in range(times):
            rows.go_on(0.5)
            watch.check_newest_window()

    look(3)
    tracemalloc.start()
    try:
        look(10)
        held = [traced_bytes()]
        for _ in range(2):
            look(int(DAY_S / EVERY_S) // 2)
            held.append(traced_bytes())
    finally:
        tracemalloc.stop()
    grown = [after - before for before, after in pairwise(held)]
    assert watch.counters["skipped"] == 0, watch.why_skipped
    assert min(grown) < 30_000, "bytes: what grows grows both times, what is filled once does not"


def test_returned_memory_of_the_compiler_is_read_again_when_it_is_needed() -> None:
    """In a process of its own: nothing is lost of the code that was given back."""
    script = (
        "import re, numba\n"
        "from pathlib import Path\n"
        "from gateway.watch.memory import resident_mb, return_memory\n"
        "before = resident_mb(); return_memory(); after = resident_mb()\n"
        "print(before - after, numba.njit(lambda value: value + 1)(41))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    saved_mb, answer = done.stdout.split()
    assert float(saved_mb) > 20.0
    assert answer == "42"


def test_where_nothing_can_be_returned_nothing_happens(monkeypatch: pytest.MonkeyPatch) -> None:
    called = list[str]()
    libc = SimpleNamespace(malloc_trim=lambda pad: called.append("trim"), madvise=lambda *_: called.append("advise"))
    monkeypatch.setattr("gateway.watch.memory._libc", lambda: libc)
    monkeypatch.setattr("gateway.watch.memory._MAPS", Path("/nowhere"))
    return_memory()
    monkeypatch.setattr("gateway.watch.memory._libc", lambda: object())
    return_memory()
    assert called == ["trim"], "no code is given back where nobody says where it is"
