"""What happens now and then besides (events.py), drawn from a stream of its own: a handful in a schedule, often two that belong
together.

Requests in pieces, bursts, uploads that interleave, what `sim set` sets, a load cell that turns into another one, an output
device that loses its power, and a disk that fails while something is recorded.
"""

import json
from collections.abc import Iterator
from dataclasses import replace
from random import Random
from typing import Any

from tests.simulation.draws.event import Event

EVERY_S = 8.0
LADDER_SHARE, LADDER_S = 0.04, 14.0
"""Of the schedules, and until when nothing else happens in these."""
SWITCHES = (
    "cell.silent",
    "cell.frozen",
    "cell.inverted",
    "cell.kgf",
    "output.silent",
    "output.refuse",
    "air.off",
    "contact.off",
)
NUMBERS = {
    "cell.scale": (0.1, 12.0),
    "cell.noise": (0.0, 6.0),
    "output.alter": (-2.0, 2.0),
    "wire.noise": (0.0005, 0.05),
    "around.supply_kpa": (0.0, 700.0),
    "around.temperature_c": (0.0, 60.0),
    "coulomb-friction": (0.0, 8.0),
    "backlash": (0.0, 0.001),
}
EFFECTS = (
    "transport-delay",
    "extra-lag",
    "leak",
    "creep",
    "supply-droop",
    "outliers",
    "repeated-samples",
    "sensor-cubic",
    "sign-loss",
)
REFUSED = ({"cell.scale": 0.0}, {"no-such": 1}, {"wire.noise": 2.0}, {"cell.unplug": "perhaps"}, {"leak.no-such": 1.0})
JAM_SHARE = 0.12
UNITS = (b" N", b" t", b"lb", b" g", b"kg")
PAUSES_S = (0.0003, 0.0012, 0.003, 0.012, 0.03, 0.2, 1.0, 6.0)
"""Shorter and longer than 1.5 and 3.5 characters of a bus, than a lease, and than half a frame is waited for."""
STALLS_S = (0.02, 0.1, 0.3, 1.0, 3.0)
"""Of a network; shorter and longer than a lease."""
DISKS = ("disk_full", "disk_broken", "disk_read_only", "disk_stumbles", "disk_hung")


def draw_ladder(seed: int) -> Iterator[Event]:
    """In few schedules a person lets a short ladder climb to its end, whose fit somebody then takes into use."""
    chance = Random(f"ladder {seed}")
    if chance.random() > LADDER_SHARE:
        return
    plan = {"v_max_v": 1.5, "step_v": 0.5, "groups": 1, "minor_points": 0, "response_steps": 0}
    yield _say(0.2, do="calibrate", plan=plan, name="60")
    if chance.random() < 0.2:
        yield Event(round(chance.uniform(1.0, LADDER_S), 4), "machine", chance.choice(DISKS), (0.0, 0.0))
    for at_s in sorted(round(chance.uniform(LADDER_S - 2.0, 24.0), 4) for _ in range(4)):
        yield _say(at_s, do="calibration", use=chance.randrange(1, 3), force=chance.random() < 0.3)


def draw_jam(seed: int) -> Iterator[Event]:
    """In some schedules the cell shows many times the force that is held, as where the tool jams."""
    chance = Random(f"jam {seed}")
    if chance.random() > JAM_SHARE:
        return
    at_s = round(chance.uniform(1.0, 19.0), 4)
    yield Event(at_s, "worker", "hold", (round(chance.uniform(10.0, 40.0), 2),))
    jams_s = round(at_s + chance.uniform(0.5, 3.0), 4)
    yield replace(_sim(set={"cell.scale": round(chance.uniform(3.0, 12.0), 2)}), at_s=jams_s)
    yield replace(_sim(clear=["cell.scale"]), at_s=round(jams_s + chance.uniform(0.2, 2.0), 4))


def _say(at_s: float, **fields: Any) -> Event:
    return Event(at_s, "person", "say", data=json.dumps(fields).encode())


def draw_rare_events(seed: int | str, duration_s: float) -> Iterator[Event]:
    """Return them in their order."""
    chance, at_s = Random(f"rare {seed}"), 0.0
    waiting: list[Event] = []
    while (at_s := at_s + chance.expovariate(1.0 / EVERY_S)) < duration_s:
        ready = sorted((event for event in waiting if event.at_s <= at_s), key=lambda event: event.at_s)
        waiting = [event for event in waiting if event.at_s > at_s]
        yield from ready
        first, *more = _draw(chance, at_s)
        yield first
        waiting += more
    yield from sorted((event for event in waiting if event.at_s < duration_s), key=lambda event: event.at_s)


def _draw(chance: Random, at_s: float) -> list[Event]:
    """Return an event, and what belongs to it, later."""
    kind = chance.choice(KINDS)
    return [_at(at_s + late_s, event) for late_s, event in kind(chance)]


def _at(at_s: float, event: Event) -> Event:
    return Event(round(at_s, 4), event.whom, event.what, event.numbers, event.data, event.way)


Drawn = list[tuple[float, Event]]


