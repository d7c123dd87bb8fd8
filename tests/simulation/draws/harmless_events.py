"""What may not cost a force that a master holds: of everything that is drawn (events.py, rare_events.py) that which leaves its
master, its cell and its output at work, more densely than usual.

Others ask, write, upload and send nonsense; people at the machine question, record and use sets; disks fail, clocks jump; one
answer now and then is spoiled on its wire.
"""

from collections.abc import Iterator
from dataclasses import replace
from heapq import merge
from operator import attrgetter
from random import Random

from gateway.processes.json_socket.messages import load_shallow
from tests.simulation.draws.behaviours import draw_crowd, draw_delays
from tests.simulation.draws.event import Event
from tests.simulation.draws.events import draw_usual
from tests.simulation.draws.rare_events import DISKS, draw_rare_events
from tests.simulation.masters.spelling import WAYS, WRITES, control_of, written_address

BEGIN_S = 0.1
FORCE_N = 8.0, 40.0
HELD_S = 7.0
"""Until the master wants another force, on average."""
STREAMS = 3
LONGEST_STOP_S = 0.03
LONGEST_LATE_S = 0.04
LONGEST_GAP_S = 0.03
"""Inside of a request."""
LONGEST_STALL_S = 0.04
"""Of a network between two heartbeats, which come twice as often as a lease ends, or a little less."""
LONGEST_PDU = 253
COMMANDS_END = 400
"""Behind the blocks in which a master commands."""
APART_S = 1.0
"""Between two moments in which a sample or an answer is lost: more than one in a row may cost the force."""
TRUTHFUL = ("late", "lost", "doubled")
"""What may happen to an answer of the cell or the valve: it is gone, or late. A cut one is another number in some protocols."""
FALSE = "digit"
"""And to one reading of the cell: a number that it has not said."""
QUIET = ("calibrate", "self_test", "reset", "let_go", "tare", "burst")
"""What another master may do to stop the force, by right."""
ENABLE, TAKE = 1, 8
CROWD_SHARE, DELAYS_SHARE = 0.2, 0.2


def draw_harmless_events(seed: int, duration_s: float) -> Iterator[Event]:
    """A master that holds, and what happens beside it, in its order."""
    streams = [draw_usual(Random(f"held {seed} {number}"), duration_s) for number in range(STREAMS)]
    drawn = merge(*streams, draw_rare_events(f"held {seed}", duration_s), key=attrgetter("at_s"))
    crowds = tuple(_draw_crowds(seed, duration_s))
    return merge(_draw_holds(seed, duration_s), _keep_harmless(drawn), crowds, key=attrgetter("at_s"))


def _draw_crowds(seed: int, duration_s: float) -> Iterator[Event]:
    chance = Random(f"held crowd {seed}")
    if chance.random() < CROWD_SHARE:
        yield from draw_crowd(chance, round(chance.uniform(1.0, 0.8 * duration_s), 4))
    elif chance.random() < DELAYS_SHARE:
        yield from draw_delays(chance, chance.uniform(1.0, 0.5 * duration_s), LONGEST_STOP_S)


def _draw_holds(seed: int, duration_s: float) -> Iterator[Event]:
    """A schedule pushes or pulls: a coil alone does not say which, and a valve that turns costs the force for its time."""
    chance, at_s = Random(f"held {seed}"), BEGIN_S
    pulls = chance.random() < 0.5
    ways = [way for way in WAYS if not (pulls and way == "coil")]
    while at_s < duration_s:
        way = chance.choice(ways) if chance.random() < 0.4 else "block"
        force_n = 0.02 * round(50.0 * chance.uniform(*FORCE_N)) + 0.01 * pulls
        yield Event(round(at_s, 4), "worker", "hold_on", (round(force_n, 2),), way=way)
        at_s += chance.expovariate(1.0 / HELD_S)


def _keep_harmless(drawn: Iterator[Event]) -> Iterator[Event]:
    shaken_s = BEGIN_S
    for event in drawn:
        if event.at_s > 2.0 * BEGIN_S and _is_harmless(event):
            if _shakes(event):
                if event.at_s - shaken_s < APART_S:
                    continue
                shaken_s = event.at_s
            yield _soften(event)


def _shakes(event: Event) -> bool:
    """Whether a sample, an answer or a tick is lost by it."""
    return event.what in ("stop", "freeze") or (event.whom in ("output", "load_cell", "valve") and event.what != "push")


def _soften(event: Event) -> Event:
    """One lost answer, or a short standstill, is what may not cost a force."""
    if event.what in ("stop", "freeze"):
        return replace(event, numbers=(min(event.numbers[0], LONGEST_STOP_S), 0.0))
    if event.what == "stall" and event.whom == "worker":
        return replace(event, numbers=(min(event.numbers[0], LONGEST_STALL_S),))
    if event.what == "split":
        return replace(event, numbers=(event.numbers[0], min(event.numbers[1], LONGEST_GAP_S), 1.0))
    if event.what == "late":
        return replace(event, numbers=(1.0, min(event.numbers[1], LONGEST_LATE_S)))
    if _shakes(event) and event.numbers:
        return replace(event, numbers=(1.0, event.numbers[1]))
    return event


def _is_harmless(event: Event) -> bool:
    match event.whom:
        case "worker":
            return event.what in ("burst", "split", "tare", "stall") or (
                event.what == "ask" and not _commands(event.data)
            )
        case "rival" | "fool":
            return event.what not in QUIET and not (event.what == "take" or _may_stop(event.data))
        case "villain" | "integrator" | "designer":
            return True
        case "person":
            return not _asks_to_stop(event.data)
        case "machine":
            return event.what in (*DISKS, "disk_free", "clock_jump", "stop", "stop_guardian", "freeze")
        case "load_cell" | "valve":
            return event.what in ("push", *TRUTHFUL) or (event.what == FALSE and event.whom == "load_cell")
        case "output":
            return event.what not in ("pull", "power", "torn", "say")
        case "bus":
            return event.what != "pull"
    return False


def _commands(pdu: bytes) -> bool:
    """Whether a request may write what its own master commands: words, coils or numbers; or end its connection, as one that
    is longer than Modbus allows does."""
    return len(pdu) > LONGEST_PDU or (pdu[0] in WRITES and (pdu[0] in (5, 15) or written_address(pdu) < COMMANDS_END))


def _may_stop(pdu: bytes) -> bool:
    """Whether a request clears enable, takes over, or changes bits of the control word."""
    control = control_of(pdu) if pdu else None
    return control is not None and (control < 0 or not control & ENABLE or bool(control & TAKE))


def _asks_to_stop(line: bytes) -> bool:
    """Whether a person's line is a request of a master's that clears enable."""
    try:
        request = load_shallow(line)
        return request["do"] == "modbus" and _may_stop(bytes.fromhex(request["pdu"]))
    except (ValueError, KeyError, TypeError):
        return False
