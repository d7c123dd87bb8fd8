"""What happens in a few schedules one thing behind the other, each drawn from a stream of its own, so that all other schedules
stay as they are: an output that is away while it presses, a weight that is told late, another calibration under force.
"""

import json
from collections.abc import Iterable, Iterator
from dataclasses import replace
from random import Random
from typing import Any

from tests.simulation.draws.event import Event
from tests.simulation.masters.spelling import write_one_pdu

AWAY_SHARE, WEIGHT_SHARE = 0.06, 0.06
RECIPES_EVERY, RECIPES = 16, 5
"""Of so many rigs one has calibrations stored that differ from its own, where no force is held in its band all the time."""
TARES = 8
DEAF, DEAF_NO_MORE = ("deaf", (1.0,)), ("deaf", (0.0,))
AWAY: tuple[tuple[str, tuple[Any, ...], tuple[Any, ...]], ...] = (
    ("output", ("pull",), ("push",)),
    ("output", DEAF, DEAF_NO_MORE),
    ("world", ("output-cut", (1.0,)), ("output-cut", (0.0,))),
)
"""Who it is that goes, and how it comes back: a plug; a wire on which it hears nothing; one on which it says nothing."""
LEAST_DEAF_S = 0.9
"""Sooner nobody can notice, and a voltage may stand."""
ENDS = ("kill", "kill", "kill_guardian", "terminate", "stop")
TILT, PAYLOAD = 6, 9
TILTS = (0, 450, 900, 1350, 1800, -1800)


def draw_sequences(seed: int) -> Iterator[Event]:
    """Return those of this seed: none most often, never two."""
    chance = Random(f"sequence {seed}")
    draw = chance.random()
    begun_s = chance.uniform(1.0, 13.0)
    if has_recipes(seed):
        yield from _begin(begun_s, _draw_recipes(chance))
    elif draw < AWAY_SHARE:
        yield from _begin(begun_s, _draw_away(chance))
    elif draw < AWAY_SHARE + WEIGHT_SHARE:
        yield from _begin(begun_s, _draw_weight(chance))


def has_recipes(seed: int) -> bool:
    """Decide whether calibrations that differ are stored in the rig of a schedule."""
    return seed % RECIPES_EVERY == RECIPES


def _begin(begun_s: float, events: Iterable[Event]) -> list[Event]:
    late = (replace(event, at_s=round(begun_s + event.at_s, 4)) for event in events)
    return sorted(late, key=lambda event: event.at_s)


def _draw_away(chance: Random) -> Iterator[Event]:
    """The output is away while it presses, control most often restarts meanwhile, and behind its return somebody tares at once,
    and again and again."""
    whom, away, back = chance.choice(AWAY)
    gone_s = chance.uniform(1.2, 2.5)
    yield Event(0.0, "worker", "hold", (round(chance.uniform(10.0, 55.0), 2),))
    yield Event(gone_s - 0.001, "worker", chance.choice(("fall_silent", "let_go")))
    yield Event(gone_s, whom, *away)
    if chance.random() < 0.8:
        ends_s = gone_s + chance.uniform(-0.05, 0.6)
        yield Event(ends_s, "machine", chance.choice(ENDS), (round(chance.uniform(0.15, 0.4), 4), 0.0))
    back_s = gone_s + chance.choice((0.1, 0.6, 2.0, 4.0)) * chance.uniform(0.5, 1.5)
    back_s = max(back_s, gone_s + LEAST_DEAF_S) if back == DEAF_NO_MORE else back_s
    yield Event(back_s, whom, *back)
    if chance.random() < 0.6:
        yield Event(back_s + chance.choice((-0.1, 0.05, 0.2)), "rival", "reset")
    first_s, pause_s = back_s + chance.uniform(-0.2, 0.3), chance.choice((0.05, 0.15, 0.4))
    yield from (Event(first_s + pause_s * number, "rival", "tare") for number in range(TARES))


def _draw_weight(chance: Random) -> Iterator[Event]:
    """A master tells what its tool weighs, and how it is tilted, only behind its enable: before there is contact, or soon
    behind it; and tilts it further."""
    whom, told_s = chance.choice(("worker", "rival")), chance.choice((0.01, 0.1, 0.4, 3.0)) * chance.uniform(0.5, 1.5)
    if chance.random() < 0.5:
        yield Event(-0.2, "world", "no-contact", (1.0,))
        yield Event(3.1, "world", "no-contact", (0.0,))
    yield Event(0.0, whom, "take", (round(chance.uniform(2.0, 40.0), 2),))
    yield _write(told_s, whom, PAYLOAD, chance.choice((100, 500, 1500, 3000)))
    for _ in range(chance.randrange(4)):
        told_s += chance.choice((0.05, 0.5, 2.0)) * chance.uniform(0.5, 1.5)
        yield _write(told_s, whom, TILT, chance.choice(TILTS))
    if chance.random() < 0.5:
        yield _write(told_s + chance.uniform(0.1, 3.0), whom, PAYLOAD, 0)


def _draw_recipes(chance: Random) -> Iterator[Event]:
    """Somebody takes calibrations into use, to and fro, while a master presses and goes on to."""
    yield Event(0.0, "worker", "take", (round(chance.uniform(5.0, 60.0), 2),))
    for _ in range(chance.randrange(2, 7)):
        use: dict[str, Any] = {"use": chance.choice((1, 2, 3))} if chance.random() < 0.7 else {"rollback": True}
        yield Event(chance.uniform(0.1, 6.0), "person", "say", data=json.dumps({"do": "calibration", **use}).encode())
    if chance.random() < 0.6:
        what = chance.choice(("hold", "hold", "pull", "drive", "self_test"))
        most = {"self_test": (), "drive": (9.0,)}.get(what, (60.0,))
        numbers = tuple(round(chance.uniform(0.0, one), 2) for one in most)
        yield Event(chance.uniform(0.1, 6.0), "worker", what, numbers)


def _write(at_s: float, whom: str, address: int, word: int) -> Event:
    return Event(at_s, whom, "ask", (1,), write_one_pdu(address, word))
