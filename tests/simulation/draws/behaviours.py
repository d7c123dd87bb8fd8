"""What masters do now and then besides, each drawn from a stream of its own, so that all other schedules stay as they are: one
whose program hangs while its frames flow on, one that stops what another has begun, one that writes its whole block, a
crowd that connects and says nothing, a machine without a process to give or busy for seconds, and blows that fall right behind
what has begun.
"""

from collections.abc import Iterator
from dataclasses import replace
from random import Random

from tests.simulation.draws.event import Event
from tests.simulation.masters.spelling import coil_pdu, coils_pdu, floats_pdu, mask_pdu, write_one_pdu, write_pdu

SHARE, CROWD_SHARE, REFUSED_SHARE, FRAMES_SHARE, PATH_SHARE = 0.24, 0.03, 0.15, 0.1, 0.1
STOPS = (
    write_one_pdu(0, 0),
    write_pdu(0, 0),
    write_pdu(0, 0, 0),
    coil_pdu(0, on=False),
    coils_pdu(0, 0, 1),
    mask_pdu(0, 0xFFFE, 0),
    floats_pdu(200, 0.0, is_swapped=False),
)
"""Any master may clear enable, by whatever function."""
MOST_CROWD = 60
FORCE_N = 4.0, 60.0
BEGUN = (
    Event(0.0, "worker", "take", (30.0,)),
    Event(0.0, "worker", "let_go"),
    Event(0.0, "worker", "self_test"),
    Event(0.0, "worker", "calibrate"),
    Event(0.0, "integrator", "upload"),
    Event(0.0, "machine", "terminate", (0.1, 0.0)),
    Event(0.0, "output", "push"),
    Event(0.0, "person", "say", data=b'{"do": "record", "on": true}'),
    Event(0.0, "person", "say", data=b'{"do": "calibration", "use": 0}'),
    Event(0.0, "person", "say", data=b'{"do": "calibrate", "plan": {"groups": 1, "step_v": 0.25}, "name": "20"}'),
)
_RUN = (
    b'{"do": "calibrate", "plan": {"groups": 1, "step_v": 0.25, "minor_points": 0, "response_steps": 0}, "name": "20"}'
)
REASONS = (
    (Event(0.0, "world", "cell-cut", (1.0,)), Event(0.0, "world", "cell-cut", (0.0,))),
    (Event(0.0, "output", "pull"), Event(0.0, "output", "push")),
    (Event(0.0, "rival", "take", (20.0,)), Event(0.0, "rival", "let_go")),
    (Event(0.0, "rival", "take", (40.0,)), Event(0.0, "rival", "fall_silent")),
    (
        Event(0.0, "person", "say", data=_RUN),
        Event(0.0, "person", "say", data=b'{"do": "calibrate", "stop": true}'),
    ),
)
"""Why a start may be refused for a while: how it begins, and how it ends."""
BLOWS = (
    Event(0.0, "machine", "kill", (0.1, 0.0)),
    Event(0.0, "machine", "kill", (0.1, 0.0)),
    Event(0.0, "machine", "kill_guardian", (0.1, 0.0)),
    Event(0.0, "machine", "terminate", (0.1, 0.0)),
    Event(0.0, "machine", "stop", (0.12, 0.0)),
    Event(0.0, "machine", "freeze", (0.3,)),
    Event(0.0, "output", "pull"),
    Event(0.0, "output", "push"),
    Event(0.0, "load_cell", "pull"),
    Event(0.0, "load_cell", "push"),
    Event(0.0, "worker", "vanish"),
    Event(0.0, "worker", "reset"),
)
CLOSE_S = 0.0003, 0.002, 0.01, 0.03, 0.16, 0.2, 0.35, 0.6
"""Less than a sentence takes on its wire, than a tick, than a start, and more."""


