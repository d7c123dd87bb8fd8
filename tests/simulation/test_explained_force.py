"""Who judges whether a force that is off is explained sees one that is not, and nothing where something is going on."""

import struct

import pytest

from tests.simulation.judges.explained_force import HOLDING, ExplainedForce
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