def _split(chance: Random) -> Drawn:
    whom, pause_s = chance.choice(("worker", "worker", "rival", "fool")), chance.choice(PAUSES_S)
    numbers = (round(chance.random(), 3), pause_s, float(chance.choice((1, 1, 2, 10))))
    return [(0.0, Event(0.0, whom, "split", numbers))]


def _burst(chance: Random) -> Drawn:
    whom = chance.choice(("worker", "worker", "rival"))
    return [(0.0, Event(0.0, whom, "burst", (float(chance.choice((2, 5, 20, 60))), float(chance.random() < 0.5))))]


def _network(chance: Random) -> Drawn:
    """A network that stands still and then delivers what it has kept, or a master that is gone without a word."""
    whom = chance.choice(("worker", "worker", "rival"))
    if chance.random() < 0.3:
        return [(0.0, Event(0.0, whom, "vanish"))]
    stall_s = chance.choice(STALLS_S) * chance.uniform(0.7, 1.3)
    return [(0.0, Event(0.0, whom, "stall", (round(stall_s, 4),)))]


def _standstill(chance: Random) -> Drawn:
    """A guardian, or the whole machine, that stands still for a while: suspended, copied to another host, swapped out."""
    what, seconds = (
        chance.choice(("stop_guardian", "freeze")),
        chance.choice((0.05, 0.3, 1.0)) * chance.uniform(0.5, 1.5),
    )
    return [(0.0, Event(0.0, "machine", what, (round(seconds, 4),)))]


def _uploads(chance: Random) -> Drawn:
    """Two at about the same time, each in its own time."""
    first, second = chance.sample(("integrator", "designer"), 2)
    pauses = [round(chance.choice((0.0, 0.001, 0.02, 0.1)) * chance.random(), 4) for _ in range(2)]
    late_s = chance.choice((0.0, 0.0005, 0.01, 0.1)) * chance.random()
    return [(0.0, Event(0.0, first, "upload", (pauses[0],))), (late_s, Event(0.0, second, "upload", (pauses[1],)))]


def _simulate(chance: Random) -> Drawn:
    """Something is set in the simulated rig, and most often cleared again."""
    draw = chance.random()
    values: dict[str, Any]
    if draw < 0.4:
        values = {chance.choice(SWITCHES): True}
    elif draw < 0.75:
        name = chance.choice(tuple(NUMBERS))
        values = {name: round(chance.uniform(*NUMBERS[name]), 5)}
    else:
        values = {chance.choice(EFFECTS): "on"} if draw < 0.95 else chance.choice(REFUSED)
    drawn = [(0.0, _sim(set=values))]
    if chance.random() < 0.7:
        clear = {"clear": list(values)} if chance.random() < 0.7 and draw < 0.95 else {"clear_all": True}
        drawn.append((chance.uniform(0.05, 5.0), _sim(**clear)))
    return drawn


def _sim(**fields: Any) -> Event:
    return Event(0.0, "world", "sim", data=json.dumps({"do": "sim", **fields}).encode())


def _cell(chance: Random) -> Drawn:
    """Somebody sets another unit or rate at the amplifier, and sets it back."""
    if chance.random() < 0.5:
        event, back = (
            Event(0.0, "load_cell", "unit", data=chance.choice(UNITS)),
            Event(0.0, "load_cell", "unit", data=b"kg"),
        )
    else:
        pace = chance.choice((0.5, 2.0, 2.6, 4.0))
        event, back = Event(0.0, "load_cell", "pace", (pace,)), Event(0.0, "load_cell", "pace", (1.0,))
    return [(0.0, event), (chance.uniform(0.3, 6.0), back)]


def _power(chance: Random) -> Drawn:
    """Most often it begins at 0 V; where it does not, it was away for longer than two polls: sooner nobody can notice."""
    power_on_v = chance.choice((0.0, 0.0, 0.0, 1.5))
    dark_s = chance.choice((0.3, 1.5) if power_on_v else (0.01, 0.06, 0.3, 1.5)) * chance.uniform(0.8, 1.5)
    return [(0.0, Event(0.0, "output", "power", (round(dark_s, 4), power_on_v)))]


def _recorded(chance: Random) -> Drawn:
    """A recording, a disk that fails under it, the end of the recording, and a disk that is well again."""
    end_s = chance.uniform(0.2, 3.0)
    drawn = [
        (0.0, _record(on=True)),
        (chance.uniform(0.0, 1.0), Event(0.0, "machine", chance.choice(DISKS), (0.0, 0.0))),
        (end_s, _record(on=False)),
    ]
    if chance.random() < 0.7:
        drawn.append((chance.uniform(0.3, 4.0), Event(0.0, "machine", "disk_free", (0.0, 0.0))))
    return drawn


def _record(*, on: bool) -> Event:
    return _say(0.0, do="record", on=on)


KINDS = (
    _split,
    _split,
    _burst,
    _network,
    _network,
    _standstill,
    _uploads,
    _simulate,
    _simulate,
    _cell,
    _power,
    _recorded,
)