def draw_behaviours(seed: int) -> Iterator[Event]:
    """Return those of this seed in their order: none most often."""
    chance = Random(f"behaviour {seed}")
    draw, at_s = chance.random(), round(chance.uniform(0.5, 15.0), 4)
    if draw < SHARE:
        yield from chance.choice((_hang, _stop, _program, _refuse, _strike, _strike, _dawdle))(chance, at_s)
    elif draw < SHARE + CROWD_SHARE:
        yield from draw_crowd(chance, at_s)


def _command(chance: Random, at_s: float, whom: str) -> Event:
    return Event(at_s, whom, "take", (round(chance.uniform(*FORCE_N), 2),))


def _hang(chance: Random, at_s: float) -> Iterator[Event]:
    """Its driver goes on with the last frame; or a second one beats beside the owner that hangs, and owns nothing."""
    whom, other = chance.choice((("worker", "rival"), ("rival", "worker")))
    yield _command(chance, at_s, whom)
    at_s += chance.uniform(0.05, 4.0)
    yield Event(round(at_s, 4), whom, "hang")
    if chance.random() < 0.5:
        yield Event(round(at_s + 0.01, 4), other, "hold", (round(chance.uniform(*FORCE_N), 2),))


def draw_refused(seed: int) -> Iterator[Event]:
    """A master commands, again and again, what is refused for a while: its cell is cut, a run of this machine has the output,
    another one owns, a force is on its way to 0. Its program hangs meanwhile, most often; then the reason is over."""
    chance = Random(f"refused {seed}")
    if chance.random() > REFUSED_SHARE:
        return
    whom, other = chance.choice((("worker", "rival"), ("rival", "worker")))
    begins, ends = (replace(each, whom=other if each.whom == "rival" else each.whom) for each in chance.choice(REASONS))
    at_s = chance.uniform(0.5, 14.0)
    yield replace(begins, at_s=round(at_s, 4))
    at_s += chance.choice((0.06, 0.3, 1.0)) * chance.uniform(0.5, 1.5)
    way = chance.choice(("block", "block", "floats", "singles", "coils"))
    yield Event(round(at_s, 4), whom, "hold", (round(chance.uniform(*FORCE_N), 2),), way=way)
    at_s += chance.choice((0.25, 0.6, 1.5)) * chance.uniform(0.5, 1.5)
    if chance.random() < 0.8:
        yield Event(round(at_s, 4), whom, "hang")
    at_s += chance.choice((0.2, 0.6, 2.0)) * chance.uniform(0.5, 1.5)
    yield replace(ends, at_s=round(at_s, 4))


def draw_frames(seed: int) -> Iterator[Event]:
    """A program hangs that has two frames, each of which brings another heartbeat, on and on; now and then control dies, or all
    of the gateway, once the master is lost."""
    chance = Random(f"frames {seed}")
    if chance.random() > FRAMES_SHARE:
        return
    whom, at_s = chance.choice(("worker", "rival")), chance.uniform(0.5, 15.0)
    yield _command(chance, round(at_s, 4), whom)
    at_s += chance.uniform(0.05, 4.0)
    yield Event(round(at_s, 4), whom, "hang", (float(chance.randrange(20000, 60000)),))
    dies = chance.choice(("", "", "kill", "kill", "power_cut"))
    if dies:
        at_s += chance.choice((0.1, 0.3, 1.0)) * chance.uniform(0.5, 1.5) + (dies == "power_cut")
        yield Event(round(at_s, 4), "machine", dies, (0.1, 0.0))


def draw_paths(seed: int) -> Iterator[Event]:
    """A master writes a path of forces, stops at once, and goes on with another one now and then."""
    chance = Random(f"path {seed}")
    if chance.random() > PATH_SHARE:
        return
    whom, at_s = chance.choice(("worker", "rival")), chance.uniform(0.5, 12.0)
    yield _command(chance, round(at_s, 4), whom)
    for _ in range(chance.randrange(1, 4)):
        at_s += chance.uniform(0.3, 2.0)
        mean_n, share = chance.uniform(6.0, 40.0), chance.choice((0.05, 0.3, 0.9))
        numbers = (mean_n, share * min(mean_n, 55.0 - mean_n), chance.choice((0.4, 1.0, 4.0, 12.0)))
        yield Event(round(at_s, 4), whom, "follow", tuple(round(number, 2) for number in numbers))
        at_s += chance.uniform(0.5, 3.0)
        yield Event(round(at_s, 4), whom, "hold", (round(chance.uniform(*FORCE_N), 2),))


