"""Who judges forces sees one that is off and not explained, and one that is dropped without a cause, and nothing more."""

import struct
from dataclasses import replace

import pytest

from tests.simulation.judges.explained_force import HOLDING, ExplainedForce
from tests.simulation.judges.held_force import HeldForce
from tests.simulation.judges.observer import STATUS_WORDS, Bounds, Observer

BOUNDS = Bounds(8.5, 40.0, 0.125, 0.1, 0.2, 0.05)
STATE, MEASURED, REQUESTED, APPLIED, LIMITED_BY, WARNINGS = 1, 2, 3, 5, 9, 11


def complaints(disturbed_s: float = 0.0, **changes: int) -> int:
    """Five seconds of looks at 20 N asked for and 17 N measured, but for what is changed in each, and once in the middle."""
    observer = Observer(BOUNDS)
    judge = ExplainedForce(observer)
    always, once = ({int(name[1:]): word for name, word in changes.items() if name[0] == which} for which in "ao")
    for number in range(50):
        words = dict.fromkeys(range(STATUS_WORDS), 0) | {STATE: HOLDING, MEASURED: 1700, REQUESTED: 2000, APPLIED: 2000}
        words |= always | (once if number == 25 else {})
        judge.note(struct.pack(f">{STATUS_WORDS}h", *words.values()), 10.0 + 0.1 * number, disturbed_s)
    return len(observer.broken)


def test_masters_who_take_the_force_from_each_other_between_two_looks_explain_it() -> None:
    observer = Observer(BOUNDS)
    judge = ExplainedForce(observer)
    block = struct.pack(f">{STATUS_WORDS}h", 0, HOLDING, 1700, 2000, 0, 2000, *[0] * (STATUS_WORDS - 6))
    for number in range(50):
        judge.note(block, 10.0 + 0.1 * number, 0.0)
        judge.note_write("one", 10.02 + 0.1 * number)
        judge.note_write("other", 10.07 + 0.1 * number)
    assert not observer.broken
    for number in range(50):
        judge.note(block, 15.0 + 0.1 * number, 0.0)
        judge.note_write("other", 15.02 + 0.1 * number)
    assert len(observer.broken) == 1


def test_another_weight_or_model_explains_the_force_until_it_has_come() -> None:
    observer = Observer(BOUNDS)
    judge = ExplainedForce(observer)
    block = struct.pack(f">{STATUS_WORDS}h", 0, HOLDING, 1700, 2000, 0, 2000, *[0] * (STATUS_WORDS - 6))
    for number in range(50):
        judge.note_write("one", 10.0 + 0.1 * number)
        if number == 20:
            judge.note_change(12.0)
        judge.note(block, 10.0 + 0.1 * number, 0.0)
    assert [round(float(line.split()[3].rstrip(":")), 1) for line in observer.broken] == [14.6]


@pytest.mark.parametrize(
    ("changes", "count"),
    [
        ({}, 1),
        ({f"a{MEASURED}": 1901}, 0),
        ({f"a{MEASURED}": -1700}, 1),
        ({f"a{MEASURED}": 2099}, 0),
        ({f"a{MEASURED}": 2101}, 1),
        ({f"a{STATE}": 1}, 0),
        ({f"a{LIMITED_BY}": 3}, 0),
        ({f"a{WARNINGS}": 1 << 1}, 0),
        ({f"a{WARNINGS}": 1 << 5}, 1),
        ({f"a{APPLIED}": 1800}, 0),
        ({f"o{REQUESTED}": 2100, f"o{APPLIED}": 2100}, 0),
        ({f"o{STATE}": 0}, 0),
        ({"disturbed_s": 13.0}, 0),
        ({"disturbed_s": 12.0}, 1),
    ],
)
def test_a_force_that_is_off_and_not_explained_is_seen(changes: dict[str, int], count: int) -> None:
    assert complaints(**changes) == count


@pytest.fixture
def observer() -> Observer:
    return Observer(BOUNDS)


HELD_N = 20.0


def look_at_held(observer: Observer, begun_s: float, *looks: tuple[int, float]) -> None:
    """A force is held from 1 s on, settled at 4.5 s. looks: state and force, every second from 4 s on."""
    held = HeldForce(observer, begun_s)
    held.expect(HELD_N, 1.0)
    for number, (state, force_n) in enumerate(looks):
        words = [0, state, round(100 * force_n)] + [0] * (STATUS_WORDS - 3)
        held.note(struct.pack(f">{STATUS_WORDS}h", *words), 4.0 + number)
    held.end()
    held.note(struct.pack(f">{STATUS_WORDS}h", *[0] * STATUS_WORDS), 9.0)


@pytest.mark.parametrize(
    "looks",
    [
        ((3, HELD_N), (4, HELD_N), (3, HELD_N)),
        ((3, HELD_N), (0, HELD_N), (3, HELD_N)),
        ((3, HELD_N), (3, HELD_N + 1.1), (3, HELD_N)),
        ((3, HELD_N), (3, HELD_N), (3, HELD_N - 1.1)),
    ],
)
def test_a_force_that_is_dropped_without_a_cause_is_seen(
    observer: Observer, looks: tuple[tuple[int, float], ...]
) -> None:
    look_at_held(observer, 2.0, *looks)
    assert [line.partition(" at ")[0] for line in observer.broken] == ["held force"]


def test_a_held_force_in_its_band_is_left_alone_and_so_is_one_that_has_begun_late(observer: Observer) -> None:
    look_at_held(observer, 2.0, (2, 1.0), (2, HELD_N - 0.9), (3, -HELD_N + 0.9))
    look_at_held(observer, 0.5, (4, 0.0), (0, 0.0))
    assert observer.broken == []


@pytest.mark.parametrize(("told_v", "force_n", "is_seen"), [(1.0, 21.1, False), (1.1, 21.1, True), (1.0, 18.9, True)])
def test_more_than_was_asked_for_is_no_dropped_force_where_nothing_less_may_be_out(
    told_v: float, force_n: float, is_seen: bool
) -> None:
    observer = Observer(replace(BOUNDS, voltage_min_v=1.0))
    observer.voltage_v = told_v
    look_at_held(observer, 2.0, (3, HELD_N), (3, force_n))
    assert bool(observer.broken) is is_seen


@pytest.mark.parametrize(("late_s", "state", "is_seen"), [(0.1, 3, False), (0.5, 3, True), (0.1, 4, True)])
def test_a_look_at_a_false_reading_tells_nothing_of_the_force_but_a_fault_is_seen(
    observer: Observer, late_s: float, state: int, is_seen: bool
) -> None:
    held = HeldForce(observer, 2.0)
    held.expect(HELD_N, 1.0)
    words = [0, state, 6000] + [0] * (STATUS_WORDS - 3)
    held.note(struct.pack(f">{STATUS_WORDS}h", *words), 5.0 + late_s, 5.0)
    assert bool(observer.broken) is is_seen
