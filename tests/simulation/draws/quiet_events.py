"""Few things, and time between them: a run, a force, an upload goes on undisturbed, for as long as it happens to, and then
several edges and blows fall within a tick or two of each other, from whomever; then all is put right, and it begins anew.

Where two things happen in a second (events.py), a run is ended in its first steps, and what belongs to its later ones is never
met by anything.
"""

import json
from collections.abc import Iterator
from dataclasses import replace
from math import inf, nan
from random import Random
from typing import Any

from tests.simulation.draws.behaviours import STOPS
from tests.simulation.draws.event import Event
from tests.simulation.draws.events import FAULTS, VALVE_FAULTS
from tests.simulation.draws.rare_events import DISKS, SWITCHES
from tests.simulation.masters.socket_lines import STEPS
from tests.simulation.masters.spelling import floats_pdu, mask_pdu, write_one_pdu, write_pdu

EVERY, QUIET = 8, 6
"""Of so many schedules one is such a one."""
SHORT = {"groups": 1, "step_v": 0.5, "v_max_v": 2.0, "minor_points": 1, "response_steps": 1}
SHORTEST = {"v_max_v": 1.5, "step_v": 0.5, "groups": 1, "minor_points": 0, "response_steps": 0}
GAPS_S = (0.0, 0.0, 0.0002, 0.001, 0.005, 0.02, 0.06, 0.2, 0.6)
"""From one edge or blow to the next: most often within the same tick."""
PAUSES_S = 1.0, 3.0
"""Until all is put right: a wire on which the output hears nothing is noticed by then, whatever stood."""
MOST_BLOWS = 4
BEFORE_SHARE = 0.2
"""Of all that begins: what begins amid a disturbance."""


def _say(**fields: Any) -> Event:
    return Event(0.0, "person", "say", data=json.dumps(fields).encode())


def _calibrate(**plan: Any) -> Event:
    """Of somebody who looks at it to its end."""
    return _say(do="calibrate", plan=plan, name="60")


def _machine(what: str, *numbers: float) -> Event:
    return Event(0.0, "machine", what, numbers)


def _sim(**fields: Any) -> Event:
    return Event(0.0, "world", "sim", data=json.dumps({"do": "sim", **fields}).encode())