def _stop(chance: Random, at_s: float) -> Iterator[Event]:
    whom, other = chance.choice((("worker", "rival"), ("rival", "worker")))
    yield _command(chance, at_s, whom)
    for _ in range(chance.randrange(1, 4)):
        at_s += chance.choice((0.03, 0.3, 2.0)) * chance.uniform(0.5, 1.5)
        yield Event(round(at_s, 4), chance.choice((other, "fool", whom)), "ask", (1,), chance.choice(STOPS))
        if chance.random() < 0.5:
            yield Event(round(at_s + 0.002, 4), whom, "fall_silent")


def _program(chance: Random, at_s: float) -> Iterator[Event]:
    """Force, ramp, force before contact, ramp from the contact on, width of the band and time in it."""
    whom = chance.choice(("worker", "rival"))
    for _ in range(chance.randrange(1, 5)):
        ramp, before_n = chance.choice((0, 20, 300, 3000, 30000)), chance.choice((0, 200, 500, 900))
        contact_ms, band_n, band_ms = chance.choice((0, 50, 500, 3000)), chance.choice((0, 10, 300)), 100
        numbers = (round(chance.uniform(0.0, 60.0), 2), ramp, before_n, contact_ms, band_n, band_ms)
        yield Event(round(at_s, 4), whom, "program", tuple(map(float, numbers)))
        at_s += chance.choice((0.05, 0.5, 3.0)) * chance.uniform(0.5, 1.5)


def _refuse(chance: Random, at_s: float) -> Iterator[Event]:
    """A machine has no process to give, for a moment or for longer than anybody tries, when control dies."""
    yield _command(chance, at_s, "worker")
    at_s = round(at_s + chance.uniform(0.5, 2.0), 4)
    yield Event(at_s, "machine", "no_process", (round(chance.choice((0.05, 1.0, 5.0)) * chance.uniform(0.5, 1.5), 4),))
    yield Event(at_s, "machine", chance.choice(("kill", "kill", "kill_guardian", "terminate")), (0.1, 0.0))


def _strike(chance: Random, at_s: float) -> Iterator[Event]:
    """Something begins, and a blow falls close behind it, perhaps another one amid the start that follows."""
    yield _command(chance, at_s, "worker")
    at_s += chance.choice((0.002, 0.4, 2.0)) * chance.uniform(0.5, 1.5)
    yield replace(chance.choice(BEGUN), at_s=round(at_s, 4))
    for _ in range(chance.randrange(1, 4)):
        at_s += chance.choice(CLOSE_S) * chance.uniform(0.7, 1.3)
        yield replace(chance.choice(BLOWS), at_s=round(at_s, 4))


def _dawdle(chance: Random, at_s: float) -> Iterator[Event]:
    """A busy machine: control gets its processor late, again and again, and never so late that it counts as a standstill."""
    yield _command(chance, at_s, chance.choice(("worker", "rival")))
    yield from draw_delays(chance, at_s, chance.choice((0.02, 0.05, 0.09)))


def draw_delays(chance: Random, at_s: float, most_s: float) -> Iterator[Event]:
    """Each is at most so long."""
    for _ in range(chance.randrange(5, 40)):
        at_s += chance.uniform(0.02, 0.2)
        yield Event(round(at_s, 4), "machine", "stop", (round(chance.uniform(0.002, most_s), 4), 0.0))
        at_s += most_s


def draw_crowd(chance: Random, at_s: float) -> Iterator[Event]:
    """Many connect at once, from few addresses or from many, and say nothing, or half of a request."""
    count, hosts = chance.randrange(3, MOST_CROWD), chance.choice((1, 5, 40))
    yield Event(at_s, "crowd", "connect", (float(count), float(hosts), float(chance.choice((0, 3, 11)))))