BEGUN: tuple[tuple[Event, tuple[float, ...]], ...] = (
    (Event(0.0, "worker", "self_test"), (0.3, 10.1, 10.3)),
    (Event(0.0, "rival", "self_test"), (0.3, 10.1, 10.3)),
    (Event(0.0, "worker", "calibrate"), (0.3, 0.9, 9.0, 15.0)),
    (_calibrate(**SHORT), (0.7, 8.4, 15.1)),
    (_calibrate(**SHORTEST), (0.7, 8.8, 14.5, 15.0, 15.7)),
    (_calibrate(**SHORTEST, tare=True), (0.7, 8.8, 14.5, 15.0, 15.7)),
    (_calibrate(name="steps", parts=[STEPS, STEPS]), (0.7, 8.5, 9.1, 10.6)),
    (_calibrate(name="unchecked", check=False, parts=[STEPS]), (0.7, 1.2, 1.7)),
    (Event(0.0, "worker", "take", (30.0,)), (0.1, 0.4, 2.5)),
    (Event(0.0, "rival", "take", (45.0,), way="floats"), (0.1, 0.4, 2.5)),
    (Event(0.0, "worker", "take", (0.0,)), (0.1, 1.0)),
    (Event(0.0, "worker", "pull", (20.0,)), (0.1, 0.5, 0.9, 2.5)),
    (Event(0.0, "rival", "pull", (20.0,)), (0.1, 0.5, 0.9, 2.5)),
    (Event(0.0, "worker", "drive", (3.0,)), (0.1, 1.5)),
    (Event(0.0, "worker", "program", (25.0, 100.0, 300.0, 2000.0, 100.0, 100.0)), (0.5, 1.5, 4.0)),
    (Event(0.0, "worker", "tare"), (0.05, 0.15, 0.3)),
    (Event(0.0, "integrator", "upload", (0.0,)), (0.01, 0.1)),
    (Event(0.0, "designer", "recall"), (0.005, 0.05)),
)
"""What begins, and when it goes on to something else by itself, or has come to its end."""
CLUMSY = (
    write_pdu(0, 3, 0),
    write_pdu(0, 2, 1200),
    write_one_pdu(0, 2),
    write_one_pdu(0, 5),
    write_one_pdu(0, 33),
    write_one_pdu(0, 65),
    write_one_pdu(3, 1),
    write_one_pdu(0, 9),
    write_one_pdu(4, 7),
    write_one_pdu(1, 0),
    floats_pdu(202, nan, is_swapped=False),
    floats_pdu(202, inf, is_swapped=True),
    floats_pdu(202, 12.0, is_swapped=True),
    floats_pdu(300, 1.0, 12.0, is_swapped=True),
    write_one_pdu(1149, 0),
    write_one_pdu(1149, 5),
    write_one_pdu(1145, 1),
    mask_pdu(0, 0xFFFB, 4),
    mask_pdu(0, 0xFFFE, 1),
    b"\x08\x00\x00\x12\x34",
    b"\x2b\x0e\x01\x00",
)
"""Requests that are right at some times, and wrong at others, or always."""
BY_MASTERS = (
    *(Event(0.0, whom, what) for whom in ("worker", "rival") for what in ("let_go", "reset", "tare", "self_test")),
    *(Event(0.0, "worker", what) for what in ("calibrate", "fall_silent", "vanish", "disconnect", "hang")),
    *(Event(0.0, whom, "take", (18.0,)) for whom in ("worker", "rival")),
    *(Event(0.0, whom, "hold", (33.01,), way=way) for whom, way in (("worker", "block"), ("rival", "coils"))),
    *(Event(0.0, whom, "pull", (15.0,)) for whom in ("worker", "rival")),
    Event(0.0, "worker", "drive", (4.0,)),
    *(Event(0.0, "fool", "ask", (1,), stop) for stop in STOPS[:3]),
    *(Event(0.0, whom, "upload", (0.0,)) for whom in ("integrator", "designer")),
    *(Event(0.0, whom, "recall") for whom in ("integrator", "designer")),
)
BY_CLUMSY_MASTERS = tuple(Event(0.0, whom, "ask", (1,), pdu) for pdu in CLUMSY for whom in ("worker", "rival", "fool"))
BY_PEOPLE = (
    _say(do="calibrate", stop=True),
    _say(do="calibration", use=1),
    _say(do="calibration", rollback=True),
    _say(do="plant", use=2),
    _say(do="record", on=True),
    _say(do="record", on=False),
    _say(do="modbus", via="web", unit=1, pdu="0600000000"),
    _say(do="modbus", via="mqtt", unit=1, pdu="10000000020400010708"),
    _calibrate(**SHORTEST),
    _say(do="residual", cause=3, sentence="friction"),
    _say(do="residual", cause=0, worse="friction"),
)
BLOWS = (
    *(Event(0.0, "world", fault, (1.0,)) for fault in (*FAULTS, *VALVE_FAULTS)),
    *(Event(0.0, line, "pull") for line in ("output", "load_cell", "valve", "bus", "second bus")),
    Event(0.0, "output", "deaf", (1.0,)),
    Event(0.0, "output", "lost", (3.0, 0.5)),
    Event(0.0, "load_cell", "lost", (3.0, 0.5)),
    Event(0.0, "valve", "lost", (2.0, 0.5)),
    Event(0.0, "output", "power", (0.3, 0.0)),
    Event(0.0, "load_cell", "unit", data=b"lb"),
    Event(0.0, "load_cell", "pace", (2.6,)),
    *(_sim(set={switch: True}) for switch in SWITCHES),
    _sim(set={"cell.scale": 3.0}),
    _sim(set={"coulomb-friction": 8.0, "backlash": 0.001}),
    _machine("kill", 0.1, 0.0),
    _machine("kill", 0.1, 0.0),
    _machine("kill_guardian", 0.1, 0.0),
    _machine("power_cut", 0.1, 0.0),
    _machine("terminate", 0.1, 0.0),
    _machine("stop", 0.09, 0.0),
    _machine("stop", 0.2, 0.0),
    _machine("freeze", 0.3),
    _machine("stop_guardian", 0.3),
    _machine("no_process", 0.5),
    _machine("clock_jump", 0.1, -5000.0),
    *(_machine(disk, 0.0, 0.0) for disk in DISKS),
)
MET_BY = {
    ("pull", (20.0,)): tuple(Event(0.0, "world", fault, (1.0,)) for fault in VALVE_FAULTS),
    ("take", (30.0,)): (
        _sim(set={"cell.scale": 3.0}),
        _sim(set={"cell.kgf": True}),
        Event(0.0, "output", "power", (0.3, 0.0)),
    ),
    ("self_test", ()): (
        _sim(set={"cell.scale": 2.0}),
        _sim(set={"air.off": True}),
        Event(0.0, "output", "power", (0.3, 0.0)),
    ),
}
"""Disturbances that what begins is to find, and that others may not see."""
PUT_RIGHT = (
    *(Event(0.0, "world", fault, (0.0,)) for fault in (*FAULTS, *VALVE_FAULTS)),
    *(Event(0.0, line, "push") for line in ("output", "load_cell", "valve", "bus", "second bus")),
    Event(0.0, "output", "deaf", (0.0,)),
    Event(0.0, "load_cell", "unit", data=b"kg"),
    Event(0.0, "load_cell", "pace", (1.0,)),
    _sim(clear_all=True),
    _machine("disk_free", 0.0, 0.0),
)


def draw_quiet_events(seed: int, duration_s: float) -> Iterator[Event]:
    """Return what happens, in its order."""
    chance, at_s = Random(f"quiet {seed}"), 0.1
    while at_s < duration_s:
        for event in _draw_scene(chance):
            at_s += event.at_s
            if at_s < duration_s:
                yield replace(event, at_s=round(at_s, 4))


def _draw_scene(chance: Random) -> Iterator[Event]:
    """Return what happens in one, each with its time since the one before."""
    yield Event(chance.uniform(0.1, 0.6), chance.choice(("worker", "worker", "rival")), "reset", (1.0,))
    begun, moments_s = chance.choice(BEGUN)
    if chance.random() < BEFORE_SHARE:
        likely = MET_BY.get((begun.what, begun.numbers), BLOWS)
        yield replace(chance.choice(chance.choice((likely, BLOWS))), at_s=0.2)
    yield replace(begun, at_s=chance.uniform(0.4, 0.6))
    wait_s = chance.choice((chance.choice(moments_s), chance.uniform(0.0, max(moments_s)))) + chance.uniform(0.0, 0.3)
    for _ in range(chance.randrange(1, MOST_BLOWS + 1)):
        kinds = chance.choice((BY_MASTERS, BY_MASTERS, BY_CLUMSY_MASTERS, BY_PEOPLE, BLOWS, BLOWS))
        yield replace(chance.choice(kinds), at_s=wait_s)
        wait_s = chance.choice(GAPS_S) * chance.uniform(0.5, 1.5)
    pause_s = chance.uniform(*PAUSES_S)
    for event in PUT_RIGHT:
        yield replace(event, at_s=pause_s)
        pause_s = 0.0
